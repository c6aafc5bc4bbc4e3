"""A small draw of the fuzz: nothing silent, nothing wrong, reasons for what is not solved."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf

FOLDER = Path(__file__).parents[2] / "benchmarks"
# One form of each kind of notch and friction, with holes, sheaths, spools, own sections and
# temperatures; all of them are drawn by the benchmark.
FORMS = (3, 6, 8, 12, 24, 31, 37, 39)


@pytest.fixture(scope="module")
def robustness():
    if not FOLDER.is_dir():
        pytest.skip("benchmarks are no part of this installation")
    sys.path.insert(0, str(FOLDER))
    yield import_module("robustness")
    sys.path.remove(str(FOLDER))


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::notchflex.errors.InputWarning")  # unusual robots on purpose
@pytest.mark.parametrize("form", FORMS)
def test_a_draw_is_solved_or_says_why(robustness, form):
    """Follow two draws of a form, and solve them in one more way."""
    for number in (robustness.VARIANTS * form, robustness.VARIANTS * form + 1):
        for outcome in robustness.judged(7, number)[1]:
            assert not outcome.silent
            assert not outcome.wrong
            assert outcome.reason == "" or len(outcome.reason) > 20


def test_wires_in_sheaths_are_judged_by_the_figures_of_a_steel_wire(robustness, margin):
    """1 m, 180 degrees, 0.15, 0.3 mm of steel, 5 N: what arrives, where it turns, its stretch."""
    line_of = import_module("random_robots.sheaths").Line
    limit, soft = 0.15 * np.pi, 1000.0 / (200e3 * np.pi / 4.0 * 0.3**2)
    place = np.linspace(0.0, 1.0, 12)
    slack = line_of(place, 0.0 * place - 230.0)

    def led(line, tension):
        level = np.log(tension)
        return line.between((level, level - limit), (level, level + limit))

    pulled = led(slack, 5.0)
    turn = 5.0 * np.exp(-2.0 * limit)
    turned = led(pulled, turn * (1.0 - 1e-12))
    figures = [
        np.exp(pulled.level[-1]) / 5.0,
        turn / 5.0,
        soft * pulled.mean(),
        soft * (pulled.mean() - turned.mean()),
    ]
    assert np.round(figures, 4).tolist() == [0.6242, 0.3897, 0.2820, 0.1060]
    partly = led(pulled, 3.5)  # the front stands where both lines meet
    front = np.log(5.0 / 3.5) / (2.0 * limit)
    margin.within("front", partly.at(front) - np.log(5.0) + limit * front, 1e-14)
    steep = line_of(np.array([0.0, 0.5, 1.0]), np.array([0.0, 1.0, 1.1])).no_steeper(limit)
    margin.within("slides", steep.level - [0.0, 0.5 * limit, limit], 1e-15)
    met = line_of(np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.3, 0.2])).no_steeper(limit)
    front = (0.3 + 0.5 * 0.2) / (limit + 0.2)  # where the slope that holds meets the old line
    margin.within("beyond", met.at([front, 1.0]) - [limit * front, 0.2], 1e-15)


@pytest.mark.nightly
def test_a_robot_of_many_parts_is_judged(robustness):
    """Disks, a table, own sections, a sheath and a temperature: in balance, and no other one."""
    spoiled = import_module("random_robots.spoiled")
    robot, loads = spoiled.MIXED, spoiled.MIXED_LOADS
    paths = spoiled.solved(robot, loads)
    assert spoiled.findings(robot, paths, loads, len(loads)) == []
    for name in ("notch[1].diameter", "notch[3].moment", "tendon[1].sheath_friction"):
        other = robot.with_value(name, spoiled.MIXED_OTHERS[name])
        assert spoiled.findings(other, paths, loads, len(loads)), name


@pytest.mark.nightly
def test_a_result_with_one_wrong_quantity_is_found(robustness):
    assert not robustness.CHECKS["spoiled"](1, 1)


@pytest.mark.nightly
def test_a_slender_strip_pulled_along_is_judged_by_its_own_curve(robustness):
    """Its moment error, and that of its place, are many times those of the strip's own moment."""
    spoiled = import_module("random_robots.spoiled")
    strip = nf.StripNotch(height=2.0, strip_thickness=0.3, depth=5.0, uncut_length=5.0)
    robot = nf.Robot(
        name="a thick strip and a slender one",
        tube=nf.Tube(8.8, 7.4, base_length=10.0),
        notch=(replace(strip, strip_thickness=0.9), strip),
        tendon=(nf.Tendon(3.5, path="straight"),),
        material=nf.Linear(60_000.0),
        friction=nf.Frictionless(),
    )
    loads = [nf.Load(tip_force=(force, 0.0, 0.5 * force)) for force in (10.0, 20.0, 40.0)]
    paths = spoiled.solved(robot, loads)

    def found(paths, robot=robot):
        return {text.partition(": ")[0]: text for text in spoiled.findings(robot, paths, loads, 3)}

    assert found(paths) == {}
    for more in (1.0 - 1e-8, 1.0 + 1e-8):
        other = [spoiled.Spoiled(path, notch_moment=more * path.notch_moment) for path in paths]
        assert set(found(other)) == {"notch 1", "notch 2"}
    for number in (1, 2):
        name = f"notch[{number}].strip_thickness"
        other = robot.with_value(name, 1.001 * robot.notches[number - 1].strip_thickness)
        assert set(found(paths, other)) >= {f"notch {number}"}


@pytest.mark.nightly
def test_edges_of_a_notch_that_also_twists_are_where_they_are_seen(robustness):
    """The edge angle lacks bending of the rings, no part of notch angle less precurvature."""
    wrist = nf.load_robot("pacheco2021-a-true")
    robot = wrist.replace(
        notch=wrist.notches[:1],
        tendon=[nf.Tendon(0.7, path="straight")],
        friction=nf.Frictionless(),
        material=nf.Linear(60_000.0, poisson_ratio=0.33),
    )
    load = nf.Load(tension=1.0, tip_force=(0.0, 1.0, 0.0), tip_moment=(0.0, 0.0, 1.0))
    path = nf.simulate(robot, load).raise_if_failed()
    assert import_module("random_robots.judge").wrong(robot, load, path) == []


def test_faces_turn_less_by_what_bends_beyond_them(robustness, margin):
    """Exactly so, whatever sideways bending and twist there is between the faces."""
    edge_angle = import_module("random_robots.arcs").edge_angle
    beyond = 0.03
    rng = np.random.default_rng(3)
    for faces in Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (8, 3))):
        half = Rotation.from_rotvec([0.0, 0.5 * beyond, 0.0])
        turn = (half * faces * half).as_matrix()
        seen = edge_angle(faces.as_matrix(), 0.0)
        margin.within("turned back", edge_angle(turn, beyond) - seen, 1e-14, "rad")
        margin.within("difference", edge_angle(turn, 0.0) - beyond - seen, 1e-14, "rad")
