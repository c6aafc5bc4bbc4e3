"""The charts and tables of the page as text, read as a browser reads them."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import notchflex as nf
from notchflex.plotting import Curve, Panel
from notchflex.viewer import Session
from notchflex.viewer.page.chart import chart, ticks
from robots import ready

pytest.importorskip("matplotlib")


def elements(text, name):
    return [one for one in ElementTree.fromstring(text).iter() if one.tag == name]


@pytest.mark.parametrize("values", [[0.0], [0.3, 2.7], [-1.2, 0.4], [1e-4], [153.2], [1e4, 2e4]])
def test_ticks_take_in_zero_and_all_values_in_round_steps(values):
    found = ticks(values)
    assert 3 <= len(found) <= 8
    assert found[0] <= min(0.0, *values)
    assert found[-1] >= max(0.0, *values)
    assert 0.0 in found
    assert np.diff(found) == pytest.approx(np.full(len(found) - 1, found[1] - found[0]))


def test_a_chart_puts_points_where_its_ticks_say():
    line = Curve([[0.0, 0.0], [1.0, 50.0], [2.0, 100.0]], "#123456", marker="o")
    text = chart(Panel([line], "T < 3 [N]", "angle [deg]"), "loop")
    labels = {one.text: one.attrib for one in elements(text, "text")}
    assert "T < 3 [N]" in labels
    assert "angle [deg]" in labels
    dots = elements(text, "circle")
    assert float(dots[2].attrib["cx"]) == pytest.approx(float(labels["2"]["x"]), abs=0.2)
    assert float(dots[2].attrib["cy"]) == pytest.approx(float(labels["100"]["y"]) - 4.0, abs=0.2)


def test_many_points_are_thinned_but_not_their_ends():
    x = np.linspace(0.0, 1.0, 20_000)
    text = chart(Panel([Curve(np.stack([x, x], axis=1), "#123456")], "x", "y"), "many")
    way = next(one for one in elements(text, "path") if one.attrib.get("fill") == "none")
    points = way.attrib["d"].lstrip("M").split("L")
    assert len(points) == 1500
    assert points[0] != points[-1]
    assert len(text) < 50_000


def test_the_loop_tells_loading_from_unloading_and_keeps_the_loop_before():
    from notchflex.viewer.page.chart import loop_chart, tendon_chart

    session = Session(ready("A"))
    for tension in (1.0, 2.0, 1.0):
        session.go(session.controls.with_tendon(0, "tension", tension))
    ways = [one.text for one in elements(loop_chart(session, 0), "title")]
    assert ways == ["loading", "unloading"]
    session.change(ready("A").with_value("friction.coefficient", 0.05))
    ways = [one.text for one in elements(loop_chart(session, 0), "title")]
    assert ways == ["before the change", "loading", "unloading"]
    along = tendon_chart(session, 0)
    assert "span tension [N]" in [one.text for one in elements(along, "text")]
    assert len(elements(along, "circle")) == 9  # two edges a notch, but the last one is fixed


def test_colours_of_contacts_and_strains():
    from notchflex.plotting import BLUE, GREEN, GREY, VERMILLION
    from notchflex.viewer.scene.marks import BEYOND, METAL, contact_colours, strain_colour

    robot = ready("A").with_value("friction.wrap", "geometric")
    session = Session(robot)
    assert set(contact_colours(session.state, 0)) == {GREY}  # slack
    seen = []
    for tension in (1.0, 0.99, 0.6):
        session.go(session.controls.with_tendon(0, "tension", tension))
        seen.append(set(contact_colours(session.state, 0)))
    assert seen[0] == {BLUE}
    assert GREEN in seen[1]
    assert seen[2] == {VERMILLION}
    assert strain_colour(None) == METAL
    assert strain_colour(1.0) == strain_colour(-1.0) != strain_colour(0.9)
    assert strain_colour(1.5) == strain_colour(-1.01) == BEYOND != strain_colour(1.0)


def cells(text):
    return {
        one.attrib["data-name"]: one.text
        for one in elements(text, "td")
        if "data-name" in one.attrib
    }


def test_the_table_tells_units_strain_and_closed_notches():
    from notchflex.viewer.page.readout import readout

    session = Session(ready("A"))
    session.go(session.controls.with_tendon(0, "tension", 0.5))
    text = readout(session)
    assert cells(text)["peak_strain"].endswith(" % of 8 % allowed")
    assert "data-warning" not in text
    session.go(session.controls.with_tendon(0, "tension", 1.8))
    text = readout(session)
    found = cells(text)
    assert found["tension_1"] == "1.800"
    assert float(found["total_angle"]) == pytest.approx(np.degrees(session.state.total_angle), 1e-4)
    assert found["peak_strain"] == "11.80 % > 8 % allowed"
    warned = [one for one in elements(text, "tr") if "data-warning" in one.attrib]
    assert [one[0].text for one in warned] == ["largest strain"]
    assert found["closed"] == "1, 2"


def test_a_strain_without_a_limit_says_so():
    from notchflex.viewer.page.readout import legend_html, readout

    robot = ready("A")
    robot = robot.replace(material=replace(robot.material, allowed_strain=None))
    session = Session(robot)
    session.go(session.controls.with_tendon(0, "tension", 1.8))
    assert cells(readout(session))["peak_strain"] == "11.80 %, no limit set"
    assert "sets no allowed strain" in legend_html(robot, 1.0)


@pytest.mark.parametrize("name", ["A", "gao2017"])
def test_no_sign_before_a_zero(name):
    from notchflex.viewer.page.readout import readout

    robot = ready(name) if name == "A" else nf.load_robot(name)
    found = cells(readout(Session(robot)))
    for one in ("tension_1", "stroke_1", "total_angle", "tip_position"):
        assert not re.search(r"-0\.0+(?!\d)", found[one])


def test_every_colour_means_one_thing():
    from notchflex.plotting import COLOUR
    from notchflex.viewer.page.readout import BALL, entries

    told = entries(ready("A"))
    balls = [one.colour for one in told if one.mark == BALL]
    assert len(set(balls)) == len(balls)
    tendon = next(one.colour for one in told if one.text == "tendon")
    assert tendon not in balls
    assert tendon not in COLOUR.values()


def test_by_stroke_the_loop_is_drawn_against_stroke():
    from notchflex.viewer.page.chart import loop, loop_chart

    session = Session(ready("A"))
    for stroke in (0.0, 1.0, 2.0, 1.5):
        session.go(session.controls.with_tendon(0, "stroke", stroke))
    found = loop(session, 0)
    assert found.x_label == "tendon stroke [mm]"
    assert found.items[-1].rows[:, 0].tolist() == pytest.approx([1.5])
    assert max(line.rows[:, 0].max() for line in found.items) == pytest.approx(2.0)
    assert "total angle against stroke" in loop_chart(session, 0)
    session.go(session.controls.with_tendon(0, "tension", float(session.state.tension[0])))
    assert loop(session, 0).x_label == "tendon tension [N]"
