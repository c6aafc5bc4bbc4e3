"""The solids of the scene: closed, what the cuts leave, and bent as the rods are."""

from functools import cache

import numpy as np
import pytest

import notchflex as nf
from notchflex.export import MovingSolids
from robots import ready

trimesh = pytest.importorskip("trimesh", reason="the extra `viewer` is not installed")
pytest.importorskip("manifold3d", reason="the extra `viewer` is not installed")

ROBOTS = ["pacheco2021-a", "gao2017", "liu2022", "two-axis-wrist", "york2015"]


@cache
def solids(robot):
    return MovingSolids(robot, 0.8 * robot.tube.outer_radius)


def closed(vertices, faces):
    return trimesh.Trimesh(vertices, faces, process=False)


def pieces(robot):
    """Bodies and flexures as they are cut."""
    made = solids(robot)
    return [closed(*one) for one in made.bodies], [closed(*one) for one in made.flexures]


@pytest.mark.parametrize("name", ROBOTS)
def test_every_piece_is_closed_and_right_side_out(name):
    bodies, flexures = pieces(nf.load_robot(name))
    assert len(bodies) == len(flexures) + 1
    for one in [*bodies, *flexures]:
        assert one.is_watertight
        assert one.is_winding_consistent
        assert one.volume > 0.0
        assert one.body_count == 1


@pytest.mark.parametrize("name", ["A", "B"])
def test_pieces_between_slots_are_rings(name):
    robot = ready(name)
    tube, notch = robot.tube, robot.notches[0]
    wall = np.pi * (tube.outer_radius**2 - tube.inner_radius**2)
    for one in pieces(robot)[0][1:]:
        assert one.volume == pytest.approx(wall * notch.uncut_length, rel=1e-4)
        assert one.bounds[:, 2] == pytest.approx([0.0, notch.uncut_length], abs=1e-5)


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
@pytest.mark.parametrize("depth", [1.2, 1.4, 1.55])
def test_a_flexure_is_what_the_cut_leaves(cut, depth):
    # 1.55 mm leaves 0.07 mm at the spine, less than the wall of 0.11 mm
    robot = ready("A").with_values({"notch.cut": cut, "notch.depth": depth})
    tube, notch = robot.tube, robot.notches[0]
    section = (nf.annular_sector if cut == "on-axis" else nf.annular_segment)(
        tube.outer_radius, tube.inner_radius, depth
    )
    for one in pieces(robot)[1]:
        # flat sides instead of round ones, of which the thin rest has only a few
        assert one.volume == pytest.approx(float(section.area) * notch.height, rel=0.03)


@pytest.mark.parametrize(
    "load",
    [
        nf.Load(tension=1.0),
        nf.Load(tension=0.5, tip_force=(0, 0.02, 0)),
        nf.Load(tension=0.5, tip_mass=2.0),
    ],
)
def test_a_bent_flexure_joins_its_pieces_and_keeps_its_volume(load):
    """Also under loads that ask for more sections of the rods."""
    robot = ready("A")
    made = solids(robot)
    shape, flexures = made.at(nf.simulate(robot, load))
    for number, points in enumerate(flexures):
        straight, faces = made.flexures[number]
        bent = closed(points, faces)
        assert bent.is_watertight
        # the spine lies to one side of the neutral axis as much as to the other
        assert bent.volume == pytest.approx(closed(straight, faces).volume, rel=1e-2)
        for body, end, face in (
            (number, straight[:, 2].min(), robot.geometry.body_length[number]),
            (number + 1, straight[:, 2].max(), 0.0),
        ):
            rim = points[np.abs(straight[:, 2] - end) < 1e-9]
            local = (rim - shape.position[body]) @ shape.rotation[body]
            assert local[:, 2] == pytest.approx(np.full(len(rim), face), abs=1e-5)


def test_a_robot_that_is_bent_without_loads_is_seen_so():
    robot = nf.load_robot("pacheco2021-a-specimen")
    path = nf.simulate(robot, nf.Load())
    shape, flexures = solids(robot).at(path)
    assert shape.tip == pytest.approx(path.tip_position[0], abs=1e-9)
    straight = solids(robot).flexures[-1][0]
    assert np.abs(flexures[-1] - straight).max() > 0.01
