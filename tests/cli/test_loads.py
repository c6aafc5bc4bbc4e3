"""The grammar of `--tip-force` and the other external loads."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.cli.arguments.loads import parse_body_force, parse_loads, put_on
from notchflex.errors import InputError


def test_nothing_given_is_nothing():
    assert parse_loads() == {}
    path = nf.pull(0.0, 1.0, 3)
    assert put_on(path, {}).external == path.external


def test_all_options_reach_every_step():
    loads = parse_loads(
        tip_force="0,-0.1,0",
        tip_moment="1,2,3",
        tip_point="0, 0, 1.5",
        body_force=["1:0,0,1", "2:-1e-2,0,0@0.8,0,0.5"],
        tip_mass="20",
        gravity="0,0,9.81",
        following=True,
    )
    path = put_on(nf.pull(0.0, 1.0, 3), loads)
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


def test_following_alone_with_body_forces_leaves_the_tip_as_it_is():
    loads = parse_loads(body_force=["1:0,0,1"], following=True)
    assert loads == {"body_forces": [{"body": 1, "force": [0.0, 0.0, 1.0], "following": True}]}


@pytest.mark.parametrize(
    "text",
    ["", "0,1,0", "1:", "1:0,1", "-1:0,0,1", "a:0,0,1", "1.5:0,0,1", "1:0,0,1@", "1:0,0,1@0,0",
     "1:0,0,inf", "1:0,0,1@0,0,nan", "1:0,0,1@0,0,0@0,0,0", "1:2:0,0,1"],
)  # fmt: skip
def test_bad_body_forces_are_told(text):
    with pytest.raises(InputError, match="give BODY:X,Y,Z or BODY:X,Y,Z@X,Y,Z") as told:
        parse_body_force(text)
    assert str(told.value).startswith(f"--body-force {text}: ")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tip_force": "0,1"}, "--tip-force 0,1: give three finite forces in N"),
        ({"tip_force": ""}, "three finite forces in N"),
        ({"tip_moment": "0,1,x"}, "three finite moments in N mm"),
        ({"tip_force": "0,1,0", "tip_point": "1"}, "three finite coordinates in mm"),
        ({"gravity": "9.81"}, "three finite accelerations in m/s2"),
        ({"tip_mass": "-1"}, "--tip-mass -1: give a finite number of grams, 0 or more"),
        ({"tip_mass": "heavy"}, "grams"),
        ({"tip_mass": "nan"}, "grams"),
        ({"tip_mass": "inf"}, "grams"),
        ({"tip_mass": ""}, "grams"),
        ({"following": True}, "nothing turns"),
        ({"following": True, "tip_mass": "3"}, "nothing turns"),
        ({"tip_point": "0,0,1"}, "nothing acts there"),
        ({"tip_point": "0,0,1", "tip_moment": "0,0,1"}, "nothing acts there"),
    ],
)
def test_bad_loads_are_told(options, words):
    with pytest.raises(InputError, match=words):
        parse_loads(**options)


def test_a_body_of_thousands_of_digits_is_told():
    with pytest.raises(InputError, match="--body-force"):
        parse_body_force(f"{'9' * 5000}:0,1,0")
