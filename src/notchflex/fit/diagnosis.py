"""What to know of a fit before trusting it, in sentences, and its errors part by part."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import mannwhitneyu
from scipy.stats import t as student

from notchflex.fit.calibration import NO_SOLUTION, Calibration, Interval
from notchflex.fit.constants import SENSOR, Unknown
from notchflex.fit.measurements.measurements import (
    MEASURED,
    NOTCH_ANGLES,
    Measurements,
    Numbers,
)
from notchflex.fit.measurements.repeats import repeats_of_each
from notchflex.support import DEGREES

# A half-width of more than this part of the value is loose; constants more correlated than that
# cannot be distinguished.
_LOOSE, _ALIKE = 0.5, 0.95
# So many standard deviations from its prior a constant contradicts it.
_UNLIKE_PRIOR = 3.0
# Probability below which a constant that is not fitted is named.
_HELPS = 0.05
# Distance from a limit that counts as at it, as a part of the scale of a constant.
_AT_LIMIT = 1e-6
# Probability below which means of branches differ by more than chance; the least rows of a branch.
_UNLIKELY, _ROWS = 0.01, 3
# A scatter below this part of the difference is rounding; a difference below this part of all
# residuals is not what the model misses.
_EXACT, _SHARE = 1e-9, 0.5

NO_PROBLEMS = "No problems found."
"""Sentence that is printed if `diagnose` finds nothing."""

_PATTERNS = {
    "runs": "residuals of neighbouring loads are alike",
    "notches": "residuals have a trend over the notches",
    "missing": "a constant that is not fitted explains part of them",
}


def diagnose(found: Calibration) -> tuple[str, ...]:
    """Say what a user should know before trusting the constants, the gravest first.

    Args:
        found: The fit.

    Returns:
        Sentences; none if no problem was found.
    """
    return tuple(_sentences(found))


def with_unit(value: float, unit: str) -> str:
    """Return a number as text, with its unit."""
    return f"{value:.5g} {unit}".strip()


def _sentences(calibration: Calibration) -> Iterator[str]:
    if not calibration.converged:
        yield f"The search did not settle: {calibration.reason}."
    yield from _not_trusted(calibration)
    for number, sample in enumerate(calibration.problem.samples.every):
        yield from _branches(calibration, number, sample.measured)
    values, slopes = calibration.estimate.tolist(), calibration.reached.gradient
    for unknown, value, slope in zip(calibration.problem.unknowns, values, slopes, strict=False):
        yield from _limits(unknown, value, slope)
        yield from _far(unknown, value)
    if not calibration.tells_no_noise:
        for unknown, value in zip(calibration.problem.unknowns, values, strict=True):
            if unknown.name in calibration.intervals:
                yield from _loose(unknown, value, calibration.intervals[unknown.name])
    yield from _alike(calibration)
    yield from _noise(calibration)


def _not_trusted(calibration: Calibration) -> Iterator[str]:
    """Patterns of the residuals that noise does not make, and what would explain them."""
    tests = calibration.tests
    if tests is None or not tests.rejected:
        return
    patterns = ", ".join(_PATTERNS[name] for name in tests.rejected)
    yield (
        f"Not trusted: {patterns}, which noise does not do. The model misses something: the "
        "constants may lie far outside their intervals."
    )
    for best in tests.missing[:1]:
        if best.chance < _HELPS:
            yield (
                f"Try adding {best.name} to the fit: the misfit would fall by about "
                f"{100.0 * best.share:.0f} %."
            )


def _branches(calibration: Calibration, number: int, measured: Measurements) -> tuple[str, ...]:
    """Whether unloading rows deviate from the model by another amount than loading rows."""
    residuals = calibration.residuals
    for name in ("total_angle", "notch_angle"):
        mine = residuals.of(number, name)
        if mine.any():
            row, size = residuals.row[mine], len(measured)
            total, count = (
                np.bincount(row, weights, size) for weights in (-residuals.values[mine], None)
            )
            mean = np.divide(total, count, out=np.full(size, np.nan), where=count > 0)
            return branch_words(mean, name, measured)
    return ()


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
    rows = up, down = [off[(branch == sign) & np.isfinite(off)] for sign in (1, -1)]
    if min(len(up), len(down)) < _ROWS:
        return None
    means = float(np.mean(up)), float(np.mean(down))
    difference, both = abs(means[1] - means[0]), np.concatenate(rows)
    if difference <= _SHARE * np.sqrt(np.mean(both**2)):
        return None
    error = np.sqrt(
        sum(np.mean(np.diff(branch_rows, 2) ** 2) / 6.0 / len(branch_rows) for branch_rows in rows)
    )
    if error <= _EXACT * difference:
        return means
    chance = 2.0 * student.sf(difference / error, max(0.5 * len(both) - 2.0, 1.0))
    ranks: Any = mannwhitneyu(up, down)
    return means if min(chance, ranks.pvalue) < _UNLIKELY else None


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


def _limits(unknown: Unknown, value: float, slope: float) -> Iterator[str]:
    for limit, side, push in ((unknown.lower, "lower", slope), (unknown.upper, "upper", -slope)):
        near = math.isfinite(limit) and abs(value - limit) <= _AT_LIMIT * unknown.scale
        # A constant that nothing depends on stays where it is: it is not pushed there.
        if near and push > 0.0:
            yield (
                f"{unknown.name} went to its {side} limit, {with_unit(limit, unknown.unit)}: "
                "the optimum lies outside the bound; the other constants compensate."
            )


def _far(unknown: Unknown, value: float) -> Iterator[str]:
    """A constant far from the robot file, or from its prior."""
    if not unknown.first <= value <= unknown.last and unknown.path not in SENSOR:
        before, now = (with_unit(shown, unknown.unit) for shown in (unknown.start, value))
        yield (
            f"{unknown.name} went from {before} to {now}, much farther than such values differ: "
            "look at the units of the data, and whether they are of this robot."
        )
    mean, deviation = unknown.prior or (0.0, math.inf)
    off = abs(value - mean) / deviation
    if off > _UNLIKE_PRIOR:
        yield (
            f"{unknown.name} lies {off:.2g} standard deviations from its prior: what was known "
            "beforehand and the data contradict each other."
        )


def _loose(unknown: Unknown, value: float, interval: Interval) -> Iterator[str]:
    name, lower, upper = unknown.name, interval.lower, interval.upper
    ends = [with_unit(end, unknown.unit) for end in (lower, upper) if end is not None]
    if not ends and interval.reason == NO_SOLUTION:
        yield f"How far {name} may go is not known: {interval.reason}."
    elif not ends:
        yield (
            f"The data do not determine {name}: any value fits as well. Its estimate means nothing."
        )
    elif upper is None or lower is None:
        word = "at most" if lower is None else "at least"
        yield f"The data only show that {name} is {word} {ends[0]} ({interval.reason})."
    else:
        # A constant of either sign may well be 0: it is compared with where it is searched.
        either = unknown.lower < 0.0 < unknown.upper
        size = max(abs(value), 0.5 * unknown.scale * either)
        if 0.5 * (upper - lower) > _LOOSE * size:
            yield f"The data hardly determine {name}: {' to '.join(ends)}."


def _alike(calibration: Calibration) -> Iterator[str]:
    correlation, names = calibration.correlation, calibration.names
    for i, j in zip(*np.tril_indices(len(names), -1), strict=True):
        value = correlation[i, j]
        if abs(value) > _ALIKE:
            way = "lower" if value < 0.0 else "higher"
            yield (
                f"{names[j]} and {names[i]} are strongly correlated (correlation "
                f"{value:.3f}): a higher {names[j]} with a {way} {names[i]} fits nearly as "
                "well. Measure one of them otherwise, or give a prior."
            )


def _noise(calibration: Calibration) -> Iterator[str]:
    if calibration.misses:
        yield (
            f"The model misses the data by {calibration.widened:.2g} times what they scatter by: "
            "something is not in the model. Intervals are wider by that factor."
        )
    if not calibration.is_likelihood:
        kind = type(calibration.problem.objective).__name__
        yield f"{kind} is not a likelihood: it gives no intervals. LeastSquares does."
    elif calibration.tells_no_noise:
        yield (
            "Fewer numbers were measured than it takes to find the constants, what deviates from "
            "the drawing, and the noise of the measurement: the fit passes through any such data, "
            "so its accuracy is unknown. Measure more, or give standard deviations."
        )
        return
    elif not calibration.noise.is_known:
        sources = calibration.noise.source.items()
        names = sorted({name for (_, name), source in sources if source == "fit"})
        yield (
            f"The noise of {' and '.join(names)} is unknown (no repeats, no standard "
            "deviations); it is estimated from the residuals, as if the model were right."
        )
    by_pulls = calibration.by_pulls
    names = [name for name, wide in zip(calibration.names, by_pulls.counts, strict=True) if wide]
    if names and calibration.is_likelihood:
        yield (
            f"By whole pulls, whose rows may err together: the interval of {' and '.join(names)}. "
            f"There are {int(by_pulls.pulls.max())}; more pulls narrow it more than more rows."
        )


@dataclass(frozen=True)
class PartError:
    """The error of one measured part of one robot.

    Attributes:
        robot: Label of the robot.
        quantity: The quantity, by the names of `Measurements.observed`.
        part: Notch or tendon, from 1; 0 for a quantity of one part.
        title: Title of the part.
        unit: Unit of the numbers below.
        error: Root-mean-square difference of model and measurement; of points and of the tip's
            orientation that of the distance or angle between the two.
        repeats: Standard deviation between repeats, NaN if nothing was repeated.
        count: Number of measured numbers.
    """

    robot: str
    quantity: str
    part: int
    title: str
    unit: str
    error: float
    repeats: float
    count: int


def edge(quantity: str) -> tuple[str, str, float]:
    """Return title and unit of a measured quantity, and the factor from inner units to this.

    Example:
        >>> edge("tip_position")
        ('tip position', 'mm', 1.0)
    """
    measured = MEASURED[quantity]
    return measured.title, measured.unit, measured.scale


def part_title(quantity: str, part: int) -> str:
    """Return the title of a part (from 1; 0 if there is only one) of a quantity.

    Example:
        >>> part_title("notch_angle", 2), part_title("total_angle", 0)
        ('notch 2', 'total bending angle')
    """
    if quantity in NOTCH_ANGLES:
        return f"notch {part}{', edges' * (quantity == 'edge_angle')}"
    title = MEASURED[quantity].title
    return f"{title}, tendon {part}" if part else title


def errors_of_parts(found: Calibration) -> tuple[PartError, ...]:
    """Return errors of every notch, the total angle, the tip and whatever else was measured.

    Args:
        found: The fit.

    Returns:
        Robot by robot, in the order of `Measurements.observed`.
    """
    return tuple(
        error
        for robot, label in enumerate(found.given)
        for quantity in MEASURED
        for error in _errors(found, robot, label, quantity)
    )


def _errors(fit: Calibration, robot: int, label: str, quantity: str) -> Iterator[PartError]:
    residuals, measured = fit.residuals, MEASURED[quantity]
    mine = np.flatnonzero((residuals.robot == robot) & residuals.are(quantity))
    if not len(mine):
        return
    between = _between_repeats(fit, label, quantity) * measured.scale
    counted = measured.per in (("notch",), ("tendon",))
    parts = residuals.part[mine] + 1 if counted else np.zeros(len(mine), int)
    # Three components are one point, or one rotation of a row.
    single = residuals.row if quantity == "tip_rotation" else residuals.point
    for part in np.unique(parts).tolist():
        rows = mine[parts == part]
        count = len(set(zip(residuals.sample[rows], single[rows], strict=True)))
        squares = np.sum((residuals.values[rows] * measured.scale) ** 2)
        yield PartError(
            label,
            quantity,
            part,
            part_title(quantity, part),
            measured.unit,
            float(np.sqrt(squares / count)),
            float(between[max(part - 1, 0)]),
            count,
        )


def _between_repeats(fit: Calibration, label: str, quantity: str) -> Numbers:
    """Standard deviation between repeats of every part, pooled over the files of a robot."""
    variances: list[Numbers] = []
    rows: list[int] = []
    for measured in fit.problem.samples.of_robot(label):
        if quantity in measured.observed:
            each = repeats_of_each(measured)[quantity]
            if MEASURED[quantity].is_vector:
                each = np.sqrt(np.mean(np.sum(each**2, axis=-1)))
            variances.append(np.atleast_1d(each) ** 2)
            rows.append(len(measured) * bool(np.isfinite(each).all()))
    if not any(rows):
        return np.full_like(variances[0], np.nan)
    return np.sqrt(np.average(np.nan_to_num(variances), axis=0, weights=rows))
