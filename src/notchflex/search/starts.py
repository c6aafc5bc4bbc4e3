"""Starts of searches: points between 0 and 1, and the best of them that are far from each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

# Smallest distance between starts, relative to the diagonal of the unit cube.
_APART = 0.1


def sobol_points(count: int, variables: int, seed: int) -> Float[np.ndarray, "count variables"]:
    """Return the first points of Sobol's scrambled sequence; one without variables."""
    if variables == 0:
        return np.zeros((1, 0))
    power = int(np.ceil(np.log2(max(count, 2))))
    return qmc.Sobol(variables, rng=np.random.default_rng(seed)).random_base2(power)[:count]


def spread_out(points: Sequence[Float[np.ndarray, " variables"]], count: int) -> list[int]:
    """Choose points in their order that are far from all before, then nearer ones; by number."""
    far: list[int] = []
    near: list[int] = []
    for number, point in enumerate(points):
        apart = _APART * np.sqrt(len(point))
        is_near = any(np.linalg.norm(point - points[other]) < apart for other in far)
        (near if is_near else far).append(number)
    return [*far, *near][:count]
