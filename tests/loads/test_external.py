"""External loads: the sums that the solver takes against every force added up by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import notchflex as nf
from notchflex._jax import jax
from notchflex.loads.command import (
    BodyLoads,
    bending_normal,
    body_wrench,
    is_planar,
    make_commands,
)
from notchflex.loads.load_path import load_path
from notchflex.mechanics.chain import assemble
from notchflex.mechanics.masses import body_masses
from refusals import refused
from robots import ready

ROBOT = ready("a")
BODIES = ROBOT.number_of_notches + 1
LENGTH = np.array([ROBOT.tube.base_length, *(notch.uncut_length for notch in ROBOT.notches)])
RNG = np.random.default_rng(4)


def sums(load, *, robot=ROBOT, mass=None, centre=None) -> BodyLoads:
    mass = np.zeros(BODIES) if mass is None else mass
    centre = np.zeros((BODIES, 3)) if centre is None else centre
    chain: Any = SimpleNamespace(
        body_mass=mass,
        body_centre=centre,
        body_length=LENGTH,
        frame=None,
        loaded=True,
        temperature=None,
        sheath=None,
    )
    command = make_commands(load_path(load, robot.number_of_tendons), robot, chain)
    assert command.applied is not None
    return command.applied


def of_body(every: BodyLoads, body: int, step: int = 0) -> BodyLoads:
    return BodyLoads(*(np.asarray(field)[step, body] for field in every if field is not None))


def by_hand(force, moment, point, *, body_in_world):
    """A force and a moment of the world at a point of a body, about its origin in its frame."""
    inside = body_in_world.T
    return np.concatenate([inside @ moment + np.cross(point, inside @ force), inside @ force])


def test_dead_loads_turn_against_the_body(margin):
    base, body = (Rotation.random(random_state=RNG).as_matrix() for _ in range(2))
    given = [RNG.normal(size=(3, 3)) for _ in range(4)]
    tip = RNG.normal(size=(3, 3))
    load = nf.Load(
        base_rotation=Rotation.from_matrix(base).as_rotvec(),
        body_forces=[nf.BodyForce(5, *parts) for parts in given],
        tip_force=tip[0],
        tip_moment=tip[1],
        tip_point=tip[2],
    )
    at_tip = (tip[0], tip[1], tip[2] + [0.0, 0.0, LENGTH[-1]])
    expected = sum(by_hand(*parts, body_in_world=base @ body) for parts in (*given, at_tip))
    found = body_wrench(body, of_body(sums(load), 5))
    margin.within("wrench", found - expected, 1e-13)
    traced = jax.jit(body_wrench)(body, of_body(sums(load), 5))
    margin.within("wrench, compiled", traced - found, 1e-14)
    assert not any(np.any(field) for field in of_body(sums(load), 4))


def test_following_loads_do_not(margin):
    force, moment, point, tip_force, tip_moment = RNG.normal(size=(5, 3))
    load = nf.Load(
        base_rotation=(0.3, -1.0, 2.0),
        body_forces=[nf.BodyForce(5, force, moment, point, following=True)],
        tip_force=tip_force,
        tip_moment=tip_moment,
        following=True,
    )
    expected = by_hand(force, moment, point, body_in_world=np.eye(3))
    at_tip = [0.0, 0.0, LENGTH[-1]]
    expected += by_hand(tip_force, tip_moment, at_tip, body_in_world=np.eye(3))
    for body in (np.eye(3), Rotation.random(random_state=RNG).as_matrix()):
        found = body_wrench(body, of_body(sums(load), 5))
        margin.within("wrench", found - expected, 1e-13)


def test_base_and_steps_have_their_own():
    loads = [
        nf.Load(tension=1.0),
        nf.Load(tension=1.0, body_forces=[nf.BodyForce(0, (1.0, 2.0, 3.0))]),
        nf.Load(tension=1.0),
    ]
    every = sums(loads)
    assert [field.shape for field in every[:4]] == [(3, 6, 3), (3, 6, 3), (3, 6, 3, 3), (3, 6, 6)]
    np.testing.assert_array_equal(every.dead_force[1, 0], [1.0, 2.0, 3.0])
    assert not np.any(every.dead_force[[0, 2]])
    assert not np.any(every.dead_force[1, 1:])


def test_base_turned_upside_down_turns_gravity(margin):
    load = nf.Load(tip_mass=100.0, tip_point=(0.0, 0.0, 2.0), base_rotation=(np.pi, 0.0, 0.0))
    found = body_wrench(np.eye(3), of_body(sums(load), 5))
    margin.within("wrench", found - np.array([0, 0, 0, 0, 0, 0.981]), 1e-15)
    sideways = nf.Load(tip_mass=100.0, gravity=(10.0, 0.0, 0.0), tip_point=(0.0, 0.0, 2.0))
    found = body_wrench(np.eye(3), of_body(sums(sideways), 5))
    margin.within("sideways", found - np.array([0, LENGTH[-1] + 2.0, 0, 1, 0, 0]), 1e-15)


def test_own_weight_is_that_of_the_tube_less_the_cuts(margin):
    robot = ROBOT.with_value("material.density", 6450.0).with_value("tube.base_length", 3.0)
    mass, centre = body_masses(robot, assemble(robot, flat=False).rods)
    wall = np.pi / 4.0 * (1.62**2 - 1.40**2)
    notch = robot.notches[0]
    left = nf.annular_sector(0.81, 0.70, notch.depth)
    volume = wall * (3.0 + 5 * notch.uncut_length) + 5 * left.area * notch.height
    margin.within("mass [g]", mass.sum() - 6450e3 * volume * 1e-9, 1e-15)
    # In the straight robot half of each notch hangs at either end of its neutral axis.
    origin = np.cumsum([0.0, 3.0 + notch.height, *[notch.height + notch.uncut_length] * 4])
    z = mass @ (origin + centre[:, 2]) / mass.sum()
    pieces = [wall * 3.0 * 1.5]
    pieces += [wall * notch.uncut_length * (at + notch.uncut_length / 2) for at in origin[1:]]
    pieces += [left.area * notch.height * (at - notch.height / 2) for at in origin[1:]]
    margin.within("centre along the tube [mm]", z - sum(pieces) / volume, 1e-13)
    x = mass @ centre[:, 0] / mass.sum()
    margin.within(
        "centre across [mm]", x + left.centroid * 5 * left.area * notch.height / volume, 1e-15
    )
    weight = sums(nf.Load(gravity=(0.0, -9.81, 0.0)), robot=robot, mass=mass, centre=centre)
    expected = -9.81 * 6450.0 * volume * 1e-9
    margin.within("weight [N]", np.asarray(weight.dead_force)[0].sum(0)[1] - expected, 1e-17)
    arm = np.outer(centre[2], weight.dead_force[0, 2])
    margin.within("arm [N mm]", weight.dead_arm[0, 2] - arm, 1e-19)


def test_no_density_no_weight():
    robot = ROBOT.replace(material=nf.Linear(7510.0))
    mass, _ = body_masses(robot, assemble(robot, flat=False).rods)
    assert not mass.any()
    with refused("UNSUPPORTED", "material.density", "tip_mass"):
        sums(nf.Load(gravity=(0.0, 0.0, -9.81)), robot=robot)
    sums(nf.Load(gravity=(0.0, 0.0, -9.81), tip_mass=1.0), robot=robot)
    sums(nf.Load(gravity=(0.0, 0.0, 0.0)), robot=robot)


IN_PLANE = [
    {"tip_force": (1.0, 0.0, -2.0), "tip_moment": (0.0, 3.0, 0.0), "tip_point": (1.0, 0.0, 2.0)},
    {"gravity": (0.0, 0.0, -9.81)},
    {"tip_mass": 3.0},
    {"body_forces": [nf.BodyForce(2, (1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), True)]},
    {"tip_point": (0.0, 1.0, 0.0)},  # where nothing acts
    {},
]
OUT_OF_PLANE = [
    {"tip_force": (1.0, 1e-9, 0.0)},
    {"tip_moment": (0.0, 1.0, 1e-9)},
    {"tip_force": (1.0, 0.0, 0.0), "tip_point": (0.0, 0.5, 0.0)},
    {"gravity": (0.0, -9.81, 0.0)},
    {"tip_mass": 3.0, "tip_point": (0.0, 1.0, 0.0)},
    {"body_forces": [nf.BodyForce(2, (0.0, 1.0, 0.0), following=True)]},
]


def turned(options, turn):
    """The same loads, turned about the tube axis."""
    vectors = {
        name: turn.apply(options[name])
        for name in ("tip_force", "tip_moment", "tip_point", "gravity")
        if name in options
    }
    forces = [
        nf.BodyForce(one.body, *map(turn.apply, (one.force, one.moment, one.point)), one.following)
        for one in options.get("body_forces", ())
    ]
    return options | vectors | {"body_forces": forces}


@pytest.mark.parametrize("direction", [0.0, 30.0, 180.0, -90.0])
@pytest.mark.parametrize("planar", [True, False])
def test_loads_in_the_plane_of_bending(direction, planar):
    robot = ROBOT.with_value("notch.direction_deg", direction)
    turn = Rotation.from_euler("z", direction, degrees=True)
    for options in IN_PLANE if planar else OUT_OF_PLANE:
        path = load_path(nf.Load(tension=1.0, **turned(options, turn)), 1)
        assert is_planar(path, robot) is planar, options


@pytest.mark.parametrize("planar", [True, False])
def test_loads_in_the_world_on_a_turned_base(planar):
    force = (1.0, 0.0, -2.0) if planar else (0.0, 1.0, 0.0)
    turn = Rotation.random(random_state=RNG)
    load = nf.Load(base_rotation=turn.as_rotvec(), tip_force=turn.apply(force))
    assert is_planar(load_path(load, 1), ROBOT) is planar


def test_notches_in_several_planes_have_no_normal():
    robot = ROBOT.with_value("notch[2].direction_deg", 90.0)
    assert bending_normal(robot) is None
    assert not is_planar(nf.pull(0.0, 1.0), robot)
    opposite = ROBOT.with_value("notch[2].direction_deg", 180.0)
    np.testing.assert_allclose(bending_normal(opposite), [0.0, 1.0, 0.0], atol=1e-15)
    assert is_planar(nf.pull(0.0, 1.0), opposite)


def test_bodies_are_those_of_the_robot():
    with refused("OUT_OF_RANGE", "body 6", " 0 ", " 5"):
        sums(nf.Load(body_forces=[nf.BodyForce(6, (1.0, 0.0, 0.0))]))


def test_one_load_out_of_plane_is_enough():
    straight = nf.pull(0.0, 1.0, 3).loaded(tip_force=(0.1, 0.0, 0.0))
    assert is_planar(straight, ROBOT)
    assert not is_planar(straight.then(straight.loaded(tip_force=(0.0, 0.1, 0.0))), ROBOT)
