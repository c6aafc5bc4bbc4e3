"""Measurements as a type: what fits together, what is refused, parts of them."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.fit import Measurements

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
    ("other", "words"),
    [
        ({"pull": ("a",)}, "3 rows need a label"),
        ({"observed": {}}, "nothing is measured"),
        ({"observed": {"notch_angle": np.full((3, 2), np.nan)}}, "nothing is measured"),
        ({"observed": {"angle": ANGLES}}, "`angle` is nothing that is measured"),
        ({"observed": {"notch_angle": ANGLES[:2]}}, r"shape \(2, 2\)"),
        ({"observed": {"tip_position": ANGLES}}, r"tip_position of 3 rows .* \(3, 2\)"),
        ({"observed": {"notch_angle": np.full((3, 2), np.inf)}}, "infinite"),
        ({"observed": {"axis_points": np.zeros((3, 2, 3))}}, "axis_points need axis_at"),
        ({"axis_at": [1.0]}, "axis_points need axis_at"),
        ({"deviation": {"notch_angle": np.zeros((3, 2))}}, "notch_angle is 0; give it above 0"),
        ({"deviation": {"notch_angle": np.ones(3)}}, "cannot have the shape"),
        (
            {"deviation": {"total_angle": np.ones(3)}},
            "deviation of total_angle must have the shape",
        ),
        ({"measured_tension": FORCE + 0.1}, "not those of the load"),
    ],
)
def test_what_does_not_fit_is_refused(other, words):
    with pytest.raises(nf.InputError, match=words):
        made(**other)


def test_parts_that_are_none_are_refused():
    with pytest.raises(nf.InputError, match="no row of by hand is left"):
        made().taken([])
    with pytest.raises(nf.InputError, match="no pull 'c'; it has a, b"):
        made().of_pulls(["c"])
