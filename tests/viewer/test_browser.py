"""The page of the viewer in a real browser."""

import csv
import io
import re
import threading

import numpy as np
import pytest

import notchflex as nf
from chromium import PATIENCE
from notchflex.plotting import LOADING, UNLOADING
from notchflex.robot import robot_from_text
from visit import Visit, changed

image = pytest.importorskip("matplotlib.image")
pytest.importorskip("viser", reason="the extra `viewer` is not installed")
expect = pytest.importorskip("playwright.sync_api").expect
pytestmark = [pytest.mark.browser, pytest.mark.nightly]


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
    assert visit.hosts == {visit.viewer.address.split("/")[2]}
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
    visit.loop_is("tension", LOADING, UNLOADING)
    visit.reset()
    assert visit.angle() == 0.0
    assert changed(straight, visit.picture()) < 0.004
    visit.loop_is("tension")


def test_dragging_the_slider_with_the_mouse(visit):
    visit.reset()
    at = visit.slider().bounding_box()
    x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
    visit.page.mouse.move(x, y)
    visit.page.mouse.down()
    for place in (60.0, 20.0):
        visit.page.mouse.move(x + place, y, steps=6)
        # the robot follows a hand, and not one that is gone at once
        visit.wait_for("tension_1", f"{float(visit.slider().get_attribute('aria-valuenow')):.3f}")
    visit.page.mouse.up()
    value = float(visit.slider().get_attribute("aria-valuenow"))
    assert value > 0.0
    assert visit.still()["tension_1"] == pytest.approx(value, abs=1e-3)
    visit.loop_is("tension", LOADING, UNLOADING)  # it has been up
    visit.reset()


def test_the_keyboard_moves_the_slider(visit):
    visit.reset()
    visit.slider().focus()
    for _ in range(5):
        visit.page.keyboard.press("ArrowRight")
    visit.wait_for("tension_1", "0.075")
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
    visit.choose("law", "frictionless")
    visit.page.wait_for_function(
        "angle => document.querySelector('[data-name=total_angle]').innerText !== angle",
        arg=f"{rubbed:.2f}",
    )
    assert visit.angle() > rubbed + 1.0
    assert visit.row("μ").count() == 0
    visit.choose("law", "capstan")
    visit.wait_for("total_angle", f"{rubbed:.2f}")
    assert visit.row("μ").count() == 1
    visit.reset()


def test_a_coefficient_is_typed_in_one_go(visit):
    visit.set_tension(1.0)
    rubbed = visit.read("total_angle")
    visit.type("μ", "0.25", delay=120)
    visit.page.wait_for_function(
        "angle => document.querySelector('[data-name=total_angle]').innerText !== angle",
        arg=rubbed,
    )
    assert visit.box("μ").input_value() == "0.25"
    assert visit.still()["total_angle"] < float(rubbed)
    visit.type("μ", "-1")
    assert "coefficient" in visit.notice("coefficient")
    assert visit.box("μ").input_value() == "0.25"  # what the robot has
    visit.type("μ", "0.13")
    visit.wait_for("total_angle", rubbed)
    visit.no_notice()
    visit.reset()


def test_a_load_that_has_no_answer_is_told_and_leaves_the_shape(visit):
    visit.set_tension(0.5)
    good = visit.read("tip_position")
    solving = threading.Event()
    visit.viewer.ask(lambda: solving.wait(60.0))
    visit.choose("tendon by", "stroke [mm]")
    visit.slider("stroke [mm]").wait_for()
    # The end of the slider is of the new choice before that is solved: it may be typed at once.
    expect(visit.box("slider to")).to_have_value("3.7", timeout=PATIENCE)
    solving.set()
    visit.type("slider to", "6")
    visit.page.wait_for_selector("[role=slider][aria-valuemax='6']")
    visit.type("stroke [mm]", "6")
    assert "every notch closed" in visit.notice("Not reached")
    stands = visit.still()["stroke_1"]
    assert stands < 3.75  # where all notches are closed
    assert float(visit.box("stroke [mm]").input_value()) == pytest.approx(stands, abs=2e-3)
    assert visit.read("tip_position") != good
    visit.set_stroke(1.0)  # and it goes on
    visit.no_notice()
    visit.type("slider to", "3.7")
    visit.page.wait_for_selector("[role=slider][aria-valuemax='3.7']")
    visit.reset()


def test_what_is_saved_is_what_is_seen(visit):
    visit.set_tension(1.0)
    angle = visit.read("total_angle")
    name, content = visit.saved("Table (CSV)")
    assert name == "pacheco-2021-wrist-a.csv"
    rows = list(csv.DictReader(io.StringIO(content.decode())))
    assert f"{float(rows[-1]['total_deg']):.2f}" == angle
    name, content = visit.saved("Robot file (TOML)")
    assert robot_from_text(content.decode()) == visit.viewer.session.robot
    assert "E_lin, Table 3" in content.decode()
    name, content = visit.saved("Picture (PNG)")
    picture = image.imread(io.BytesIO(content), format="png")
    assert picture.shape[:2] == (1200, 1920)
    # the robot is as high as the picture of it: strained notches and metal, but for the ground
    left = picture[100:, :1100, :3]
    coloured = np.ptp(left, axis=2) > 0.25
    rows = np.flatnonzero(coloured.any(axis=1))
    assert rows[-1] - rows[0] > 0.5 * len(left)
    assert (np.ptp(picture[100:, 1200:, :3], axis=2) > 0.3).mean() > 0.002  # loop and legend
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
    visit.no_notice()
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
