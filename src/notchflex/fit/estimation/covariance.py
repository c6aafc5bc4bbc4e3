"""Covariance of constants: of independent rows, and robust to rows that correlate within a pull.

Model errors, and how a robot was held and photographed, stay much the same through a pull. Rows of
a pull are then not worth as much as their number (Huber 1967; Liang and Zeger 1986).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import chi2

from notchflex.fit.estimation.intervals import allowed_rise, unit_free
from notchflex.fit.estimation.minimise import Cost

# Probability below which pulls differ by more than their rows do.
_UNLIKELY = 0.05


@dataclass(frozen=True, eq=False)
class ByPulls:
    """Uncertainty of k constants from the scatter between whole pulls.

    Attributes:
        covariance: Covariance of the constants, (k, k); NaN if fewer than two pulls were measured.
        pulls: Number of pulls that depend on each constant, (k,).
        wider: Standard deviation of each constant over that by rows, if pulls differ by more than
            chance; else 1, (k,).
    """

    covariance: Float[np.ndarray, "k k"]
    pulls: Int[np.ndarray, " k"]
    wider: Float[np.ndarray, " k"]

    def rise(self, number: int) -> float:
        """Return the allowed rise of twice the misfit at the ends of a 95 % interval.

        It follows from Student's t with one degree of freedom less than there are pulls.
        """
        return allowed_rise(int(self.pulls[number]) - 1) * float(self.wider[number]) ** 2


def by_pulls(
    cost: Cost,
    slopes: Float[np.ndarray, "r k"],
    pull: Int[np.ndarray, " r"],
    by_rows: Float[np.ndarray, "k k"],
) -> ByPulls:
    """Estimate the uncertainty of constants at a minimum from the scatter between pulls.

    `by_rows` is their covariance if all rows were independent.
    """
    labels, which = np.unique(pull, return_inverse=True)
    count, size = len(labels), slopes.shape[1]
    depends = np.zeros((count, size), bool)
    np.logical_or.at(depends, which, slopes != 0.0)
    pulls = depends.sum(axis=0)
    if count < 2:
        return ByPulls(np.full((size, size), np.nan), pulls, np.ones(size))
    gradients = np.zeros((count, size))
    np.add.at(gradients, which, cost.contributions)
    inverse = inverse_of(cost.curvature)
    # Gradients of the pulls add up to zero at the minimum: one follows from the others.
    correction = np.sqrt(pulls / np.maximum(pulls - 1, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        scatter = inverse @ (gradients.T @ gradients) @ inverse
        covariance = scatter * np.outer(correction, correction)
        ratio = np.sqrt(np.diag(covariance) / np.diag(by_rows))
    freedom = np.maximum(pulls - 1, 1)
    limit = chi2.ppf(1.0 - _UNLIKELY, freedom) / freedom
    differ = (pulls > 1) & np.isfinite(ratio) & (ratio**2 > limit)
    return ByPulls(covariance, pulls, np.where(differ, ratio, 1.0))


def inverse_of(curvature: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    """Return the inverse of a curvature; infinite for constants without any."""
    is_known = np.diag(curvature) > 0.0
    inverse = np.diag(np.where(is_known, 0.0, np.inf))
    sizes, plain = unit_free(curvature[np.ix_(is_known, is_known)])
    values, vectors = np.linalg.eigh(plain)
    # A curvature of 0 that rounding made small gives a wide interval, not a narrow one.
    part = (vectors / np.maximum(values, 1e-15)) @ vectors.T
    inverse[np.ix_(is_known, is_known)] = part / np.outer(sizes, sizes)
    return inverse
