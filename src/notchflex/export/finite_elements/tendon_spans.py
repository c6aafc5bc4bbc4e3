"""The straight pieces of tendons, between nodes of a mesh."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.errors import InputError
from notchflex.export.finite_elements.half_tube import HalfTube
from notchflex.export.tendon_holes import tendon_holes
from notchflex.mechanics.chain.mass import body_lengths
from notchflex.robot import Robot

# A tendon may lie so far from the nearest node, as a part of its distance from the tube axis.
_NEAR = 0.01


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
    robot: Robot, mesh: HalfTube, tendon: int, tension: Float[np.ndarray, " spans"]
) -> list[TendonSpan]:
    """Return the pieces of a tendon.

    Args:
        robot: The robot.
        mesh: The mesh of half of it.
        tendon: Which tendon, from 0.
        tension: Tension of its spans as `span_tension` has them: proximal, gap 1, body 1, ...

    Raises:
        InputError: The tendon lies outside the plane of symmetry, or not at the wall.
    """
    one = robot.tendon[tendon]
    away = abs((one.direction_deg - robot.notches[0].direction_deg + 180.0) % 360.0 - 180.0)
    if away > 1e-6:
        raise InputError.UNSUPPORTED(
            f"tendon {tendon + 1} of {robot.name} is pulled and lies {away:g} deg beside the "
            "notches: half of the tube is meshed, so that it must lie on their side"
        )
    radii = np.hypot(*mesh.place[:, :2].T)
    column = int(
        np.argmin([_distance(mesh, radii, i, one.radius) for i in range(mesh.nodes.shape[0])])
    )
    if _distance(mesh, radii, column, one.radius) > _NEAR * one.radius:
        raise InputError.UNSUPPORTED(
            f"tendon[{tendon + 1}].radius is {one.radius} mm: the mesh has nodes between "
            f"{robot.tube.inner_radius:g} and {robot.tube.outer_radius:g} mm; place it there, or "
            "take more elements through the wall"
        )
    starts = _origins(robot)
    holes = [starts[hole.body] + hole.place[2] for hole in tendon_holes(robot, tendon)]
    layers = [int(np.argmin(np.abs(mesh.heights - z))) for z in holes]
    nodes = [int(mesh.nodes[column, -1, layer]) for layer in layers]
    own = tension if robot.tube.base_length > 0.0 else tension[1:]
    spans: list[TendonSpan] = []
    for (a, b), force in zip(pairwise(range(len(nodes))), own.tolist(), strict=False):
        if nodes[b] < 0:
            raise InputError.UNSUPPORTED(
                f"tendon {tendon + 1} of {robot.name} meets no wall {holes[b]:g} mm from the base: "
                "give the notch before an uncut_length"
            )
        if nodes[a] > 0:
            spans.append(TendonSpan((nodes[a], nodes[b]), None, force))
        else:  # without a base the first notch begins where the tube is held
            spans.append(TendonSpan((nodes[b],), (one.radius, 0.0, holes[a]), force))
    return spans


def _distance(mesh: HalfTube, radii: np.ndarray, column: int, radius: float) -> float:
    numbers = mesh.nodes[column, -1, :]
    return float(np.abs(radii[numbers[numbers > 0] - 1] - radius).max())


def _origins(robot: Robot) -> Float[np.ndarray, " bodies"]:
    """Where the bodies begin on the straight tube, mm."""
    lengths = body_lengths(robot.tube, robot.notches)
    heights = [getattr(notch, "height", 0.0) for notch in robot.notches]
    return np.concatenate([[0.0], np.cumsum(lengths[:-1] + heights)])
