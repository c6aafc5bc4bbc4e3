"""Loads from Python: every form that is taken, and what is refused with a sentence."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.loads.load_path import load_path
from refusals import refused

NAN = np.nan


@pytest.mark.parametrize(
    ("tension", "entries"),
    [
        (2, [2.0, NAN]),
        (np.array(1.0), [1.0, NAN]),
        (np.float32(1.5), [1.5, NAN]),
        ([None, 1.0], [NAN, 1.0]),
        (np.array([1.0, 2.0]), [1.0, 2.0]),
        (np.array([None, 2.0]), [NAN, 2.0]),
        ((), [NAN, NAN]),
    ],
)
def test_forms_of_a_tension(tension, entries):
    np.testing.assert_array_equal(load_path(nf.Load(tension=tension), 2).tension, [entries])


HUGE = pytest.param(10**5000, id="huge")  # more digits than Python writes


@pytest.mark.parametrize("value", ["1", b"1", True, np.True_, 10**400, HUGE, 1j, [[1.0]], {}, NAN])
@pytest.mark.parametrize("what", ["tension", "stroke"])
def test_what_is_no_number_is_refused(what, value):
    with refused("NOT_FINITE" if value is NAN else "WRONG_TYPE", what):
        load_path(nf.Load(**{what: value}), 1)


@pytest.mark.parametrize("value", [None, 0, "abc", [0, 0], [0, 0, NAN], [0, 0, 10**400]])
def test_base_rotation_is_three_numbers(value):
    with refused("NOT_FINITE", "base_rotation"):
        load_path(nf.Load(tension=1.0, base_rotation=value), 1)
    with refused("NOT_FINITE", "base_rotation"):
        nf.LoadPath([[1.0]], [[NAN]], value)


@pytest.mark.parametrize("loads", [None, 1.0, "1", [1.0], []])
def test_what_is_no_load_is_refused(loads):
    with refused("NO_DATA" if loads == [] else "WRONG_TYPE", "load"):
        load_path(loads, 1)


@pytest.mark.parametrize("value", ["1", b"1", True, [["a"]], [[1.0], [1.0, 2.0]], 10**400])
def test_load_paths_are_numbers(value):
    with refused("WRONG_TYPE", "tension"):
        nf.LoadPath(value, [[NAN]])


@pytest.mark.parametrize("make", [nf.pull, nf.stroke_path])
@pytest.mark.parametrize("wrong", [2.5, "5", True, None, 0, -1])
def test_steps_and_tendon_are_whole_numbers(make, wrong):
    whole = type(wrong) is int
    with refused("NO_DATA" if whole else "WRONG_TYPE", "step", str(wrong)):
        make(0, 3, wrong)
    with refused("OUT_OF_RANGE" if whole else "WRONG_TYPE", "tendon", str(wrong)):
        make(0, 3, tendon=wrong)
    for huge in ({"steps": 10**9}, {"tendon": 10**9}):  # before any memory is taken
        with refused("OUT_OF_RANGE"):
            make(0, 3, **huge)
    assert len(make(0, 3, np.int64(5))) == 5


@pytest.mark.parametrize("make", [nf.pull, nf.stroke_path])
def test_one_step_goes_nowhere(make):
    # Its value would be the first one, and the last would never be reached.
    with refused("OUT_OF_RANGE", "one step cannot go from 0 to 3"):
        make(0, 3, steps=1)
    assert len(make(3, 3.0, steps=1)) == 1


@pytest.mark.parametrize("end", [None, "3", True, 10**400, NAN, np.inf])
def test_ends_of_a_ramp_are_finite_numbers(end):
    with refused("NOT_FINITE" if isinstance(end, float) else "WRONG_TYPE", "tension"):
        nf.pull(0, end)


def test_paths_of_different_tendons_follow_each_other():
    both = nf.pull(0, 1, 2).then(nf.stroke_path(0, 0.5, 2, tendon=2))
    np.testing.assert_array_equal(both.tension, [[0, NAN], [1, NAN], [NAN, NAN], [NAN, NAN]])
    np.testing.assert_array_equal(both.stroke[2:], [[NAN, 0.0], [NAN, 0.5]])
    back = nf.pull(0, 1, 2, tendon=2).then(nf.pull(0, 1, 2))
    np.testing.assert_array_equal(back.tension[2:], [[0, NAN], [1, NAN]])
    with refused("WRONG_TYPE", "LoadPath"):
        both.then(nf.Load(tension=1.0))


def test_loads_are_copies():
    """A list or array that is changed later changed a load before."""
    tension, turn = [1.0, None], np.array([0.0, 0.0, 0.1])
    load = nf.Load(tension=tension, stroke=np.array([0.5]), base_rotation=turn)
    tension[0], turn[2] = 5.0, 1.0
    assert (load.tension, load.stroke, load.base_rotation) == ((1.0, None), (0.5,), (0.0, 0.0, 0.1))


def test_a_base_turned_so_far_that_its_angle_is_lost_is_refused():
    for wrong in ([2e6, 0.0, 0.0], [1e308, 1e308, 0.0]):
        with refused("OUT_OF_RANGE", "base_rotation", "1e+06 rad"):
            nf.Load(tension=1.0, base_rotation=wrong)
        with refused("OUT_OF_RANGE", "base_rotation", "1e+06 rad"):
            nf.LoadPath([[1.0]], base_rotation=wrong)
