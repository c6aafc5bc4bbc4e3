"""The solids of the scene: closed, what the cuts leave, and bent as the rods are."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import notchflex as nf
from notchflex.export import MovingSolids
from robots import ready

shapely = pytest.importorskip("shapely", reason="the extra `test` is not installed")
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
        assert one.volume == pytest.approx(wall * notch.uncut_length, rel=1e-8)
        # manifold3d joins points nearer than 1e-8 or so of the size of a solid
        assert one.bounds[:, 2] == pytest.approx([0.0, notch.uncut_length], abs=1e-8)


def flat_wall(tube, sides=48):
    """The section of a tube with flat sides, as large as that of the round one."""
    angle = 2.0 * np.pi / sides
    corners = np.exp(1j * angle * np.arange(sides)) * np.sqrt(angle / np.sin(angle))
    outer, inner = (
        shapely.Polygon(np.stack([radius * corners.real, radius * corners.imag], axis=1))
        for radius in (tube.outer_radius, tube.inner_radius)
    )
    assert outer.area == pytest.approx(np.pi * tube.outer_radius**2, rel=1e-12)
    return outer - inner


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
@pytest.mark.parametrize("depth", [1.2, 1.4, 1.55])
def test_a_flexure_is_what_the_cut_leaves(cut, depth):
    # 1.55 mm leaves 0.07 mm at the spine, less than the wall of 0.11 mm
    robot = ready("A").with_values({"notch.cut": cut, "notch.depth": depth})
    tube, notch = robot.tube, robot.notches[0]
    edge, far = tube.outer_radius - notch.section_depth(tube), 10.0
    if cut == "on-axis":
        half = np.arccos(edge / tube.outer_radius)
        turns = np.linspace(-half, half, 9)
        arc = far * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        waste = shapely.Polygon([(0.0, 0.0), *arc])
    else:
        waste = shapely.box(edge, -far, far, far)
    left = flat_wall(tube) - waste
    for one in pieces(robot)[1]:  # manifold3d joins points nearer than 1e-8 or so
        assert one.volume == pytest.approx(left.area * notch.height, rel=1e-7)
    # flat sides instead of round ones, of which the thin rest has only a few
    section = (nf.annular_sector if cut == "on-axis" else nf.annular_segment)(
        tube.outer_radius, tube.inner_radius, depth
    )
    assert left.area == pytest.approx(float(section.area), rel=0.012)


def slot(tube, reach, radius):
    """What a slot with a round end takes from the tube, by quadrature over its depth, mm³."""
    # It comes in from the one side, its end's centre `reach` beyond the axis.
    edges = np.array([-tube.outer_radius, -tube.inner_radius, tube.inner_radius, tube.outer_radius])
    total, nodes = 0.0, np.polynomial.legendre.leggauss(400)
    ends = np.unique(np.clip([*edges, reach, reach + radius], -tube.outer_radius, reach + radius))
    for low, high in pairwise(ends):
        x = 0.5 * (low + high) + 0.5 * (high - low) * nodes[0]
        wall = np.sqrt(tube.outer_radius**2 - x**2) - np.sqrt(
            np.maximum(tube.inner_radius**2 - x**2, 0.0)
        )
        beyond = np.maximum(x - reach, 0.0)
        width = 2.0 * np.sqrt(np.maximum(radius**2 - beyond**2, 0.0))
        total += 0.5 * (high - low) * float(nodes[1] @ (2.0 * wall * width))
    return total


def test_sections_have_their_own_tubes_and_measured_joints_are_sleeves():
    wide, arc = nf.Tube(1.9, 1.6), ready("A").notches[0]
    numbers = {"stiffness": (50.0, 50.0, 40.0, 6.0, 6.0, 900.0), "tube": wide}
    joints = (nf.TableNotch(3.0, uncut_length=length, **numbers) for length in (0.5, 0.0))
    strip = nf.StripNotch(height=0.6, strip_thickness=0.2, depth=1.6, tube=wide)
    robot = ready("A").replace(
        notch=(*joints, strip, arc), tendon=(nf.Tendon(0.6, path="straight"),)
    )
    bodies, flexures = pieces(robot)
    assert bodies[2].is_watertight  # the first cut of the strip

    def wall(tube):
        return np.pi * (tube.outer_radius**2 - tube.inner_radius**2)

    for one in flexures[:2]:
        assert one.is_watertight
        assert one.volume == pytest.approx(3.0 * wall(wide), rel=1e-8)
    assert bodies[1].volume == pytest.approx(0.5 * wall(wide), rel=1e-8)
    assert bodies[-1].volume == pytest.approx(arc.uncut_length * wall(robot.tube), rel=1e-8)
    alone = pieces(
        ready("A").replace(notch=(strip,), tube=wide, tendon=(nf.Tendon(0.6, path="straight"),))
    )[1]
    assert flexures[2].volume == pytest.approx(alone[0].volume, rel=1e-6)
    shape, moved = solids(robot).at(nf.simulate(robot, nf.Load(0.1)))
    bent = closed(moved[0], solids(robot).flexures[0][1])
    assert bent.volume == pytest.approx(3.0 * wall(wide), rel=1e-3)
    assert len(shape.position) == 5


def test_links_and_pieces_fill_the_tube_but_for_its_slots():
    robot = nf.load_robot("gao2017")
    tube, link = robot.tube, robot.notches[0]
    bodies, flexures = pieces(robot)
    held = -bodies[0].bounds[0, 2]
    wall = np.pi * (tube.outer_radius**2 - tube.inner_radius**2)
    taken = slot(tube, 0.5 * link.strip_length, link.slot_radius)
    whole = sum(one.volume for one in [*bodies, *flexures])
    assert whole == pytest.approx(wall * (35.0 + held) - 28 * taken, rel=1e-3)


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
            assert local[:, 2] == pytest.approx(np.full(len(rim), face), abs=1e-9)


def test_a_robot_that_is_bent_without_loads_is_seen_so():
    robot = nf.load_robot("pacheco2021-a-specimen")
    path = nf.simulate(robot, nf.Load())
    shape, flexures = solids(robot).at(path)
    assert shape.tip == pytest.approx(path.tip_position[0], abs=1e-9)
    straight = solids(robot).flexures[-1][0]
    assert np.abs(flexures[-1] - straight).max() > 0.01
