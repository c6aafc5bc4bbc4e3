"""Slopes by many numbers that move together, against those of each number alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
import pytest

import notchflex as nf
from notchflex.analysis.derivatives.forward_model import ForwardModel
from notchflex.analysis.derivatives.geometry_slopes import FlexureTable, SparseSlopes
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.mechanics.chain import flexure, sites_of
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.solver.programs.static_structure import PytreeLayout

PULL = nf.pull(1.0, 1.0, steps=1)
HEAVY = PULL.loaded(tip_force=(0.01, 0.0, 0.0), gravity=(9.81, 0.0, 0.0))


def varied(robot: Robot, names: Iterable[str], seed: int) -> Robot:
    """The robot with numbers a part in a thousand apart."""
    random = np.random.default_rng(seed)
    moves = {name: 1.0 + 1e-3 * random.uniform(-1.0, 1.0) for name in names}
    return robot.with_values({name: number_at(robot, name) * by for name, by in moves.items()})


def within(margin, what: str, found: np.ndarray, expected: np.ndarray, model: ForwardModel):
    """Every array of the chain within 1e-9 of the largest of its slopes.

    Where all slopes are the rounding of a difference, within 1e-9 of the array.
    """
    long = model.ready.long
    for indices in long.chain_layout.indices:
        own = indices.ravel()
        values = np.abs(long.vector[own])
        array = np.max(values, where=np.isfinite(values), initial=0.0)
        slope = np.abs(expected[own]).max(initial=0.0)
        size = slope if slope > 1e-9 * array else array
        margin.within(what, (found[own] - expected[own]) / (size or 1.0), 1e-9)


@pytest.mark.parametrize(
    ("name", "keys", "others", "load"),
    [
        ("pacheco2021-a", ("depth", "height"), ("tube.inner_diameter",), PULL),
        ("pacheco2021-a", ("uncut_length",), (), HEAVY),
        ("pacheco2021-a-true", ("height", "uncut_length"), ("material.elastic_modulus",), PULL),
        ("liu2022", ("strip_thickness",), ("tube.base_length",), PULL),
        ("two-axis-wrist", ("depth",), (), PULL),
        ("gao2017", ("strip_thickness",), ("tendon[1].radius",), PULL),
    ],
)
def test_slopes_of_numbers_that_move_together(name, keys, others, load: LoadPath, margin):
    robot = nf.load_robot(name)
    numbers = range(1, robot.number_of_notches + 1)
    names = [f"notch[{number}].{key}" for key in keys for number in numbers] + list(others)
    model = ForwardModel(robot, load)
    for seed in (0, 1):  # what numbers change is observed the first time only
        other = varied(robot, names, seed)
        found = dict(zip(names, model.changes(other, load, names), strict=True))
        for one in (names[seed], names[len(numbers) - 1], names[-1]):
            alone = model.change(other, load, one)
            within(margin, f"by {one}", found[one].chain, alone.chain, model)
            if alone.loads is not None:
                size = np.abs(alone.loads).max() or 1.0
                margin.within(f"loads by {one}", (found[one].loads - alone.loads) / size, 1e-9)


def test_flexures_of_links_are_interpolated_to_rounding(margin):
    robot, table = nf.load_robot("gao2017"), FlexureTable()
    around = (None, robot.tube, "tendons", 0, False)
    values = 0.7 + 1e-3 * np.arange(30)
    notches = [dataclasses.replace(robot.notches[0], strip_thickness=one) for one in values]
    found = [table(notch, *around) for notch in notches]
    assert len(table._polynomials) == 1
    assert found[0] is flexure(notches[0], *around)  # asked for before they were enough
    assert table(notches[-1], *around) is not flexure(notches[-1], *around)
    layout = PytreeLayout.of(found[0])
    rows, expected = (
        np.stack([layout.pack(one) for one in every])
        for every in (found, [flexure(notch, *around) for notch in notches])
    )
    for indices in layout.indices:
        own = indices.ravel()
        error = (rows[:, own] - expected[:, own]) / (np.abs(expected[:, own]).max(initial=0.0) or 1)
        margin.within("flexures", error, 1e-13)


def test_flexures_beside_a_kink_are_made_one_by_one():
    robot, table = nf.load_robot("pacheco2021-a-true"), FlexureTable()
    notch, site = robot.notches[1], sites_of(robot)[1]
    for value in notch.depth + 1e-4 * np.arange(20):
        one = dataclasses.replace(notch, depth=float(value))
        found = table(one, site, robot.tube, "tendons", 0, False)
        assert found is flexure(one, site, robot.tube, "tendons", 0, False)


def test_a_number_that_changes_more_than_before():
    """Entry 2 depends on the second number only where the first is above 1."""

    def vector_of(values: np.ndarray) -> np.ndarray:
        first, second, third = values
        return np.array([first**2, second**3, max(first - 1.0, 0.0) * second, np.inf, third])

    slopes = SparseSlopes(6, [np.arange(5)], np.zeros(0, int))
    for first in (0.5, 2.0):
        found = np.stack(slopes.at(vector_of, np.array([first, 3.0, 0.0])))
        expected = np.zeros((3, 5))
        expected[0, 0], expected[1, 1], expected[2, 4] = 2.0 * first, 27.0, 1.0
        if first > 1.0:
            expected[0, 2], expected[1, 2] = 3.0, 1.0
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_number_that_begins_to_change_an_entry_of_another():
    """Entry 0 depends on the second number only where the first is above 1: both move together."""

    def vector_of(values: np.ndarray) -> np.ndarray:
        first, second = values
        return np.array([first + max(first - 1.0, 0.0) * second, second])

    slopes = SparseSlopes(6, [np.arange(2)], np.zeros(0, int))
    for first in (0.5, 2.0):
        found = slopes.at(vector_of, np.array([first, 3.0]))
        above = first > 1.0
        expected = [[4.0 if above else 1.0, 0.0], [first - 1.0 if above else 0.0, 1.0]]
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_numbers_at_different_ends_of_their_ranges():
    def vector_of(values: np.ndarray) -> np.ndarray:
        if values[0] < 1.0 or values[1] > 2.0:
            raise InputError.OUT_OF_RANGE("beyond")
        return np.array([values[0] ** 2, values[1] ** 2])

    slopes = SparseSlopes(6, [np.arange(2)], np.zeros(0, int))
    found = slopes.at(vector_of, np.array([1.0, 2.0]))
    np.testing.assert_allclose(found, [[2.0, 0.0], [0.0, 4.0]], atol=1e-9)


def test_a_number_that_cannot_be_varied_is_refused():
    """Two links share a slot, so that its radius cannot be that of one."""
    robot, load = nf.load_robot("gao2017"), nf.pull(6.0, 6.0, steps=1)
    model = ForwardModel(robot, load)
    with pytest.raises(InputError) as refused:
        model.changes(robot, load, ["notch[1].strip_length", "notch[2].slot_radius"])
    assert refused.value.code is nf.ErrorCode.OUT_OF_RANGE
    assert "0.275" in str(refused.value)
