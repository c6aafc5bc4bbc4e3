"""What a person sees: how much room the scene has, what lies over it, and from where it is seen."""

import threading

import numpy as np
import pytest

import notchflex as nf
from visit import Visit

pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytestmark = [pytest.mark.browser, pytest.mark.nightly]

WIDTH, HEIGHT = 1280, 720
CHARTS_WIDTH = 280


@pytest.fixture(scope="module")
def visit(browser):
    opened = Visit(browser, nf.load_robot("pacheco2021-a"), size=(WIDTH, HEIGHT), port=18400)
    yield opened
    assert opened.errors == []
    opened.leave()


def edges(visit):
    """Where the scene begins and ends between the panels, pixels."""
    left = visit.page.locator("[data-name=total_angle]").bounding_box()
    label = visit.page.locator("xpath=//label[normalize-space()='tension [N]']").bounding_box()
    return left["x"] + left["width"], label["x"]


def shot(visit):
    """The scene between the panels, above the notices of viser."""
    left, right = (round(x) for x in edges(visit))
    return visit.picture({"x": left + 20, "y": 0, "width": right - left - 50, "height": 640})


def coloured(picture, colour, near=0.2):
    """Where a picture has a colour, of 0 to 255, in any light: by its hue."""
    wanted = np.array(colour, float) / np.linalg.norm(colour)
    size = np.linalg.norm(picture, axis=2, keepdims=True)
    return (np.abs(picture / np.maximum(size, 1e-9) - wanted).max(axis=2) < near) & (
        size[..., 0] > 0.15
    )


def test_the_scene_has_more_than_half_of_a_small_window(visit):
    left, right = edges(visit)
    assert right - left > 0.52 * WIDTH


def test_numbers_loop_and_legend_are_seen_without_scrolling(visit):
    for name in ("tension_1", "peak_strain", "legend"):
        box = visit.page.locator(f"[data-name={name}]").bounding_box()
        assert box["y"] > 0.0
        assert box["y"] + box["height"] < HEIGHT
    for label in ("tension [N]", "μ"):
        box = visit.box(label).bounding_box()
        assert box["y"] + box["height"] < HEIGHT
        assert box["x"] + box["width"] < WIDTH


def test_numbers_lie_in_the_panel(visit):
    visit.set_tension(1.8)  # the longest text: 11.80 % > 8 % allowed
    for number in visit.page.locator("td[data-name]").all():
        box = number.bounding_box()
        assert box["x"] + box["width"] <= CHARTS_WIDTH + 4  # with its border
    visit.reset()


def test_messages_of_the_browser_do_not_cover_the_scene(visit):
    # Chromium draws without a graphics card here, of which viser warns.
    banner = visit.page.get_by_text("Software WebGL").first
    banner.wait_for()
    box = visit.page.locator(".mantine-Notification-root").first.bounding_box()
    assert box["y"] > 0.9 * HEIGHT
    assert box["width"] * box["height"] < 0.015 * WIDTH * HEIGHT


def test_contacts_and_closed_notches_are_seen_beside_the_tube(visit):
    blue = (0, 114, 178)
    visit.reset()
    before = shot(visit)
    visit.set_tension(1.8)
    after = shot(visit)
    assert coloured(before, blue).sum() < 20
    assert coloured(after, blue).sum() > 60  # the contacts slip toward the base
    dark = after.max(axis=2) < 0.1
    assert visit.read("closed") == "1, 2"
    assert dark.sum() > 100
    assert (before.max(axis=2) < 0.1).sum() < 20
    visit.reset()


def test_a_strain_beyond_the_allowed_one_stands_out(visit):
    visit.reset()
    assert visit.page.locator("[data-warning]").count() == 0
    visit.set_tension(1.8)
    row = visit.page.locator("[data-warning]")
    assert row.inner_text().split() == ["largest", "strain", "11.80", "%", ">", "8", "%", "allowed"]
    assert row.evaluate("row => getComputedStyle(row).backgroundColor") == "rgb(214, 0, 147)"
    assert coloured(shot(visit), (214, 0, 147)).sum() > 500  # and so do the notches
    visit.reset()
    assert visit.page.locator("[data-warning]").count() == 0


def test_what_is_prepared_is_told_in_sight_and_old_numbers_are_grey(visit):
    """Also where the panel is scrolled down to the list of robots."""

    def opacity():
        return visit.page.locator("table").evaluate("table => getComputedStyle(table).opacity")

    visit.reset()
    visit.page.set_viewport_size({"width": WIDTH, "height": 560})
    visit.open("Robot")
    go = threading.Event()
    visit.viewer.ask(lambda: go.wait(60.0))  # the page waits for its turn until it was looked at
    visit.viewer.page.busy("preparing the robot")
    visit.row("ready robot").scroll_into_view_if_needed()
    note = visit.page.locator("[data-waiting]")
    note.wait_for()
    seen = note.bounding_box()
    assert seen["y"] > 0.0
    assert seen["y"] + seen["height"] < 560.0
    assert CHARTS_WIDTH < seen["x"] < WIDTH - 295.0 - seen["width"]
    assert opacity() == "0.3"
    go.set()
    visit.viewer.ask(visit.viewer.page.update)
    note.wait_for(state="detached")
    assert opacity() == "1"
    visit.open("Robot")
    visit.page.set_viewport_size({"width": WIDTH, "height": HEIGHT})


def test_from_the_side_the_tube_stands_upright_and_its_rims_are_level(visit):
    visit.reset()
    client = next(iter(visit.viewer.server.get_clients().values()))
    visit.open("Show")
    visit.press("View from the side")
    visit.settle()
    way = client.camera.position - client.camera.look_at
    assert way / np.linalg.norm(way) == pytest.approx([0.0, -1.0, 0.0], abs=1e-3)
    visit.press("View as at first")
    visit.settle()
    way = client.camera.position - client.camera.look_at
    assert way[2] > 0.1 * np.linalg.norm(way)
    visit.open("Show")
