"""How certain constants are if whole pulls count, not rows: a covariance robust to clusters.

What the model misses, and how a robot was held and photographed, stay much the same through a pull.
Rows of a pull are then not worth as much as their number (Huber 1967; Liang and Zeger 1986).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import chi2

from notchflex.fit.estimation.curvature import inverse_of
from notchflex.fit.estimation.intervals import allowed_rise
from notchflex.fit.estimation.minimise import Cost

# Pulls differ by more than their rows do if chance would make them so with this probability.
_UNLIKELY = 0.05


@dataclass(frozen=True, eq=False)
class ByPulls:
    """The certainty of k constants judged by whole pulls.

    Attributes:
        covariance: Of the constants; NaN where fewer than two pulls were measured.
        pulls: How many pulls depend on each constant, (k,).
        wider: By how much the standard deviation of each constant is larger than that by rows,
            where pulls differ by more than chance; 1 elsewhere, (k,).
    """

    covariance: Float[np.ndarray, "k k"]
    pulls: Int[np.ndarray, " k"]
    wider: Float[np.ndarray, " k"]

    def rise(self, number: int) -> float:
        """By how much twice the misfit may rise in the 95 % interval of a constant.

        That of Student's t with one degree of freedom less than there are pulls.
        """
        return allowed_rise(int(self.pulls[number]) - 1) * float(self.wider[number]) ** 2


def by_pulls(
    cost: Cost,
    slopes: Float[np.ndarray, "r k"],
    pull: Int[np.ndarray, " r"],
    by_rows: Float[np.ndarray, "k k"],
) -> ByPulls:
    """Judge constants by whole pulls.

    Args:
        cost: The objective at its least value.
        slopes: Derivatives of the residuals by the constants.
        pull: Which pull each residual belongs to.
        by_rows: Covariance of the constants if all rows were independent.
    """
    labels, which = np.unique(pull, return_inverse=True)
    count = len(labels)
    size = slopes.shape[1]
    moved = np.zeros((count, size), bool)
    np.logical_or.at(moved, which, slopes != 0.0)
    pulls = moved.sum(axis=0)
    ones = np.ones(size)
    if count < 2:
        return ByPulls(np.full((size, size), np.nan), pulls, ones)
    shares = np.zeros((count, size))
    np.add.at(shares, which, cost.shares)
    inverse = inverse_of(cost.curvature)
    # Shares add up to nothing where the misfit is least: one pull follows from the others.
    correction = np.sqrt(pulls / np.maximum(pulls - 1, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        covariance = inverse @ (shares.T @ shares) @ inverse * np.outer(correction, correction)
        ratio = np.sqrt(np.diag(covariance) / np.diag(by_rows))
    freedom = np.maximum(pulls - 1, 1)
    limit = chi2.ppf(1.0 - _UNLIKELY, freedom) / freedom
    differ = (pulls > 1) & np.isfinite(ratio) & (ratio**2 > limit)
    return ByPulls(covariance, pulls, np.where(differ, ratio, 1.0))


__all__ = ["ByPulls", "by_pulls"]
