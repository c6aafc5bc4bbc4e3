"""The charts and tables of the page, read as a browser reads them."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import notchflex as nf
from robots import ready

pytest.importorskip("matplotlib")
pytest.importorskip("plotly")

from notchflex.plotting import COLOUR, Curve, Panel, chart_of
from notchflex.viewer import Session
from notchflex.viewer.colours import BEYOND, METAL, contact_colours, legend, strain_colour
from notchflex.viewer.readout import along_tendon, legend_html, loop, readout


def elements(text, name):
    return [one for one in ElementTree.fromstring(text).iter() if one.tag == name]


def test_a_chart_has_its_points_and_its_labels_as_they_are():
    line = Curve([[0.0, 0.0], [1.0, 50.0], [2.0, 100.0]], "#123456", marker="o")
    figure = chart_of(Panel([line], "T < 3 [N]", "angle [deg]"))
    (trace,) = figure.data
    assert trace.x.tolist() == [0.0, 1.0, 2.0]
    assert trace.y.tolist() == [0.0, 50.0, 100.0]
    assert figure.layout.xaxis.title.text == "T &lt; 3 [N]"
    assert figure.layout.yaxis.title.text == "angle [deg]"
    assert figure.layout.yaxis.rangemode == "tozero"


def names(panel):
    return [mark.name for mark in panel.items]


def test_the_loop_tells_loading_from_unloading_and_keeps_the_loop_before():
    session = Session(ready("A"))
    assert names(loop(session, 0)) == ["now"]
    for tension in (1.0, 2.0, 1.0):
        session.go(session.controls.with_tendon(0, "tension", tension))
    assert names(loop(session, 0)) == ["loading", "unloading", "now"]
    session.change(ready("A").with_value("friction.coefficient", 0.05))
    assert names(loop(session, 0)) == ["before the change", "loading", "unloading", "now"]
    along = along_tendon(session, 0)
    assert along.y_label == "span tension [N]"
    contacts = [len(mark.rows) for mark in along.items[1:]]
    assert sum(contacts) == 9  # two edges a notch, but the last one is fixed


def test_colours_of_contacts_and_strains():
    from notchflex.plotting import BLUE, GREEN, GREY, VERMILLION

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
    assert strain_colour(0.5, None) == METAL
    assert strain_colour(0.08, 0.08) == strain_colour(-0.08, 0.08) != strain_colour(0.07, 0.08)
    assert strain_colour(0.12, 0.08) == strain_colour(-0.081, 0.08) == BEYOND
    assert strain_colour(0.08, 0.08) != BEYOND


def cells(text):
    return {
        one.attrib["data-name"]: one.text
        for one in elements(text, "td")
        if "data-name" in one.attrib
    }


def test_the_table_tells_units_strain_and_closed_notches():
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
    robot = ready("A")
    robot = robot.replace(material=replace(robot.material, allowed_strain=None))
    session = Session(robot)
    session.go(session.controls.with_tendon(0, "tension", 1.8))
    assert cells(readout(session))["peak_strain"] == "11.80 %, no limit set"
    assert "sets no allowed strain" in legend_html(robot, 1.0)


@pytest.mark.parametrize("name", ["A", "gao2017"])
def test_no_sign_before_a_zero(name):
    robot = ready(name) if name == "A" else nf.load_robot(name)
    found = cells(readout(Session(robot)))
    for one in ("tension_1", "stroke_1", "total_angle", "tip_position"):
        assert not re.search(r"-0\.0+(?!\d)", found[one])


def test_every_colour_means_one_thing():
    told = legend(ready("A"))
    balls = [one.colour for one in told if one.marker]
    assert len(set(balls)) == len(balls)
    tendon = next(one.colour for one in told if one.name == "tendon")
    assert tendon not in balls
    assert tendon not in COLOUR.values()


def test_by_stroke_the_loop_is_drawn_against_stroke():
    session = Session(ready("A"))
    for stroke in (0.0, 1.0, 2.0, 1.5):
        session.go(session.controls.with_tendon(0, "stroke", stroke))
    found = loop(session, 0)
    assert found.x_label == "tendon stroke [mm]"
    assert found.items[-1].rows[:, 0].tolist() == pytest.approx([1.5])
    assert max(line.rows[:, 0].max() for line in found.items) == pytest.approx(2.0)
    session.go(session.controls.with_tendon(0, "tension", float(session.state.tension[0])))
    assert loop(session, 0).x_label == "tendon tension [N]"
