"""Depths of notches from where the edges of spines are seen.

From the side, a notch that is rolled a little looks like one that is less deep. One photograph does
not tell which it is; photographs between which the robot was turned by known angles do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from notchflex.photographs.chain.chain_table import ChainTable, Numbers
from notchflex.photographs.cut.straight import StraightFit, seen_edges

_ROLL = math.radians(10.0)  # usual roll of a robot that was laid down with care
_DEPTH = 0.1  # of the outer diameter: how far a depth may be off
_TURN = math.radians(0.3)  # how well a turn is known
_MIN_SPREAD = 1e-4  # mm: no edge is known better
_STARTS = np.radians(np.arange(-24.0, 25.0, 6.0))


def depths(
    table: ChainTable, fits: Sequence[StraightFit], turns: Numbers
) -> tuple[Numbers, Numbers, float]:
    """Return what notches are deeper than in the robot file, and standard deviations, mm, (n,).

    The third is the largest residual, in standard deviations.

    Args:
        table: The robot.
        fits: What the photographs say.
        turns: By how much the robot was turned about its axis for each of them, rad.
    """
    n = table.notches
    scales = np.concatenate([np.full(n, _DEPTH * 2.0 * table.outer), [_ROLL]])
    scales = np.concatenate([scales, np.full(len(fits), _TURN)])
    weights = [
        np.linalg.inv(np.linalg.cholesky(fit.edge_spread + _MIN_SPREAD**2 * np.eye(n)))
        for fit in fits
    ]

    def residuals(scaled: Numbers) -> Numbers:
        numbers = scaled * scales
        rolls = numbers[n] + turns + numbers[n + 1 :]
        apart = [
            weight @ (seen_edges(table, numbers[:n], float(roll)) - fit.edge)
            for weight, fit, roll in zip(weights, fits, rolls, strict=True)
        ]
        return np.concatenate([*apart, scaled])

    results = []
    for roll in _STARTS:
        start = np.zeros(len(scales))
        start[n] = roll / _ROLL
        results.append(least_squares(residuals, start))
    best = min(results, key=lambda one: one.cost)
    covariance = np.linalg.inv(best.jac.T @ best.jac)
    return (
        (best.x * scales)[:n],
        (np.sqrt(np.diag(covariance)) * scales)[:n],
        float(np.abs(best.fun).max()),
    )
