"""The levers of tendons about hinges."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from notchflex.export.simulators.hinges import HingeChain
from notchflex.export.tendon_holes import Hole


def tendon_levers(
    chain: HingeChain, holes: list[Hole], angle: Float[np.ndarray, "s n"]
) -> Float[np.ndarray, "s n"]:
    """Return by how much a tendon shortens per turn of every hinge, mm/rad.

    Args:
        chain: The hinges.
        holes: The points that the tendon runs through.
        angle: Angles of the hinges from the free robot, rad.
    """
    position, rotation = chain.bodies(angle)
    first = position[:, :-1] + np.einsum(
        "snab,nb->sna", rotation[:, :-1], chain.offset - chain.lever
    )
    axis = np.einsum("snab,nb->sna", rotation[:, :-1], chain.axis)
    points = [position[:, h.body] + rotation[:, h.body] @ h.place for h in holes]
    levers = np.zeros(angle.shape)
    for (a, start), (b, stop) in pairwise(zip(holes, points, strict=True)):
        along = stop - start
        along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-300)
        for j in range(a.body, b.body):
            turned = np.cross(axis[:, j], stop - first[:, j])
            levers[:, j] -= np.einsum("sa,sa->s", along, turned)
    return levers
