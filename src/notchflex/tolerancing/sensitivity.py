"""Sobol indices: which part of the variance of a number each source of deviations makes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc, sobol_indices

from notchflex.tolerancing.study import Study

_MAX_POINTS, _MIN_POINTS = 2048, 16
"""Points of each of the two sets; all indices need d + 2 times as many robots."""


class SobolIndices(NamedTuple):
    """Sobol indices of the numbers that have limits, and last of acceptance itself.

    Attributes:
        first: Part of the variance that a source makes alone, (k + 1, d); NaN where nothing varies.
        total: The same with what it makes together with others, (k + 1, d).
        robots: How many robots were solved.
        failed: How many of them had no result; a neighbour's stands in for it.
    """

    first: Float[np.ndarray, "k d"]
    total: Float[np.ndarray, "k d"]
    robots: int
    failed: int


def sobol(
    study: Study, draws: int, seed: int, progress: Callable[[int, int], None] | None = None
) -> SobolIndices:
    """Compute Sobol indices after Saltelli (2010).

    Args:
        study: What deviates, and the numbers that have limits.
        draws: About how many robots may be solved.
        seed: Of the points.
        progress: Called with the robots done and all of them.
    """
    sources = len(study.sources)
    points = 2 ** int(math.log2(max(draws / (sources + 2), _MIN_POINTS)))
    points = min(points, _MAX_POINTS)
    sampler = qmc.Sobol(2 * sources, scramble=True, rng=np.random.default_rng(seed))
    both = sampler.random(points)
    first, second = both[:, :sources], both[:, sources:]
    mixed = np.repeat(first[None], sources, axis=0)
    for index in range(sources):
        mixed[index, :, index] = second[:, index]
    levels = np.concatenate([first, second, *mixed])
    outcomes = study.at_levels(levels, progress)
    values = np.column_stack([outcomes.values, outcomes.accepted.astype(float)])
    sets = values.reshape(sources + 2, points, -1)
    is_finite = np.isfinite(sets).all(axis=(0, 2))
    failed = int(np.isnan(values).any(axis=1).sum())
    size = sets.shape[2]
    if not is_finite.any():
        nothing = np.full((size, sources), np.nan)
        return SobolIndices(nothing, nothing, len(levels), failed)
    # A set of robots with one that failed is replaced by the good set before it.
    last = np.maximum.accumulate(np.where(is_finite, np.arange(points), -1))
    sets = sets[:, np.where(last >= 0, last, np.argmax(is_finite))]
    sets = sets - sets[:2].mean(axis=(0, 1))  # smaller errors than about a distant mean
    ordered = np.moveaxis(sets, 1, 2)
    varies = np.ptp(ordered[:2], axis=(0, 2)) > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        indices = sobol_indices(
            func={"f_A": ordered[0], "f_B": ordered[1], "f_AB": ordered[2:]}, n=points
        )
    first_order, total = (
        np.where(varies[:, None], one.reshape(size, sources), np.nan)
        for one in (indices.first_order, indices.total_order)
    )
    return SobolIndices(first_order, total, len(levels), failed)
