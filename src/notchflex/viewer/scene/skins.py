"""The flexures as solids that bend: triangles that stay, corners that follow the sections.

A corner keeps its place in its section, so a bent flexure costs a sum over its corners. A spine is
one piece of the wall; a strip across the tube is two, one in the wall on either side of the bore.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.bent import Bent, Sections, bent_by_angles
from notchflex.robot import Robot

PIECES = 12  # straight pieces that a bent flexure is drawn with, at least
ROUND = 12  # flat pieces of a spine, as seen along the tube
ACROSS = 3  # corners of a strip across its thickness

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Skin:
    """The surface of a flexure with k sections.

    Attributes:
        across: Place of every corner in its section, along the section's first axis, mm, (c, k).
        out: The same along the second axis.
        faces: Corners of triangles, counter-clockwise as seen from outside, (f, 3); corners are
            counted section by section.
    """

    across: Points
    out: Points
    faces: NDArray[np.int64]

    def at(self, sections: Sections) -> Points:
        """Place all corners for a bent flexure, mm, (k c, 3)."""
        x, y = self.across.T[..., None], self.out.T[..., None]
        rotation = sections.rotation[:, None]
        points = sections.position[:, None] + x * rotation[..., 0] + y * rotation[..., 1]
        return points.reshape(-1, 3)


def at_rest(robot: Robot, level: str = "tendons") -> Bent:
    """Return a robot as it stands when nothing loads it, drawn with `PIECES`.

    Args:
        robot: The robot.
        level: For which loads its chain is assembled; more of them may ask for more sections.
    """
    free = np.radians([notch.precurvature_deg for notch in robot.notches])
    return bent_by_angles(robot, free, PIECES, level)


def skins(rest: Bent) -> list[Skin]:
    """Return the surfaces of all flexures of a robot, base to tip.

    Args:
        rest: The robot as `at_rest` draws it; later states are drawn with as many pieces.
    """
    spine = np.asarray(rest.chain.rods.has_closure) > 0.0
    return [
        _spine(rest, notch) if spine[notch] else _strip(rest, notch)
        for notch in range(len(rest.flexures))
    ]


def _spine(rest: Bent, notch: int) -> Skin:
    """A piece of the wall with the edges that the cut made: radial ones, or one straight cut."""
    one, tube = rest.flexures[notch], rest.robot.tube
    outer, inner = tube.outer_radius, tube.inner_radius
    description = rest.robot.notches[notch]
    axis = outer - one.spine  # from the neutral axis to the axis of the tube
    # Where the cut meets the outer surface; radial edges go on from there to the axis.
    depth, radial = description.spine_cut or (outer - float(one.near[0] - axis[0]), False)
    cut = outer - depth
    half_outer = float(np.arccos(np.clip(-cut / outer, -1.0, 1.0)))
    half_inner = half_outer if radial else float(np.arccos(np.clip(-cut / inner, -1.0, 1.0)))
    part = np.linspace(-1.0, 1.0, ROUND + 1)
    outside = np.stack([-outer * np.cos(part * half_outer), -outer * np.sin(part * half_outer)])
    if radial or cut > -inner:
        angle = part * half_inner
        inside = np.stack([-inner * np.cos(angle), -inner * np.sin(angle)])
    else:  # less than the wall is left
        inside = np.stack([np.full(len(part), cut), -outer * np.sin(half_outer) * part])
    corners = np.stack([outside, inside], axis=1)  # (2, layers, angles)
    across = corners[0].reshape(-1, 1) + axis[None]
    out = np.broadcast_to(corners[1].reshape(-1, 1), across.shape)
    return Skin(across, out, _box(len(axis), ROUND + 1))


def _strip(rest: Bent, notch: int) -> Skin:
    """A strip across the tube, its walls as far out as the tube's are there."""
    one, tube = rest.flexures[notch], rest.robot.tube
    view = np.radians(rest.robot.notches[notch].direction_deg)
    direction = np.array([np.cos(view), np.sin(view), 0.0])
    place = np.linspace(0.0, 1.0, ACROSS)[:, None] * (one.spine + one.near) - one.spine
    outside, inside = [], []
    for row in place:
        own = (one.fibre(row) - rest.position[notch]) @ rest.rotation[notch] @ direction
        beside = np.minimum(np.abs(own), tube.outer_radius)
        outside.append(np.sqrt(tube.outer_radius**2 - beside**2))
        inside.append(np.sqrt(np.maximum(tube.inner_radius**2 - beside**2, 0.0)))
    count = len(one.area)
    walls = np.stack([np.stack(outside), np.stack(inside)])  # (layers, across, sections)
    # The other wall is this one seen in a mirror, which turns its triangles round.
    across = np.concatenate([np.tile(place, (2, 1))] * 2)
    out = np.concatenate([walls.reshape(-1, count), -walls.reshape(-1, count)])
    box = _box(count, ACROSS)
    corners = 2 * ACROSS
    section, corner = np.divmod(box, corners)
    first, second = section * 2 * corners + corner, section * 2 * corners + corners + corner
    return Skin(across, out, np.concatenate([first[:, ::-1], second]))


def _box(sections: int, row: int) -> NDArray[np.int64]:
    """Triangles of a curved box: two layers, outer first, of a row of corners in each section."""
    ring = np.concatenate([np.arange(row), np.arange(2 * row - 1, row - 1, -1)])
    following = np.roll(ring, -1)
    faces: list[NDArray[np.int64]] = []
    for at in range(sections - 1):
        here, there = at * 2 * row, (at + 1) * 2 * row
        a, b, c, d = ring + here, following + here, following + there, ring + there
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    first = np.arange(row - 1)
    a, b, c, d = first, first + 1, first + 1 + row, first + row
    cap = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    last = (sections - 1) * 2 * row
    return np.concatenate([*faces, cap, cap[:, ::-1] + last])


__all__ = ["PIECES", "Skin", "at_rest", "skins"]
