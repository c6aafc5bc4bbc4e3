"""A page of the viewer as a person uses it: by mouse and keyboard, reading what it shows."""

from __future__ import annotations

import io
import threading
from pathlib import Path

import numpy as np

from chromium import PATIENCE


class Visit:
    """A viewer and a page that looks at it, with all that the page asked for and complained of."""

    def __init__(self, browser, robot, size=(1200, 800), **options):
        from notchflex.viewer import Viewer

        self.viewer = Viewer(robot, **options)
        self.thread = threading.Thread(target=self.viewer.run)
        self.thread.start()
        self.page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        self.page.set_default_timeout(PATIENCE)
        self.errors, self.hosts = [], set()
        self.page.on("console", self._heard)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self._asked(request.url))
        self.page.on("websocket", lambda socket: self._asked(socket.url))
        self.page.goto(self.viewer.address)
        self.page.wait_for_selector("[data-name=total_angle]")
        self.settle()

    def _heard(self, message):
        if message.type == "error":
            self.errors.append(message.text)

    def _asked(self, url):
        if not url.startswith(("data:", "blob:")):
            self.hosts.add(url.split("/")[2])

    def read(self, name):
        return self.page.locator(f"[data-name={name}]").inner_text()

    def angle(self):
        return float(self.read("total_angle"))

    def settle(self):
        """Wait until the page draws smoothly: it has taken in all that was sent."""
        self.page.wait_for_function(
            """() => new Promise(done => {
                let frames = 0; const start = performance.now();
                const one = () => {
                    frames++;
                    if (performance.now() - start > 1000) done(frames > 3);
                    else requestAnimationFrame(one);
                };
                requestAnimationFrame(one);
            })"""
        )

    def wait_for(self, name, value):
        self.page.wait_for_function(
            "([name, value]) => document.querySelector(`[data-name=${name}]`).innerText === value",
            arg=[name, value],
        )

    def still(self):
        """Wait until the robot has not moved for a second; return its numbers then."""
        names = ("tension_1", "stroke_1", "total_angle")
        before = None
        for _ in range(120):
            now = [self.read(name) for name in names]
            if now == before:
                return dict(zip(names, map(float, now), strict=True))
            before = now
            self.page.wait_for_timeout(1000)
        raise AssertionError("the robot never stands still")

    def row(self, label):
        """The control with a label; hidden ones are not on the page."""
        label = f"//label[normalize-space()='{label}']"
        return self.page.locator(f"xpath={label}/ancestor::div[contains(@class, 'Flex-root')][1]")

    def slider(self, label="tension [N]"):
        return self.row(label).get_by_role("slider")

    def box(self, label="tension [N]"):
        """The field beside a slider, or a field alone."""
        return self.row(label).locator("input[inputmode]").last

    def type(self, label, text, delay=30):
        """Type into a field as a person does, and go to another place of the page."""
        self.box(label).click()
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(str(text), delay=delay)
        self.page.keyboard.press("Tab")

    def set(self, label, value, delay=30):
        """Type a number and wait until the robot is there."""
        self.type(label, value, delay)
        name = "stroke_1" if label.startswith("stroke") else "tension_1"
        self.wait_for(name, f"{value:.3f}")

    def set_tension(self, value):
        self.set("tension [N]", value)

    def set_stroke(self, value):
        self.set("stroke [mm]", value)

    def choose(self, label, after):
        """Choose an entry of the list with a label."""
        self.row(label).locator("input").first.click()
        self.page.get_by_role("option", name=after, exact=True).click()

    def chosen(self, label):
        return self.row(label).locator("input").first.input_value()

    def press(self, name):
        self.page.get_by_role("button", name=name, exact=True).click()

    def open(self, folder):
        self.page.get_by_text(folder, exact=True).click()

    def notice(self, text):
        """The notice with a text, once it is there."""
        found = self.page.locator("[data-name=notice][role=alert]").filter(has_text=text)
        found.wait_for()
        return found.inner_text()

    def no_notice(self):
        """Wait until the page has nothing to say."""
        self.page.wait_for_function(
            "() => document.querySelector('[data-name=notice]').innerText === ''"
        )

    def loop_is(self, by, *names):
        """Wait until the loop is against tension or stroke and has lines with names."""
        self.page.wait_for_function(
            """([by, names]) => {
                const plot = document.querySelector('.js-plotly-plot');
                return plot && plot.layout.xaxis.title.text.includes(by)
                    && plot.data.map(line => line.name).join() === [...names, 'now'].join();
            }""",
            arg=[by, list(names)],
        )

    def saved(self, button):
        """What a button sends to be saved: its name and its bytes."""
        if not self.page.get_by_role("button", name=button).is_visible():
            self.open("Save")
        with self.page.expect_download(timeout=PATIENCE) as waiting:
            self.page.get_by_role("button", name=button).click()
        return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()

    def reset(self):
        self.press("Reset")
        self.wait_for("tension_1", "0.000")
        self.wait_for("total_angle", "0.00")

    def picture(self, clip=None):
        """A part of the page as numbers: the middle, where the robot stands, if not said."""
        from matplotlib import image

        self.settle()
        clip = clip or {"x": 300, "y": 60, "width": 600, "height": 620}
        shot = self.page.screenshot(clip=clip, timeout=PATIENCE)
        return image.imread(io.BytesIO(shot), format="png")[..., :3]

    def leave(self):
        self.page.close()
        self.viewer.stop()
        self.thread.join(30.0)


def changed(before, after):
    """Part of the pixels that look clearly different."""
    return float((np.abs(after - before).max(axis=2) > 0.25).mean())
