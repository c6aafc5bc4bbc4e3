"""Which dimension to control, and the tolerance that is allowed for a wanted yield."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.stats import qmc

from notchflex.tolerancing.study import Study

_POINTS = 2048
_WIDEST = 2.0
"""Largest factor on a tolerance that is tried."""
_EXACT = 0.02
"""Relative accuracy of the factor on a tolerance."""


class Control(NamedTuple):
    """Effect of one tolerance on the yield, the others unchanged.

    Attributes:
        exact: Yield if the source had no deviation at all, (d,).
        factor: Factor on the deviations of the source that gives the wanted yield, (d,): below 1
            they must be smaller, above 1 they may be larger. 0 where even no deviation is not
            enough; infinite where twice the deviations are not too many. None where no yield is
            wanted.
        robots: How many robots each yield is of.
    """

    exact: Float[np.ndarray, " d"]
    factor: Float[np.ndarray, " d"] | None
    robots: int


def control(
    study: Study,
    draws: int,
    target: float | None,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Control:
    """Change one tolerance after the other, with the same draws.

    Args:
        study: What deviates, and the numbers that have limits.
        draws: About how many robots the yield is found of.
        target: The wanted yield, between 0 and 1; None to look for no tolerance.
        seed: Of the points.
        progress: Called with the sources done and all of them.
    """
    points = min(2 ** int(np.log2(draws)), _POINTS)
    sampler = qmc.Sobol(len(study.sources), scramble=True, rng=np.random.default_rng(seed))
    levels = sampler.random(points)
    exact, factors = [], []
    for index in range(len(study.sources)):
        yields: dict[float, float] = {}

        def yield_at(
            factor: float, index: int = index, computed: dict[float, float] = yields
        ) -> float:
            if factor not in computed:
                drawn = study.drawn(levels)
                source = study.sources[index]
                for name, value in source.nominal.items():
                    drawn[name] = value + factor * (drawn[name] - value)
                computed[factor] = float(study.solved(drawn, points).accepted.mean())
            return computed[factor]

        exact.append(yield_at(0.0))
        if target is not None:
            factors.append(_factor(yield_at, target))
        if progress is not None:
            progress(index + 1, len(study.sources))
    return Control(np.array(exact), None if target is None else np.array(factors), points)


def _factor(yield_at: Callable[[float], float], target: float) -> float:
    """Find the factor on a tolerance at which the yield falls to its target."""
    if yield_at(0.0) < target:
        return 0.0
    low, high = 0.0, 1.0
    while yield_at(high) >= target:
        if high >= _WIDEST:
            return np.inf
        low, high = high, 2.0 * high
    # The yield is a staircase: a root of the difference lies on a step.
    root: Any = brentq(lambda factor: yield_at(factor) - target, low, high, xtol=_EXACT * high)
    return float(root)
