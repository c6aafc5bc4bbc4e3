"""The straight pieces of tendons, between nodes of a mesh."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.export.finite_elements.layers import check_shape
from notchflex.export.finite_elements.tube_mesh import TubeMesh
from notchflex.export.tendon_holes import tendon_holes
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.robot import Robot

# A tendon may lie so far from the nearest node, as a part of its distance from the tube axis.
_MAX_NODE_OFFSET = 0.01


class TendonSpan(NamedTuple):
    """A straight piece of a tendon.

    Attributes:
        nodes: Nodes at its ends, base first; only the distal one where the other is fixed.
        fixed: A point at rest where it begins, mm; None where it begins at a node.
        tension: Its tension, N.
    """

    nodes: tuple[int, ...]
    fixed: tuple[float, float, float] | None
    tension: float


def tendon_spans(
    robot: Robot, mesh: TubeMesh, tendon: int, tension: Float[np.ndarray, " spans"]
) -> list[TendonSpan]:
    """Return the pieces of a tendon.

    Args:
        robot: The robot.
        mesh: The mesh, with a line at the tendon.
        tendon: Which tendon, from 0.
        tension: Tension of its spans as `span_tension` has them: proximal, gap 1, body 1, ...

    Raises:
        InputError: The tendon does not lie at the wall.
    """
    one = robot.tendon[tendon]
    side = np.radians(one.direction_deg - mesh.x_deg)
    point = one.radius * np.array([np.cos(side), np.sin(side)])
    starts = _origins(robot)
    holes = [starts[hole.body] + hole.place[2] for hole in tendon_holes(robot, tendon)]
    layers = [int(np.argmin(np.abs(mesh.heights - z))) for z in holes]
    nodes = [mesh.nearest(layer, point) for layer in layers]
    if min(away for _, away in nodes) > _MAX_NODE_OFFSET * one.radius:
        raise InputError.UNSUPPORTED(
            f"tendon[{tendon + 1}].radius is {one.radius} mm: the mesh has nodes between "
            f"{robot.tube.inner_radius:g} and {robot.tube.outer_radius:g} mm; place it there, or "
            "take more elements through the wall"
        )
    meets = [away <= _MAX_NODE_OFFSET * one.radius for _, away in nodes]
    own = tension if robot.tube.base_length > 0.0 else tension[1:]
    spans: list[TendonSpan] = []
    for (a, b), force in zip(pairwise(range(len(nodes))), own.tolist(), strict=False):
        if not meets[b]:
            raise InputError.UNSUPPORTED(
                f"tendon {tendon + 1} of {robot.name} meets no wall {holes[b]:g} mm from the base: "
                "give the notch before an uncut_length"
            )
        if meets[a]:
            spans.append(TendonSpan((nodes[a][0], nodes[b][0]), None, force))
        else:  # without a base the first notch begins where the tube is held
            fixed = float(point[0]), float(point[1]), float(holes[a])
            spans.append(TendonSpan((nodes[b][0],), fixed, force))
    return spans


def _origins(robot: Robot) -> Float[np.ndarray, " bodies"]:
    """Start of each body on the straight tube, mm."""
    lengths = body_lengths(robot.tube, robot.notches)
    heights = [notch.height for notch in check_shape(robot)]
    return np.concatenate([[0.0], np.cumsum(lengths[:-1] + heights)])
