"""The page of the viewer in a real browser."""

import csv
import io
import re
import threading
from pathlib import Path

import numpy as np
import pytest

import notchflex as nf
from chromium import PATIENCE
from notchflex.robot import robot_from_text

image = pytest.importorskip("matplotlib.image")
pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytestmark = [pytest.mark.browser, pytest.mark.slow]


class Visit:
    """A viewer and a page that looks at it, with all that the page asked for and complained of."""

    def __init__(self, browser, robot, **options):
        from notchflex.viewer import Viewer

        self.viewer = Viewer(robot, **options)
        self.thread = threading.Thread(target=self.viewer.run)
        self.thread.start()
        self.page = browser.new_page(viewport={"width": 1200, "height": 800})
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

    def set_tension(self, value):
        """Move the slider of the tendon by the field beside it, and wait for the robot."""
        field = self.slider().locator(
            "xpath=ancestor::div[contains(@class, 'Slider-root')]/following-sibling::div//input"
        )
        self.settle()  # what is on its way to the page may still set the field
        field.click()
        self.page.keyboard.press("Control+A")
        self.page.keyboard.type(str(value), delay=30)
        self.page.keyboard.press("Enter")
        self.wait_for("tension_1", f"{value:.3f}")

    def slider(self):
        """What a mouse takes of the slider of the tendon's tension."""
        return self.page.get_by_role("slider").first

    def choose(self, before, after):
        """Choose another entry of the list that shows `before`."""
        self.page.locator(f"input[role=combobox][value='{before}']").click()
        self.page.get_by_role("option", name=after, exact=True).click()

    def saved(self, button):
        """What a button sends to be saved: its name and its bytes."""
        if not self.page.get_by_role("button", name=button).is_visible():
            self.page.get_by_text("Save", exact=True).click()
        with self.page.expect_download(timeout=PATIENCE) as waiting:
            self.page.get_by_role("button", name=button).click()
        return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()

    def reset(self):
        self.page.get_by_role("button", name="Reset", exact=True).click()
        self.wait_for("tension_1", "0.000")
        # After a test by stroke the slider of the tension comes back a little later.
        self.page.wait_for_selector("[role=slider][aria-valuemax='3'][aria-valuenow='0']")

    def picture(self):
        """The middle of the page, where the robot stands, as numbers."""
        self.settle()
        clip = {"x": 410, "y": 160, "width": 430, "height": 620}
        shot = self.page.screenshot(clip=clip, timeout=PATIENCE)
        return image.imread(io.BytesIO(shot), format="png")[..., :3]

    def leave(self):
        self.page.close()
        self.viewer.stop()
        self.thread.join(30.0)


def changed(before, after):
    """Part of the pixels that look clearly different."""
    return float((np.abs(after - before).max(axis=2) > 0.25).mean())


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "wrist.toml"
    nf.save_robot(nf.load_robot("pacheco2021-a"), path)
    return path


@pytest.fixture(scope="module")
def visit(browser, file):
    opened = Visit(
        browser,
        nf.load_robot(file),
        read=lambda: nf.load_robot(file),
        file=file,
        port=18080,
    )
    yield opened
    opened.leave()


@pytest.fixture(autouse=True)
def nothing_goes_wrong(visit):
    """After every test: no error in the console, and no other host was asked for anything."""
    yield
    assert visit.errors == []
    assert visit.hosts == {visit.viewer.address.removeprefix("http://")}
    assert visit.viewer.address.startswith("http://127.0.0.1:")


def test_a_slider_moved_is_a_wrist_bent_and_back_again_leaves_hysteresis(visit):
    straight = visit.picture()
    assert visit.angle() == 0.0
    visit.set_tension(1.0)
    first, bent = visit.angle(), visit.picture()
    assert first == pytest.approx(51.5, abs=0.05)  # as the README says
    visit.set_tension(2.0)
    visit.set_tension(1.0)
    back, held = visit.angle(), visit.picture()
    assert back > first + 10.0
    # the wrist is about a twentieth of the picture, and leaves its place
    assert changed(straight, bent) > 0.01
    assert changed(bent, held) > 0.01
    loop = visit.page.locator("svg[aria-label='total angle against tension'] path title")
    assert loop.all_text_contents() == ["pulling", "letting go"]
    visit.reset()
    assert visit.angle() == 0.0
    assert changed(straight, visit.picture()) < 0.004
    assert loop.count() == 0


def test_dragging_the_slider_with_the_mouse(visit):
    visit.reset()
    at = visit.slider().bounding_box()
    x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
    visit.page.mouse.move(x, y)
    visit.page.mouse.down()
    visit.page.mouse.move(x + 60.0, y, steps=6)
    visit.page.mouse.move(x + 20.0, y, steps=6)
    visit.page.mouse.up()
    value = float(visit.slider().get_attribute("aria-valuenow"))
    assert value > 0.0
    visit.wait_for("tension_1", f"{value:.3f}")
    loop = visit.page.locator("svg[aria-label='total angle against tension'] path title")
    assert loop.all_text_contents() == ["pulling", "letting go"]  # it has been up
    visit.reset()


def test_a_cycle_is_played(visit):
    visit.page.get_by_role("button", name="Play a cycle").click()
    visit.page.wait_for_function(
        "() => parseFloat(document.querySelector('[data-name=total_angle]').innerText) > 100"
    )
    visit.wait_for("tension_1", "0.000")
    assert len(visit.viewer.session.history) > 100
    visit.reset()


def test_another_friction_law_does_the_same_again(visit):
    visit.set_tension(1.0)
    rubbed = visit.angle()
    visit.choose("capstan", "frictionless")
    visit.page.wait_for_function(
        "angle => document.querySelector('[data-name=total_angle]').innerText !== angle",
        arg=f"{rubbed:.2f}",
    )
    assert visit.angle() > rubbed + 1.0
    assert visit.page.get_by_text("μ", exact=True).count() == 0
    visit.choose("frictionless", "capstan")
    visit.wait_for("total_angle", f"{rubbed:.2f}")
    visit.reset()


def test_a_load_that_has_no_answer_is_told_and_leaves_the_shape(visit):
    visit.set_tension(0.5)
    good = visit.read("tip_position")
    visit.choose("tension [N]", "stroke [mm]")
    visit.page.wait_for_selector("input[role=combobox][value='stroke [mm]']")
    visit.viewer.ask(lambda: visit.viewer.drive(0, "stroke", 6.0))
    alert = visit.page.get_by_role("alert").filter(has_text="Not reached")
    alert.wait_for()
    assert "every notch closed" in alert.inner_text()
    assert float(visit.read("stroke_1")) < 3.75  # where all notches are closed
    assert visit.read("tip_position") != good
    visit.reset()
    assert alert.count() == 0


def test_what_is_saved_is_what_is_seen(visit):
    visit.set_tension(1.0)
    angle = visit.read("total_angle")
    name, content = visit.saved("Table (CSV)")
    assert name == "pacheco-2021-wrist-a.csv"
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert f"{float(rows[-1]['total_deg']):.2f}" == angle
    name, content = visit.saved("Robot file (TOML)")
    assert robot_from_text(content.decode()) == visit.viewer.session.robot
    name, content = visit.saved("Picture (PNG)")
    picture = image.imread(io.BytesIO(content), format="png")
    assert picture.shape[:2] == (1080, 1440)
    assert (picture[..., 3] > 0.5).mean() > 0.005  # something is on its clear ground
    visit.reset()


def test_a_saved_robot_file_is_read_again_and_a_bad_one_is_told(visit, file):
    visit.set_tension(1.0)
    angle = visit.read("total_angle")
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("[tube]", "[tub"), encoding="utf-8")
    alert = visit.page.get_by_role("alert").filter(has_text="cannot be used")
    alert.wait_for()
    assert "wrist.toml" in alert.inner_text()
    assert visit.read("total_angle") == angle
    visit.set_tension(1.1)  # it goes on
    visit.set_tension(1.0)
    file.write_text(re.sub(r"depth = 1\.4\d*", "depth = 1.3", text), encoding="utf-8")
    visit.page.wait_for_function(
        "angle => parseFloat(document.querySelector('[data-name=total_angle]').innerText) < angle",
        arg=0.8 * float(angle),
    )
    assert visit.viewer.session.robot.notches[0].depth == 1.3
    assert alert.count() == 0
    file.write_text(text, encoding="utf-8")
    visit.page.wait_for_function(
        "angle => parseFloat(document.querySelector('[data-name=total_angle]').innerText) > angle",
        arg=0.9 * float(angle),
    )
    visit.reset()


def test_another_robot_file_is_loaded_from_the_page(visit, tmp_path):
    assert visit.page.locator("[data-name=tension_2]").count() == 0
    other = tmp_path / "other.toml"
    robot = nf.load_robot("pacheco2021-a")
    nf.save_robot(
        robot.replace(name="of two", tendon=(*robot.tendon, nf.Tendon(0.7, 180.0))), other
    )
    visit.page.locator("input[type=file]").set_input_files(other)
    visit.page.wait_for_selector("[data-name=tension_2]")
    assert visit.page.get_by_text("of two").count() > 0
    other.write_text("nonsense = 1\n", encoding="utf-8")
    visit.page.locator("input[type=file]").set_input_files(other)
    visit.page.get_by_role("alert").filter(has_text="nonsense").wait_for()
    assert visit.viewer.session.robot.name == "of two"
