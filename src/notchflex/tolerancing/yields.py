r"""The part of robots that is accepted, by randomised quasi-Monte Carlo, with an honest interval.

Scrambled Sobol points fill the tolerances more evenly than independent draws, so that a binomial
interval of all points would be too wide. They are drawn as independent replicates: each is
scrambled anew, and the scatter of their yields $\hat p_r$ gives the variance of the mean. That is
worth $n_e = \hat p(1 - \hat p)/\operatorname{var}(\bar p)$ independent draws, which Wilson's
interval takes with the quantile of Student's t for the number of replicates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import t as student_t

from notchflex.pieces.sobol import SobolPart

REPLICATES = 25
"""Independent sets of points: the quantile of t is 5 % above that of infinitely many."""

CONFIDENCE = 0.95


def points_of_each(draws: int) -> int:
    """Return how many points each replicate has: the power of two nearest to its share.

    Example:
        >>> REPLICATES * points_of_each(100_000)
        102400
    """
    return 2 ** max(round(math.log2(draws / REPLICATES)), 1)


def replicates(sources: int, each: int, seed: int) -> Iterator[Float[np.ndarray, "each d"]]:
    """Yield independent sets of levels, scrambled Sobol points between 0 and 1.

    Args:
        sources: How many numbers are drawn.
        each: Points of a set, a power of two.
        seed: The same seed makes the same points.
    """
    for number in range(REPLICATES):
        yield replicate(sources, each, seed, number).between(0, each)


def replicate(sources: int, each: int, seed: int, number: int) -> SobolPart:
    """Return one set of levels, any part of which can be made.

    Args:
        sources: How many numbers are drawn.
        each: Points of a set, a power of two.
        seed: The same seed makes the same points.
        number: Which of the sets, from 0.
    """
    return SobolPart(sources, lambda: np.random.default_rng(seed).spawn(REPLICATES)[number], each)


def yield_interval(accepted: Int[np.ndarray, " replicates"], each: int) -> tuple[float, float]:
    """Return the 95 % interval of the yield.

    Args:
        accepted: How many robots of each replicate are accepted.
        each: Robots of a replicate.

    Example:
        >>> low, high = yield_interval(np.full(25, 40), 40)
        >>> round(low, 4), high
        (0.9958, 1.0)
    """
    count = len(accepted)
    parts = np.asarray(accepted) / each
    part, variance = float(parts.mean()), float(parts.var(ddof=1)) / count
    effective = part * (1.0 - part) / variance if variance > 0.0 else float(count * each)
    quantile = float(student_t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1))
    return wilson(part, effective, quantile)


def wilson(part: float, count: float, quantile: float) -> tuple[float, float]:
    """Return Wilson's interval of a proportion.

    Args:
        part: The proportion found.
        count: Of how many independent draws; may be a fraction.
        quantile: Half width of the interval of a normal distribution, 1.96 for 95 %.
    """
    square = quantile**2 / count
    middle = (part + 0.5 * square) / (1.0 + square)
    half = quantile * math.sqrt(part * (1.0 - part) / count + 0.25 * square / count)
    low, high = middle - half / (1.0 + square), middle + half / (1.0 + square)
    return max(low, 0.0) if part > 0.0 else 0.0, min(high, 1.0) if part < 1.0 else 1.0
