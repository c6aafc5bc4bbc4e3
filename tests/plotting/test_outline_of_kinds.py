"""Outlines of strips and U-links: true to the descriptions, with nothing of theirs in `plot`."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.chain import assemble
from notchflex.plotting.shapes import body_faces, lips, outline, shape_from_angles, tendon_line


def shape_of(name, angle=0.0):
    robot = nf.load_robot(name)
    return shape_from_angles(robot, np.full(robot.number_of_notches, angle))


@pytest.fixture(scope="module")
def links():
    return shape_of("gao2017")


@pytest.fixture(scope="module")
def strips():
    return shape_of("liu2022")


def test_a_wall_piece_spans_two_strips_and_the_slot_between(links):
    side = outline(links, 0.0)
    # The first slot is cut from the left: the body behind it has wall on the left only.
    first = side.bodies[1]
    assert first[:, 0].max() < 0.0
    assert first[:, 0].min() == pytest.approx(-2.995)
    assert np.ptp(first[:, 1]) == pytest.approx(2 * 0.70 + 2 * 0.275)
    # The slot ends half the strip and a radius from the axis.
    assert first[:, 0].max() == pytest.approx(-(0.5 * 2.0 + 0.275), abs=0.03)
    second = side.bodies[2]
    assert second[:, 0].min() == pytest.approx(-first[:, 0].max())


def test_slots_lie_between_the_pieces_of_one_side(links):
    side = outline(links, 0.0)
    slot = side.bodies[3][:, 1].min() - side.bodies[1][:, 1].max()
    assert slot == pytest.approx(2 * 0.275)
    assert side.bodies[-1][:, 1].max() == pytest.approx(35.0)


def test_a_link_is_as_thick_as_its_strip_and_joins_its_pieces(links):
    link = links.flexures[0]
    middle = len(link.area) // 2
    assert (link.spine + link.near)[middle] == pytest.approx(0.70)
    assert link.position[middle, 0] == pytest.approx(0.0, abs=0.1)
    steps = np.linalg.norm(np.diff(link.position, axis=0), axis=1)
    assert steps.max() < 0.25  # no jump, from the one wall to the other
    assert link.position[0, 0] == pytest.approx(-link.position[-1, 0])


def test_strips_are_beams_between_slanted_bodies(strips):
    strip = strips.flexures[2]
    assert np.ptp(strip.position[:, 0]) == pytest.approx(8.0)
    assert np.ptp(strip.position[:, 2]) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(strip.spine + strip.near, 1.5)
    body = outline(strips, 0.0).bodies[3]
    right, left = (body[np.isclose(body[:, 0], sign * 5.0), 1] for sign in (1.0, -1.0))
    # Behind the notch on the right; before the one on the left, which opens half a turn beyond.
    np.testing.assert_allclose(np.ptp(right), 1.5)
    np.testing.assert_allclose(np.ptp(left), 1.5)
    np.testing.assert_allclose(left.min() - right.min(), 3.5)


@pytest.mark.parametrize("angle", [0.0, 0.02])
def test_tendons_go_through_their_true_points(angle):
    shape = shape_of("gao2017", angle)
    line = tendon_line(shape, 0)
    assert len(line) == 2 * (1 + 14)  # the base and the 14 pieces on its side
    group = assemble(shape.robot, flat=False).groups[0]
    own, following = np.flatnonzero(np.asarray(group.visits)[:, 0])[3:5]
    for point, place in ((line[8], group.enters[own, 0]), (line[9], group.leaves[following, 0])):
        np.testing.assert_allclose(point, shape.on_body(1 + int(own), place), atol=1e-12)


def test_a_bent_link_still_ends_at_its_bodies():
    shape = shape_of("liu2022", 0.2)
    rods = assemble(shape.robot, flat=False).rods
    for j, strip in enumerate(shape.flexures):
        clamp = shape.on_body(j, np.asarray(rods.start_offset)[j])
        np.testing.assert_allclose(strip.position[0], clamp, atol=1e-12)
        length = np.linalg.norm(np.diff(strip.position, axis=0), axis=1).sum()
        assert length == pytest.approx(8.0, rel=1e-4)  # it neither stretches nor jumps


def test_notches_close_where_they_are_open(links, strips):
    radii = [2.995, 5.0]
    for shape, radius in zip((links, strips), radii, strict=True):
        for notch in range(len(shape.flexures)):
            assert abs(lips(shape, notch)[0]) == pytest.approx(radius)
    assert lips(links, 0)[0] < 0.0 < lips(links, 1)[0]


def test_walls_in_space_are_half_round_where_slots_alternate(links):
    base, first, *_ = body_faces(links)
    assert len(first) == len(base) / 2
    assert first[..., 0].max() == pytest.approx(0.0, abs=1e-9)
