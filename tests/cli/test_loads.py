"""The grammar of `--tip-force` and the other external loads."""

import numpy as np
import pytest

import notchflex as nf
from notchflex._load_words import BodyForceOption
from notchflex.cli.options import ExternalLoads
from notchflex.cli.verbs import simulate


@pytest.fixture
def given(call, monkeypatch):
    """Return the load path that options of `simulate` stand for."""

    def runner(*options):
        taken = []
        monkeypatch.setattr(simulate, "_solve", lambda robots, load, *_: taken.append(load) or {})
        monkeypatch.setattr(simulate, "_write", lambda *_: None)
        with pytest.raises(ValueError, match="max"):  # there is no path to report on
            call("simulate", "pacheco2021-a", *options, "--quiet")
        return taken[0]

    return runner


def test_no_options_are_no_loads():
    assert not ExternalLoads()
    path = nf.pull(0.0, 1.0, 3)
    assert path.loaded(**ExternalLoads().arguments()).external == path.external


def test_all_options_reach_every_step(given):
    path = given(
        *("--tension", "0:1:3", "--tip-force", "0,-0.1,0", "--tip-moment", "1,2,3"),
        *("--tip-point", "0, 0, 1.5", "--body-force", "1:0,0,1", "--body-force"),
        *("2:-1e-2,0,0@0.8,0,0.5", "--tip-mass", "20", "--gravity", "0,0,9.81", "--following"),
    )
    expected = nf.Load(
        tip_force=(0, -0.1, 0),
        tip_moment=(1, 2, 3),
        tip_point=(0, 0, 1.5),
        body_forces=[
            nf.BodyForce(1, (0, 0, 1), following=True),
            nf.BodyForce(2, (-0.01, 0, 0), point=(0.8, 0, 0.5), following=True),
        ],
        tip_mass=20,
        gravity=(0, 0, 9.81),
        following=True,
    )
    assert path.external == (expected.external,) * 3
    np.testing.assert_array_equal(path.tension, nf.pull(0.0, 1.0, 3).tension)


def test_vectors_may_be_negative_and_turn_the_base(given):
    path = given("--tension", "1", "--base-rotation", "-90,0,45")
    np.testing.assert_allclose(path.base_rotation, np.radians([-90.0, 0.0, 45.0]))


def test_loads_without_tendons_are_one_step_of_slack_tendons(given):
    path = given("--tip-force", "-1,0,0")
    assert np.isnan(path.tension).all()
    assert path.tension.shape == (1, 1)


def test_following_alone_with_body_forces_leaves_the_tip_as_it_is():
    loads = ExternalLoads(body_force=(BodyForceOption(1, (0.0, 0.0, 1.0), None),), following=True)
    external = nf.pull(0.0, 1.0, 2).loaded(**loads.arguments()).external[0]
    assert not external.following
    assert external.body_forces == (nf.BodyForce(1, (0, 0, 1), following=True),)
