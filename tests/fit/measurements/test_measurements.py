"""Measurements as a type: what fits together, what is refused, parts of them."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import Measurements
from refusals import refused

ANGLES = np.radians([[1.0, 2.0], [3.0, np.nan], [5.0, 6.0]])
FORCE = np.array([[-0.01], [0.5], [1.0]])


def made(**other) -> Measurements:
    given = {
        "source": "by hand",
        "load": nf.LoadPath(np.maximum(FORCE, 0.0), np.full((3, 1), np.nan)),
        "pull": ("a", "a", "b"),
        "from_rest": False,
        "observed": {"notch_angle": ANGLES},
        "measured_tension": FORCE,
    }
    return Measurements(**given | other)


def test_what_it_tells():
    data = made()
    assert len(data) == 3
    assert data.pulls == ("a", "b")
    assert data.negative_forces == 1
    assert data.values == 5
    assert (
        repr(data)
        == "<Measurements of by hand: 3 rows of 2 pulls, each pull one path; notch_angle>"
    )


def test_equal_is_what_was_done_and_measured():
    assert made() == made(source="elsewhere", ignored=("note",))
    assert made() != made(from_rest=True)
    assert made() != made(pull=("a", "b", "b"))
    assert made() != made(observed={"notch_angle": ANGLES + 1e-15})
    assert made() != made(deviation={"notch_angle": np.full((3, 2), 0.1)})
    other = nf.LoadPath(np.maximum(FORCE, 0.0), np.full((3, 1), np.nan)).loaded(tip_mass=1.0)
    assert made() != made(load=other)
    assert made() != "by hand"


def test_tensions_are_those_of_the_load_where_none_were_measured():
    data = made(measured_tension=np.zeros((0, 0)))
    np.testing.assert_array_equal(data.measured_tension, np.maximum(FORCE, 0.0))


def test_parts():
    data = made(deviation={"notch_angle": np.full((3, 2), 0.1)})
    assert data.of_pulls(["a"]).taken([1]) == data.taken([False, True, False])
    part = data.of_pulls(["b"])
    assert len(part) == 1
    assert part.pull == ("b",)
    np.testing.assert_array_equal(part.load.tension, [[1.0]])
    np.testing.assert_array_equal(part.observed["notch_angle"], ANGLES[2:])
    assert part.deviation["notch_angle"].shape == (1, 2)
    assert data.taken(slice(None)) == data


@pytest.mark.parametrize(
    ("other", "code", "name"),
    [
        ({"pull": ("a",)}, "WRONG_SHAPE", "3 rows"),
        ({"observed": {}}, "NO_DATA", "notch_angle"),
        ({"observed": {"notch_angle": np.full((3, 2), np.nan)}}, "NO_DATA", "notch_angle"),
        ({"observed": {"angle": ANGLES}}, "UNKNOWN_NAME", "`angle`"),
        ({"observed": {"notch_angle": ANGLES[:2]}}, "WRONG_SHAPE", "(2, 2)"),
        ({"observed": {"tip_position": ANGLES}}, "WRONG_SHAPE", "tip_position of 3 rows"),
        ({"observed": {"notch_angle": np.full((3, 2), np.inf)}}, "NOT_FINITE", "notch_angle"),
        ({"observed": {"axis_points": np.zeros((3, 2, 3))}}, "MISSING_VALUE", "axis_at"),
        ({"axis_at": [1.0]}, "MISSING_VALUE", "axis_at"),
        ({"deviation": {"notch_angle": np.zeros((3, 2))}}, "OUT_OF_RANGE", "notch_angle is 0"),
        ({"deviation": {"notch_angle": np.ones(3)}}, "WRONG_SHAPE", "(3,)"),
        (
            {"deviation": {"total_angle": np.ones(3)}},
            "WRONG_SHAPE",
            "total_angle",
        ),
        ({"measured_tension": FORCE + 0.1}, "CONFLICT", "tensions"),
    ],
)
def test_what_does_not_fit_is_refused(other, code, name):
    with refused(code, name):
        made(**other)


def test_parts_that_are_none_are_refused():
    with refused("NO_DATA", "by hand"):
        made().taken([])
    with refused("UNKNOWN_NAME", "'c'", "a, b"):
        made().of_pulls(["c"])
