"""The forward model: its derivatives, natively, and the arrays of a varied robot."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.forward_model import ForwardModel
from notchflex.analysis.slopes import changes, derivatives
from notchflex.analysis.tangent import Change, PathTangents, path_gradient


def shaken(path: nf.EquilibriumPath) -> Change:
    """A change of all loads and of the whole chain."""
    random = np.random.default_rng(0)
    packed, vector = path.commands.packed(), path.prepared.vector
    chain = np.where(np.isfinite(vector), vector, 0.0)
    move = 1e-3 * random.standard_normal(len(chain)) * chain
    return Change(1e-3 * random.standard_normal(packed.shape), move)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "load", "outputs"),
    [
        ("pacheco2021-a", nf.stroke_path(0.1, 0.5, steps=3), ("tip_position", "span_tension")),
        ("gao2017", nf.pull(2.0, 5.0, steps=2), ("total_angle", "body_rotation")),
    ],
)
def test_adjoint_is_the_transpose_of_the_tangents(name, load, outputs, margin):
    path = nf.simulate(nf.load_robot(name), load)
    random = np.random.default_rng(1)
    weights = {one: random.standard_normal(np.shape(getattr(path, one))) for one in outputs}
    change = shaken(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # that XLA had to compile it
        found = path_gradient(path, weights).along(change)
        moved = PathTangents(path, outputs).along([change])
    expected = sum(float(np.nansum(moved[one][0] * weights[one])) for one in outputs)
    margin.within("adjoint", found / expected - 1.0, 1e-11)


@pytest.mark.nightly
def test_many_numbers_take_the_adjoint_and_few_the_tangents(margin):
    robot = nf.load_robot("gao2017")
    names = [f"notch[{number}].strip_thickness" for number in range(1, 28)]
    robot = robot.with_values({name: 0.7 + 1e-3 * row for row, name in enumerate(names)})
    model = ForwardModel(robot, nf.pull(4.0, 4.0, steps=1))
    path = model.solve(robot, model.load)
    every = changes(path, names[:4])
    reverse = derivatives(path, every, ("total_angle",))["total_angle"][:, 0]
    forward = derivatives(path, every[:2], ("total_angle",))["total_angle"][:, 0]
    margin.within("by two numbers", reverse[:2] / forward - 1.0, 1e-11)
    width = 1e-4

    def at(value: float) -> float:
        return float(nf.simulate(robot.with_value(names[3], value), model.load).total_angle[0])

    here = 0.7 + 3e-3
    expected = (at(here + width) - at(here - width)) / (2.0 * width)
    margin.within("against differences", float(reverse[3]) / expected - 1.0, 1e-5)


def test_rows_from_rest_do_not_know_of_each_other(margin):
    robot, load = nf.load_robot("pacheco2021-a"), nf.pull(0.4, 1.2, steps=3).release()
    from_rest = np.array([True, False, False, True, False, False])
    model = ForwardModel(robot, load, from_rest=from_rest)
    path = model.solve(robot, load)
    change = changes(path, ["friction.coefficient"])
    found = derivatives(path, change, ("total_angle",))["total_angle"][0]
    for start in (0, 3):
        part = load[start : start + 3]
        alone = ForwardModel(robot, part)
        own = alone.solve(robot, part)
        np.testing.assert_array_equal(path.total_angle[start : start + 3], own.total_angle)
        expected = derivatives(own, change, ("total_angle",))["total_angle"][0]
        margin.within(f"from row {start}", found[start : start + 3] - expected, 1e-12)
