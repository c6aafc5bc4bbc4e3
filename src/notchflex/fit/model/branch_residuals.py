"""Whether unloading rows lie elsewhere about the model than loading rows: hysteresis it misses."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import mannwhitneyu
from scipy.stats import t as student

from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.residuals import Residuals
from notchflex.results.quantities.registry import DEGREES

BRANCH_QUANTITIES = ("total_angle", "notch_angle")
"""What is looked at: the first of these that was measured."""

# Branches whose means differ by chance with this probability differ; so few rows tell nothing.
_UNLIKELY, _ROWS = 0.01, 3
# A scatter below this part of the difference is rounding; a difference below this part of all
# residuals is not what the model misses.
_EXACT, _SHARE = 1e-9, 0.5


class BranchDifference(NamedTuple):
    """Mean of measurement less model on each branch, rad."""

    loading: float
    unloading: float


def branch_difference(
    off: Float[np.ndarray, " p"], branch: Int[np.ndarray, " p"]
) -> BranchDifference | None:
    """Compare the means of both branches.

    They differ if neighbouring rows scatter by much less (Student's t with the scatter of second
    differences, von Neumann 1941), or if ranks say so (Mann and Whitney 1947) where the hysteresis
    is large in some rows only; and by no less than half of what the model misses in all.

    Args:
        off: Measurement less model of every row; NaN where nothing was measured.
        branch: 1 for loading rows, -1 for unloading rows, as `Measurements.branches`.

    Returns:
        Both means; None where they differ by no more than chance, or a branch has too few rows.

    Example:
        >>> off = np.array([-1.0, -1.1, -0.9, -1.0, -1.1, 1.0, 1.2, 0.9, 1.0, 1.1])
        >>> round(branch_difference(off, np.repeat([1, -1], 5)).unloading, 2)
        1.04
    """
    up, down = (off[(branch == way) & np.isfinite(off)] for way in (1, -1))
    if min(len(up), len(down)) < _ROWS:
        return None
    means = BranchDifference(float(np.mean(up)), float(np.mean(down)))
    difference = means.unloading - means.loading
    both = np.concatenate([up, down])
    if abs(difference) <= _SHARE * float(np.sqrt(np.mean(both**2))):
        return None
    error = np.sqrt(sum(np.mean(np.diff(one, 2) ** 2) / 6.0 / len(one) for one in (up, down)))
    if error <= _EXACT * abs(difference):
        return means
    chance = 2.0 * float(student.sf(abs(difference) / error, max(0.5 * len(both) - 2.0, 1.0)))
    ranks: Any = mannwhitneyu(up, down)
    return means if min(chance, float(ranks.pvalue)) < _UNLIKELY else None


def branch_words(difference: BranchDifference, quantity: str, measured: Measurements) -> str:
    """Say in one sentence how the branches differ, and what to do."""
    told = [_side(mean) for mean in (difference.unloading, difference.loading)]
    what = "" if quantity == "total_angle" else " (mean of the notches)"
    sentence = (
        f"Unloading rows of {measured.source} are {told[0]} the model and loading rows {told[1]} "
        f"it{what}: "
    )
    if measured.from_rest:
        return (
            f"{sentence}they were taken as loaded from rest. If the rows are one loading path, say "
            "so: --path, or a column from_rest of 0."
        )
    return f"{sentence}the hysteresis of the model is not that of the data."


def off_by_row(
    residuals: Residuals, sample: int, quantity: str, rows: int
) -> Float[np.ndarray, " p"]:
    """Mean residual of one quantity in every row of a measurement; NaN where there is none."""
    own = (residuals.sample == sample) & (residuals.quantity == OBSERVED.index(quantity))
    row = residuals.row[own]
    count = np.bincount(row, minlength=rows)
    total = np.bincount(row, weights=residuals.values[own], minlength=rows)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _side(mean: float) -> str:
    return f"{abs(mean) * DEGREES:.2g} deg {'above' if mean > 0.0 else 'below'}"


__all__ = [
    "BRANCH_QUANTITIES",
    "BranchDifference",
    "branch_difference",
    "branch_words",
    "off_by_row",
]
