"""The thread that solves: it does or says what it is asked for; refused robots change nothing."""

import threading
import time

import pytest

import notchflex as nf
from notchflex.robot import robot_from_text

pytest.importorskip("viser", reason="the extra `viewer` is not installed")

TWO_ARCS = """
name = "two arcs"
[tube]
outer_diameter = 1.62
inner_diameter = 1.40
[[notch]]
kind = "arc"
repeat = 2
cut = "on-axis"
depth = 1.40
height = 0.8
uncut_length = 1.0
[[tendon]]
radius = 0.70
path = "straight"
[material]
kind = "linear"
elastic_modulus = 10000.0
[friction]
kind = "corner"
coefficient = 0.1
"""


@pytest.fixture
def start():
    """Start viewers that run until the test ends."""
    from notchflex.viewer import Viewer

    started = []

    def begin(robot, **options):
        viewer = Viewer(robot, port=18500, **options)
        thread = threading.Thread(target=viewer.run)
        thread.start()
        started.append((viewer, thread))
        return viewer

    yield begin
    for viewer, thread in started:
        viewer.stop()
        thread.join(30.0)


def wait(condition):
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def reached(viewer, value):
    return not len(viewer.targets) and viewer.session.controls.value[0] == pytest.approx(value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        # Closed when nothing pulls: refused when it is solved, if not before.
        (lambda robot: robot.with_value("notch.precurvature_deg", 45.0), "precurv"),
        (lambda robot: robot.with_value("friction.coefficient", -1.0), "coefficient"),
    ],
)
def test_a_robot_that_is_refused_is_told_and_leaves_the_one_before(start, change, words):
    viewer = start(nf.load_robot("pacheco2021-a"))
    viewer.ask(lambda: viewer.set(0, 0.5, "tension"))
    wait(lambda: reached(viewer, 0.5))
    robot, angle = viewer.session.robot, float(viewer.session.state.total_angle)
    viewer.ask(lambda: viewer.change(change(viewer.session.robot)))
    wait(lambda: viewer.message)
    assert words in viewer.message
    assert "bug" not in viewer.message
    assert viewer.session.robot is viewer.scene.robot is robot
    assert float(viewer.session.state.total_angle) == angle
    viewer.ask(lambda: viewer.set(0, 0.6, "tension"))
    wait(lambda: reached(viewer, 0.6))
    assert viewer.message == ""


def test_a_law_that_is_refused_leaves_the_law_before_on_the_page_too(start, monkeypatch):
    viewer = start(nf.load_robot("pacheco2021-a"))
    viewer.ask(lambda: viewer.set(0, 0.5, "tension"))
    wait(lambda: reached(viewer, 0.5))
    robot, angle = viewer.session.robot, float(viewer.session.state.total_angle)
    kind = viewer.page.laws[0]
    law = kind.handle

    def refuse(*_, **__):
        raise nf.InputError("this law does not fit these notches")

    monkeypatch.setattr(type(viewer.session), "change", refuse)
    law.value = kind.shown = "frictionless"  # as the page has it when somebody chose it
    viewer.ask(lambda: viewer.change_part("friction", "frictionless"))
    wait(lambda: viewer.message)
    wait(lambda: law.value == "capstan")
    assert viewer.message == "this law does not fit these notches"
    assert viewer.session.robot is viewer.scene.robot is robot
    assert float(viewer.session.state.total_angle) == angle
    monkeypatch.undo()
    viewer.ask(lambda: viewer.change_part("friction", "frictionless"))
    wait(lambda: viewer.session.robot.friction.kind == "frictionless" and not viewer.message)


@pytest.mark.nightly
def test_corner_friction_by_the_chord_on_arc_notches_never_spoils_the_viewer(start):
    """An arc notch has no strip, whose chord counts: the robot is refused or is solved."""
    robot = robot_from_text(TWO_ARCS)
    viewer = start(robot, read=lambda: robot_from_text(TWO_ARCS + 'turning = "chord"\n'))
    viewer.ask(lambda: viewer.set(0, 0.1, "tension"))
    wait(lambda: reached(viewer, 0.1))
    viewer.ask(viewer.reload)
    wait(lambda: viewer.message or viewer.original is not robot)
    if viewer.message:
        assert viewer.session.robot is viewer.original is robot
    for law in ("frictionless", "corner"):
        viewer.ask(lambda law=law: viewer.change_part("friction", law))
        wait(lambda law=law: viewer.session.robot.friction.kind == law)
    wait(lambda: viewer.message == "")
    assert viewer.session.robot == viewer.original


def test_a_number_beyond_its_slider_is_set_to_the_end_and_told(start):
    viewer = start(nf.load_robot("pacheco2021-a"))
    viewer.ask(lambda: viewer.set(0, 1e9, "tension"))
    wait(lambda: viewer.message)
    assert "1e+09 N is outside" in viewer.message
    assert viewer.targets.end.value == (3.0,)
    viewer.ask(lambda: viewer.set(0, -1.0, "tension"))
    wait(lambda: "-1 N" in viewer.message)
    assert viewer.targets.end.value == (0.0,)
    viewer.ask(lambda: viewer.set(4, 1e6))
    wait(lambda: "hung weight" in viewer.message)
    assert viewer.targets.end.tip_mass == viewer.reach.mass
    viewer.ask(lambda: viewer.stretch(0, "tension", 1e9))
    wait(lambda: "The end of the slider" in viewer.message)
    assert viewer.reach.tension == (30.0,)
    viewer.ask(viewer.reset)
    wait(lambda: viewer.message == "")


def test_friction_that_is_changed_on_the_way_does_not_end_the_way(start):
    viewer = start(nf.load_robot("pacheco2021-a"))
    viewer.ask(lambda: viewer.set(0, 1.5, "tension"))
    viewer.ask(lambda: viewer.change_number("friction.coefficient", 0.1))
    wait(lambda: reached(viewer, 1.5))
    assert viewer.session.robot.friction.coefficient == 0.1


def test_what_is_done_again_can_be_stopped(start):
    viewer = start(nf.load_robot("pacheco2021-a"))
    viewer.ask(lambda: viewer.set(0, 1.0, "tension"))
    wait(lambda: reached(viewer, 1.0))
    count = len(viewer.session.history)
    viewer.interrupted.set()
    viewer.ask(lambda: viewer.change_number("friction.coefficient", 0.1))
    wait(lambda: viewer.message)
    assert "stopped after step 2" in viewer.message
    assert len(viewer.session.history) == 2 < count
    assert not viewer.interrupted.is_set()


def test_fields_take_decimals_whatever_their_first_value(start):
    """A field that began at 3 N made 37 of 3.7 mm."""
    viewer = start(nf.load_robot("pacheco2021-a"))
    handles = viewer.server.gui._gui_input_handle_from_uuid.values()
    fields = {handle.label: handle for handle in handles if hasattr(handle, "precision")}
    assert fields["slider to"].value == 3.0
    assert all(fields[label].precision > 5 for label in ("slider to", "μ"))
