"""The grammar of `--tension` and `--stroke`."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from notchflex.cli.arguments.spec import load_columns, parse_spec, parse_vector
from notchflex.errors import InputError

NUMBERS = st.floats(0.0, 100.0, allow_nan=False)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("2", [2.0]),
        ("0,1,2.5", [0.0, 1.0, 2.5]),
        ("0:3:4", [0.0, 1.0, 2.0, 3.0]),
        ("0:3:4,3:0:4", [0.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 0.0]),
        ("1e-3, 2", [0.001, 2.0]),
        ("2:2:1", [2.0]),
        ("0, 1:2:2 ,5", [0.0, 1.0, 2.0, 5.0]),
    ],
)
def test_values_and_ranges(text, values):
    assert parse_spec(text, "--tension") == values


@given(st.lists(NUMBERS, min_size=1, max_size=8))
def test_any_list_of_numbers_reads_back(values):
    assert parse_spec(",".join(map(repr, values)), "--tension") == values


@given(NUMBERS, NUMBERS, st.integers(2, 50))
def test_ranges_have_their_ends_and_their_number(start, stop, count):
    values = parse_spec(f"{start}:{stop}:{count}", "--tension")
    assert len(values) == count
    assert (values[0], values[-1]) == (start, stop)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a number is missing"),
        ("a", "'a' is no number"),
        ("0:3", "no start:stop:count"),
        ("0:3:0", "a range of 0 steps"),
        ("0:3:-2", "a range of -2 steps"),
        ("0:3:1", "cannot go from 0 to 3"),
        ("0:3:2.5", "whole number"),
        ("1,,2", "a number is missing"),
        ("nan", "finite"),
        ("inf", "finite"),
        ("0:inf:3", "finite"),
        ("-1", "a tendon only pulls"),
        ("0:-1:5", "a tendon only pulls"),
        ("0:3:9999999999", "more than"),
        ("0:3:600000,0:3:600000", "more than"),
    ],
)
def test_bad_specs_are_told(text, words):
    with pytest.raises(InputError, match=words):
        parse_spec(text, "--tension", negative=False)


def test_single_values_hold_for_all_steps():
    tension, stroke = load_columns(["1=0:2:3"], ["2=0.5"], 3)
    np.testing.assert_array_equal(tension[:, 0], [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(stroke[:, 1], [0.5, 0.5, 0.5])
    assert np.isnan(tension[:, 1:]).all()
    assert np.isnan(stroke[:, [0, 2]]).all()


def test_strokes_may_be_negative():
    _, stroke = load_columns([], ["-0.5"], 1)
    assert stroke.item() == -0.5


@pytest.mark.parametrize(
    ("tension", "stroke", "tendons", "words"),
    [
        ([], [], 1, "Give a load"),
        (["2"], [], 2, "say which one"),
        (["3=2"], [], 2, "there is no tendon 3; the robot has 2 tendons"),
        (["2=2"], [], 1, "the robot has 1 tendon"),
        (["0=2"], [], 2, "no tendon 0"),
        (["x=2"], [], 2, "is no tendon"),
        (["1=2", "1=3"], [], 2, "already has --tension 1=2"),
        (["1=2"], ["1=3"], 2, "already has"),
        (["1=0:2:3", "2=0,1"], [], 2, "has 2 steps and --tension 1=0:2:3 has 3"),
    ],
)
def test_loads_that_do_not_fit_are_told(tension, stroke, tendons, words):
    with pytest.raises(InputError, match=words):
        load_columns(tension, stroke, tendons)


def test_vectors():
    assert parse_vector("90, 0,-5", "--base-rotation", "angles").tolist() == [90.0, 0.0, -5.0]
    for bad in ("1,2", "1,2,x", "1,2,inf", ""):
        with pytest.raises(InputError, match="three finite"):
            parse_vector(bad, "--base-rotation", "angles")
