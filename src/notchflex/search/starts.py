"""Starts of searches: those of many points between 0 and 1 that are far from each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

# Smallest distance between starts, relative to the diagonal of the unit cube.
_APART = 0.1


def spread_out(points: Sequence[Float[np.ndarray, " variables"]], count: int) -> list[int]:
    """Choose points in their order that are far from all before, then nearer ones; by number."""
    far: list[int] = []
    near: list[int] = []
    for number, point in enumerate(points):
        apart = _APART * np.sqrt(len(point))
        is_near = any(np.linalg.norm(point - points[other]) < apart for other in far)
        (near if is_near else far).append(number)
    return [*far, *near][:count]
