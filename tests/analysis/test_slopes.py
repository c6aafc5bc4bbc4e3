"""Slopes of all arrays of a robot by its numbers, and of its loads, against differences."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import notchflex as nf
from notchflex._jax import jax
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.slopes import changes, differences
from notchflex.loads import LoadPath
from notchflex.robot.value_names import number_at
from refusals import refused

PULL = nf.pull(1.0, 1.0, steps=1)
HEAVY = PULL.loaded(tip_force=(0.01, 0.0, 0.0), gravity=(9.81, 0.0, 0.0))
LONG = pytest.mark.nightly


def within(margin, what: str, computed: np.ndarray, expected: np.ndarray, path):
    """Every array of the chain within 1e-8 of the largest of its slopes.

    Where all slopes are the rounding of a difference, within 1e-8 of the array.
    """
    ready = path.prepared
    for indices in ready.chain_layout.indices:
        own = indices.ravel()
        values = np.abs(ready.vector[own])
        array = np.max(values, where=np.isfinite(values), initial=0.0)
        slope = np.abs(expected[own]).max(initial=0.0)
        size = slope if slope > 1e-9 * array else array
        margin.within(what, (computed[own] - expected[own]) / (size or 1.0), 1e-8)


@pytest.mark.parametrize(
    ("name", "keys", "others", "load"),
    [
        ("pacheco2021-a", ("depth", "height"), ("tube.inner_diameter", "material.density"), PULL),
        ("pacheco2021-a", ("uncut_length",), ("friction.coefficient", "material.density"), HEAVY),
        pytest.param(
            "liu2022", ("strip_thickness",), ("tube.base_length", "material.poisson_ratio"), PULL,
            marks=LONG,
        ),
        pytest.param("gao2017", ("strip_thickness",), ("tendon[1].radius",), PULL, marks=LONG),
    ],
)  # fmt: skip
def test_slopes_are_those_of_differences(name, keys, others, load: LoadPath, margin):
    robot = nf.load_robot(name)
    names = [f"notch[{number}].{key}" for key in keys for number in (1, 2)] + list(others)
    random = np.random.default_rng(0)
    robot = robot.with_values(
        {name: number_at(robot, name) * random.uniform(0.999, 1.001) for name in names}
    )
    path = nf.simulate(robot, load)
    for name, by in zip(names, changes(path, names), strict=True):
        moved, at = partial(robot.with_value, name), number_at(robot, name)
        expected = differences(path, moved, at)
        within(margin, f"by {name}", by.chain, expected.chain, path)
        if by.loads is not None:
            size = np.abs(expected.loads).max() or 1.0
            margin.within(f"loads by {name}", (by.loads - expected.loads) / size, 1e-9)


@LONG
def test_a_direction_is_differentiated_by_differences(margin):
    """It decides which notches share a plane, and is no number of a program."""
    robot = nf.load_robot("two-axis-wrist")
    load = nf.LoadPath([[1.0, 0.0, 0.0, 0.0]]).loaded(tip_force=(0.001, 0.002, 0.0))
    model = ForwardModel(robot, load)
    names = ["notch[1].direction_deg", "notch.depth"]
    path = model.solve(robot, model.load)
    by = path.jacobian(names, "tip_position")["tip_position"][0].T
    for name, slope in zip(names, by, strict=True):
        at, width = number_at(robot, name), 1e-4
        tips = [
            model.solve(robot.with_value(name, at + side * width), model.load).tip_position[0]
            for side in (1.0, -1.0)
        ]
        expected = (tips[0] - tips[1]) / (2.0 * width)
        margin.within(name, (slope - expected) / np.abs(expected).max(), 1e-5)


def test_a_number_of_all_notches_and_that_of_one(margin):
    """The notch with a name of its own does not move with the others."""
    robot, load = nf.load_robot("pacheco2021-a"), PULL
    names = ["notch.depth", "notch[2].depth"]
    path = nf.simulate(robot, load)
    by = path.jacobian(names)["tip_position"][0].T
    at, width = number_at(robot, "notch.depth"), 1e-4
    for number, slope in enumerate(by):
        ends = []
        for side in (1.0, -1.0):
            values = dict.fromkeys(names, at)
            values[names[number]] += side * width
            ends.append(nf.simulate(robot.with_values(values), load).tip_position[0])
        expected = (ends[0] - ends[1]) / (2.0 * width)
        margin.within(names[number], (slope - expected) / np.abs(expected).max(), 1e-4)


def test_a_number_at_the_end_of_its_range():
    """Without friction the slope by its coefficient is that of more of it."""
    robot = nf.load_robot("pacheco2021-a").with_value("friction.coefficient", 0.0)
    bend = nf.differentiable(robot, PULL, ["friction.coefficient"])
    by = jax.grad(lambda at: bend(at)["total_angle"][0])(bend.start)["friction.coefficient"]
    path = nf.simulate(robot, PULL)
    weights = {"total_angle": 1.0, "tip_position": 0.0}
    own = path.gradient(weights)["friction.coefficient"]
    assert by == pytest.approx(own, rel=1e-13)
    width = 1e-5
    more = nf.simulate(robot.with_value("friction.coefficient", width), PULL).total_angle[0]
    assert by == pytest.approx((more - path.total_angle[0]) / width, rel=1e-3)


def test_a_number_that_cannot_be_varied_is_refused():
    """Two links share a slot, so that its radius cannot be that of one."""
    robot, load = nf.load_robot("gao2017"), nf.pull(6.0, 6.0, steps=1)
    with refused("OUT_OF_RANGE") as caught:
        nf.simulate(robot, load).jacobian(["notch[1].strip_length", "notch[2].slot_radius"])
    assert "0.275" in str(caught.value)
