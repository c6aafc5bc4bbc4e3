"""Difference of residuals between loading and unloading rows: hysteresis missing in the model."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import mannwhitneyu
from scipy.stats import t as student

from notchflex.fit.measurements.measurements import Measurements
from notchflex.results.quantities.registry import DEGREES

# Probability below which means of branches differ by more than chance; the least rows of a branch.
_UNLIKELY, _ROWS = 0.01, 3
# A scatter below this part of the difference is rounding; a difference below this part of all
# residuals is not what the model misses.
_EXACT, _SHARE = 1e-9, 0.5


def branch_difference(
    off: Float[np.ndarray, " p"], branch: Int[np.ndarray, " p"]
) -> tuple[float, float] | None:
    """Compare measurement less model on loading rows (1) and unloading rows (-1).

    The means differ if neighbouring rows scatter by much less (Student's t with the scatter of
    second differences, von Neumann 1941), or by ranks (Mann and Whitney 1947) if the hysteresis is
    large in some rows only; and by no less than half of what the model misses in all. Return both
    means; None if they do not differ, or a branch has too few rows.

    Example:
        >>> off = np.array([-1.0, -1.1, -0.9, -1.0, -1.1, 1.0, 1.2, 0.9, 1.0, 1.1])
        >>> round(branch_difference(off, np.repeat([1, -1], 5))[1], 2)
        1.04
    """
    up, down = (off[(branch == sign) & np.isfinite(off)] for sign in (1, -1))
    if min(len(up), len(down)) < _ROWS:
        return None
    loading, unloading = float(np.mean(up)), float(np.mean(down))
    difference = abs(unloading - loading)
    both = np.concatenate([up, down])
    if difference <= _SHARE * float(np.sqrt(np.mean(both**2))):
        return None
    error = np.sqrt(sum(np.mean(np.diff(one, 2) ** 2) / 6.0 / len(one) for one in (up, down)))
    if error <= _EXACT * difference:
        return loading, unloading
    chance = 2.0 * float(student.sf(difference / error, max(0.5 * len(both) - 2.0, 1.0)))
    ranks: Any = mannwhitneyu(up, down)
    return (loading, unloading) if min(chance, float(ranks.pvalue)) < _UNLIKELY else None


def branch_words(
    off: Float[np.ndarray, " p"], quantity: str, measured: Measurements
) -> tuple[str, ...]:
    """Say how measurement less model (rad) differs between the branches, and what to do."""
    means = branch_difference(off, measured.branches)
    if means is None:
        return ()
    loading, unloading = (
        f"{abs(mean) * DEGREES:.2g} deg {'above' if mean > 0.0 else 'below'}" for mean in means
    )
    what = "" if quantity == "total_angle" else " (mean of the notches)"
    advice = (
        "they were taken as loaded from rest. If the rows are one loading path, say so: --path, or "
        "a column from_rest of 0."
        if measured.from_rest
        else "the hysteresis of the model is not that of the data."
    )
    return (
        f"Unloading rows of {measured.source} are {unloading} the model and loading rows "
        f"{loading} it{what}: {advice}",
    )
