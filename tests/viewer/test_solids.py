"""The solids of the scene: closed, as large as what the cuts leave, and bent as the rods are."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import notchflex as nf
from notchflex.plotting import shape_at
from notchflex.viewer.scene.scene import PIECES, ROUND, at_rest, body_solids, skins
from robots import ready

trimesh = pytest.importorskip("trimesh", reason="the extra `viewer` is not installed")
pytest.importorskip("manifold3d", reason="the extra `viewer` is not installed")


def solid(vertices, faces):
    return trimesh.Trimesh(vertices, faces, process=False)


@cache
def bodies(robot):
    return [solid(*mesh) for mesh in body_solids(at_rest(robot))]


def flexures(shape, rest):
    pairs = zip(skins(rest), shape.flexures, strict=True)
    return [solid(skin.at(sections), skin.faces) for skin, sections in pairs]


def polygon(sides, radius):
    """Area of the regular polygon that stands for a circle."""
    return 0.5 * sides * np.sin(2 * np.pi / sides) * radius**2


ROBOTS = ["pacheco2021-a", "gao2017", "liu2022", "two-axis-wrist", "york2015"]


@pytest.mark.parametrize("name", ROBOTS)
def test_every_piece_is_closed_and_right_side_out(name):
    robot = nf.load_robot(name)
    for one in [*bodies(robot), *flexures(at_rest(robot), at_rest(robot))]:
        assert one.is_watertight
        assert one.is_winding_consistent
        assert one.volume > 0.0
    assert all(one.body_count == 1 for one in bodies(robot))


@pytest.mark.parametrize("name", ["A", "B"])
def test_pieces_between_slots_are_rings(name):
    robot = ready(name)
    tube, notch = robot.tube, robot.notches[0]
    wall = polygon(ROUND, tube.outer_radius) - polygon(ROUND, tube.inner_radius)
    for one in bodies(robot)[1:]:
        assert one.volume == pytest.approx(wall * notch.uncut_length, rel=1e-8)
        # manifold3d joins points nearer than 1e-8 or so of the size of a solid
        assert one.bounds[:, 2] == pytest.approx([0.0, notch.uncut_length], abs=1e-8)


@pytest.mark.parametrize("cut", ["on-axis", "off-axis"])
@pytest.mark.parametrize("depth", [1.2, 1.4, 1.55])
def test_a_flexure_is_what_the_cut_leaves(cut, depth):
    # 1.55 mm leaves 0.07 mm at the spine, less than the wall of 0.11 mm
    robot = ready("A").with_values({"notch.cut": cut, "notch.depth": depth})
    tube, notch = robot.tube, robot.notches[0]
    section = (nf.annular_sector if cut == "on-axis" else nf.annular_segment)(
        tube.outer_radius, tube.inner_radius, depth
    )
    rest = at_rest(robot)
    for one in flexures(rest, rest):
        # chords instead of arcs: 12 pieces over 2.4 rad at most cut off less than 1 % of a thin
        # wall, and as much of the segment of the outer circle that is all there is at 1.55 mm
        assert one.volume == pytest.approx(float(section.area) * notch.height, rel=0.012)
    assert rest.flexures[0].spine[0] == pytest.approx(float(section.edge_spine))


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


def test_links_and_pieces_fill_the_tube_but_for_its_slots():
    robot = nf.load_robot("gao2017")
    tube, link, rest = robot.tube, robot.notches[0], at_rest(robot)
    pieces = sum(one.volume for one in [*bodies(robot), *flexures(rest, rest)])
    held = -bodies(robot)[0].bounds[0, 2]
    wall = np.pi * (tube.outer_radius**2 - tube.inner_radius**2)
    taken = slot(tube, 0.5 * link.strip_length, link.slot_radius)
    # the links' edges are straight between their sections
    assert pieces == pytest.approx(wall * (35.0 + held) - 28 * taken, rel=0.005)


def test_at_rest_is_where_the_solver_finds_an_unloaded_robot():
    robot = nf.load_robot("pacheco2021-a-specimen")  # bent when nothing pulls
    solved = shape_at(nf.simulate(robot, nf.Load()), 0, PIECES)
    for found, wanted in zip(at_rest(robot).flexures, solved.flexures, strict=True):
        assert found.position == pytest.approx(wanted.position, abs=1e-9)


@pytest.mark.parametrize(
    "load", [nf.Load(tension=0.5, tip_force=(0, 0.02, 0)), nf.Load(tension=0.5, tip_mass=2.0)]
)
def test_loads_that_ask_for_more_sections_find_as_many_in_the_skin(load):
    path = nf.simulate(ready("A"), load)
    shape, rest = shape_at(path, 0, PIECES), at_rest(ready("A"), path.chain.level)
    assert all(one.is_watertight for one in flexures(shape, rest))
    assert [len(one.area) for one in shape.flexures] == [len(one.area) for one in rest.flexures]


def test_a_bent_flexure_joins_its_pieces_and_keeps_its_volume():
    robot = ready("A")
    rest = at_rest(robot)
    path = nf.simulate(robot, nf.Load(tension=1.0))
    shape = shape_at(path, 0, PIECES)
    whole = zip(flexures(shape, rest), flexures(rest, rest), strict=True)
    for number, (bent, straight) in enumerate(whole):
        assert bent.is_watertight
        # the spine lies to one side of the neutral axis as much as to the other
        assert bent.volume == pytest.approx(straight.volume, rel=1e-2)
        corners = len(bent.vertices) // len(shape.flexures[number].area)
        for body, own in (
            (number, bent.vertices[:corners]),
            (number + 1, bent.vertices[-corners:]),
        ):
            local = (own - shape.position[body]) @ shape.rotation[body]
            face = robot.geometry.body_length[body] if body == number else 0.0
            assert local[:, 2] == pytest.approx(np.full(corners, face), abs=1e-9)
