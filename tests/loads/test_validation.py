"""External loads as people give them: what is taken and kept, and what is refused."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.errors import InputError
from notchflex.loads.conversion import load_path
from notchflex.loads.external import ExternalLoad

NAN = np.nan


def test_paths_keep_their_loads():
    path = nf.pull(0.0, 1.0, 2).loaded(tip_force=(0, 0.1, 0)).loaded(tip_mass=2)
    assert path.external == (ExternalLoad(tip_force=(0, 0.1, 0), tip_mass=2),) * 2
    both = path.then(nf.pull(1.0, 0.0, 2, tendon=2)).release()
    assert [one.tip_mass for one in both.external] == [2, 2, 0, 0, 0, 0, 2, 2]
    assert len(both) == len(both.external) == 8
    assert load_path(both, 3).external == both.external
    changing = load_path([nf.Load(tension=1.0, tip_mass=m) for m in (0, 1)], 1)
    assert [one.tip_mass for one in changing.external] == [0, 1]
    assert nf.LoadPath([[1.0]], [[NAN]], external=[nf.Load(tip_mass=1)]).external == (
        ExternalLoad(tip_mass=1),
    )


@pytest.mark.parametrize("value", [None, 1.0, "0,0,1", [0, 0], [0, 0, NAN], [0, 0, True], "abc"])
@pytest.mark.parametrize("what", ["tip_force", "tip_moment", "tip_point", "gravity"])
def test_vectors_are_three_finite_numbers(what, value):
    if what == "gravity" and value is None:
        assert nf.Load(gravity=None).gravity is None
        return
    with pytest.raises(InputError, match=f"{what} needs three finite numbers"):
        nf.Load(**{what: value})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tip_mass": -1}, "tip_mass must be finite and 0 g or more; got -1"),
        ({"tip_mass": NAN}, "tip_mass must be finite"),
        ({"tip_mass": "1"}, "tip_mass must be a number of grams; got '1'"),
        ({"tip_mass": None}, "tip_mass must be a number of grams"),
        ({"following": 1}, "following must be True or False; got 1"),
        ({"body_forces": nf.BodyForce(1, (0, 0, 1))}, "must be a list of notchflex.BodyForce"),
        ({"body_forces": [(0, 0, 1)]}, "must be a list of notchflex.BodyForce"),
        ({"body_forces": "ab"}, "must be a list of notchflex.BodyForce"),
    ],
)
def test_bad_loads_are_told(options, words):
    with pytest.raises(InputError, match=words):
        nf.Load(**options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"body": -1, "force": (0, 0, 1)}, "bodies are counted from 0, the base; got -1"),
        ({"body": 1.5, "force": (0, 0, 1)}, "body of a BodyForce must be a whole number"),
        ({"body": True, "force": (0, 0, 1)}, "body of a BodyForce must be a whole number"),
        ({"body": 1, "force": 1.0}, "force of a BodyForce needs three finite numbers"),
        ({"body": 1, "force": (0, 0, 1), "moment": None}, "moment of a BodyForce needs three"),
        ({"body": 1, "force": (0, 0, 1), "point": (1,)}, "point of a BodyForce needs three"),
        ({"body": 1, "force": (0, 0, 1), "following": "no"}, "following of a BodyForce must be"),
    ],
)
def test_bad_body_forces_are_told(options, words):
    with pytest.raises(InputError, match=words):
        nf.BodyForce(**options)


@pytest.mark.parametrize("external", [None, 1, [1], "ab", ExternalLoad()])
def test_paths_take_one_load_per_step(external):
    with pytest.raises(InputError, match="one ExternalLoad per step"):
        nf.LoadPath([[1.0]], [[NAN]], external=external)


def test_paths_take_as_many_as_steps():
    with pytest.raises(InputError, match="2 entries, but there are 1 steps"):
        nf.LoadPath([[1.0]], [[NAN]], external=[ExternalLoad(), ExternalLoad()])


def test_arrays_are_taken_and_equal_loads_found_equal():
    one = nf.Load(tip_force=np.array([0, 1, 2]), tip_mass=np.float32(2.0))
    other = nf.Load(tip_force=[0.0, 1.0, 2.0], tip_mass=2)
    assert one == other
    assert hash(one.external) == hash(other.external)
    assert repr(one) == "Load(tip_force=(0.0, 1.0, 2.0), tip_mass=2.0)"
