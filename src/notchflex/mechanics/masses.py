"""Lengths and masses of the bodies of a robot: uncut tube, disks, and what the notches leave."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import cached, xp
from notchflex.mechanics.flexure import Rod
from notchflex.mechanics.section import gauss_on, half_angle
from notchflex.mechanics.tendon import TUBE_AXIS
from notchflex.robot import Robot, Tube
from notchflex.robot.cuts import NotchCut
from notchflex.robot.kinds import Notch


def body_lengths(tube: Tube, notches: Sequence[Notch]) -> Float[Array, " bodies"]:
    """Return the length of each rigid piece on the tube axis, base first, mm."""
    following = (*notches[1:], None)
    spacings = (notch.spacing(after) for notch, after in zip(notches, following, strict=True))
    return xp.stack(xp.broadcast_arrays(tube.base_length, *spacings))


@cached(1024)
def _beside_strip(
    notch: Notch, tube_before: Tube, tube: Tube, before: Notch | None, after: Notch | None
) -> Float[Array, "2 2"]:
    """Return volumes, and their moments, of the wall before a strip across the tube and behind."""
    layout: Any = notch.cut_layout(tube, before, after)
    radii, (opening, *behind) = xp.array([[tube.outer_radius], [tube.inner_radius]]), layout.cuts
    ring = np.pi * (radii[0, 0] ** 2 - radii[1, 0] ** 2)
    earlier = before and before.is_strip and before.cut_layout(tube_before, None, notch)
    # The cut behind the strip before may reach into this length of tube.
    over = [cut.moved(-earlier.length) for cut in earlier.cuts[1:]] if earlier else []

    def taken(cut: NotchCut, along: Array) -> Array:
        """Compute the area that a cut takes of the tube's wall."""
        places, heights = xp.array(cut.corners).T
        # A face across the tube is passed where it stands.
        passed = (along[:, None] - places[:-1] + 1e-99) / xp.maximum(xp.diff(places), 1e-99)
        # Beside its ends the bottom of a cut rises by the rounding of its corners.
        radius = xp.array(cut.radii).max()
        inside = xp.maximum(radius - xp.minimum(along - places[0], places[-1] - along), 0.0)
        risen = radius - xp.sqrt(xp.maximum(radius**2 - inside**2, 1e-300))
        bottom = heights[0] + xp.clip(passed, 0.0, 1.0) @ xp.diff(heights) + risen
        # Beyond that chord lies a segment of a circle less one of the bore.
        angle = half_angle(radii, radii - bottom, radii + bottom)
        segments = radii**2 * (angle - 0.5 * xp.sin(2.0 * angle))
        return segments[0] - segments[1]

    def left(low: Any, high: Any, cuts: Sequence[NotchCut]) -> Array:
        def within(place: Any) -> Any:  # the cut's own end where they are equal, for slopes
            place = xp.where(place > low, place, low)
            return xp.where(place > high, high, place)

        moments = ring * xp.stack([high - low, 0.5 * (high - low) ** 2])
        for number, cut in enumerate(cuts):
            along, weights = gauss_on(within(cut.corners[0][0]), within(cut.corners[-1][0]))
            area = taken(cut, along)
            if number:
                # What the first cut has taken already: of thin walls exact for cuts from any
                # sides, of others for those from one side and from opposite ones.
                other = taken(cuts[0], along)
                mean, turn = 0.5 * (area + other), cut.side_deg - cuts[0].side_deg
                apart = ring / 360.0 * abs(math.remainder(turn, 360.0))
                shared = xp.clip(mean - apart, 0.0, xp.minimum(area, other))
                area = area - shared - xp.maximum(mean + apart - ring, 0.0)
            moments = moments - xp.stack([area @ weights, area @ (weights * (along - low))])
        return moments

    face = layout.length - notch.spacing(after)
    return xp.stack([left(0.0, face, [opening, *over]), left(face, layout.length, behind + over)])


def body_masses(
    robot: Robot, rods: Rod
) -> tuple[Float[Array, " bodies"], Float[Array, "bodies 3"]]:
    """Compute mass and centre of mass of each body, with its share of the notches."""
    # A body is a piece of uncut tube: the area of the tube's wall times the body's axial length,
    # its centre halfway on the tube axis. Only bodies carry loads, so the mass of each flexure
    # (area of its sections times the length of the neutral axis) is lumped: half at the start of
    # the neutral axis on the body before it, half at its end on the body after it. A strip across
    # the tube belongs to the body behind it, with all that its cuts leave of the wall there; what
    # they leave before the strip belongs to the body before.
    tubes, notches = robot.tubes, robot.notches
    length = body_lengths(tubes[0], notches)
    masses = [None, *(notch.mass for notch in notches)]
    if robot.densities is None and all(mass is None for mass in masses):
        return xp.zeros(len(length)), xp.zeros((len(length), 3))
    # Where no density is known, disks of a known mass count alone.
    density = 1e-6 * xp.array(robot.densities or [0.0] * len(length))  # g/mm³
    around, none = (None, *notches, None), np.zeros((2, 2))
    neighbours = zip(notches, tubes[:-1], tubes[1:], around[:-2], around[2:], strict=True)
    walls = xp.stack([_beside_strip(*each) if each[0].is_strip else none for each in neighbours])
    is_strip = np.array([False, *(notch.is_strip for notch in notches)])
    rings = [tube.outer_radius**2 - tube.inner_radius**2 for tube in tubes]
    piece = xp.where(is_strip, 0.0, np.pi * xp.array(rings) * length * density)
    if any(mass is not None for mass in masses):
        given = [piece[k] if mass is None else mass for k, mass in enumerate(masses)]
        piece = xp.stack(xp.broadcast_arrays(*given))
    sections = xp.sum(rods.section.area * rods.length, axis=-1)
    half = xp.where(is_strip, 0.0, 0.5 * density)[1:] * sections
    # The weight of a backbone turns its ends as a beam's does (w L^2/12): a sixth of L inside them.
    is_round = np.array([notch.is_round for notch in notches])
    inside = (is_round * xp.sum(rods.length, axis=-1) / 6.0)[:, None] * TUBE_AXIS
    end = -xp.einsum("nba,nb->na", rods.end_rotation, rods.end_offset)
    # Every body weighs: where no tube is left between two notches, half of each flexure.
    mass, moment = piece, (0.5 * length * piece)[:, None] * TUBE_AXIS
    for side, (place, origin) in enumerate(
        ((rods.start_offset + inside, length[:-1]), (end - inside, 0.0))
    ):
        wall, first = walls[:, side].T * density[1:]
        first = (first + origin * wall)[:, None] * TUBE_AXIS + half[:, None] * place
        mass = mass + xp.pad(wall + half, (side, 1 - side))
        moment = moment + xp.pad(first, ((side, 1 - side), (0, 0)))
    return mass, moment / xp.where(mass > 0.0, mass, 1.0)[:, None]
