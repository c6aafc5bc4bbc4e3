"""External loads as people give them: what is taken and kept, and what is refused."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.loads.load import ExternalLoad
from notchflex.loads.load_path import load_path
from refusals import refused

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
    with refused("NOT_FINITE", what):
        nf.Load(**{what: value})


@pytest.mark.parametrize(
    ("options", "code", "got"),
    [
        ({"tip_mass": -1}, "NOT_FINITE", "-1"),
        ({"tip_mass": NAN}, "NOT_FINITE", "nan"),
        ({"tip_mass": "1"}, "WRONG_TYPE", "'1'"),
        ({"tip_mass": None}, "WRONG_TYPE", "None"),
        ({"following": 1}, "WRONG_TYPE", "1"),
        ({"body_forces": nf.BodyForce(1, (0, 0, 1))}, "WRONG_TYPE", "BodyForce(body=1"),
        ({"body_forces": [(0, 0, 1)]}, "WRONG_TYPE", "(0, 0, 1)"),
        ({"body_forces": "ab"}, "WRONG_TYPE", "'ab'"),
    ],
)
def test_bad_loads_are_told(options, code, got):
    with refused(code, *options, got):
        nf.Load(**options)


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        ({"body": -1, "force": (0, 0, 1)}, "OUT_OF_RANGE", "got -1"),
        ({"body": 1.5, "force": (0, 0, 1)}, "WRONG_TYPE", "body of a BodyForce"),
        ({"body": True, "force": (0, 0, 1)}, "WRONG_TYPE", "body of a BodyForce"),
        ({"body": 1, "force": 1.0}, "NOT_FINITE", "force of a BodyForce"),
        ({"body": 1, "force": (0, 0, 1), "moment": None}, "NOT_FINITE", "moment of a BodyForce"),
        ({"body": 1, "force": (0, 0, 1), "point": (1,)}, "NOT_FINITE", "point of a BodyForce"),
        (
            {"body": 1, "force": (0, 0, 1), "following": "no"},
            "WRONG_TYPE",
            "following of a BodyForce",
        ),
    ],
)
def test_bad_body_forces_are_told(options, code, said):
    with refused(code, said):
        nf.BodyForce(**options)


@pytest.mark.parametrize("external", [None, 1, [1], "ab", ExternalLoad()])
def test_paths_take_one_load_per_step(external):
    with refused("WRONG_TYPE", "external", "ExternalLoad"):
        nf.LoadPath([[1.0]], [[NAN]], external=external)


def test_paths_take_as_many_as_steps():
    with refused("WRONG_SHAPE", "external", "2 entries", "1 steps"):
        nf.LoadPath([[1.0]], [[NAN]], external=[ExternalLoad(), ExternalLoad()])
