"""Diagnosis of a fit in sentences: what the data determine and what they do not."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import NO_SOLUTION, Interval
from notchflex.fit.model.residuals import SENSOR, branch_words

# A half-width of more than this part of the value is loose; constants more correlated than that
# cannot be distinguished.
_LOOSE, _ALIKE = 0.5, 0.95
# So many standard deviations from its prior a constant contradicts it.
_UNLIKE_PRIOR = 3.0
# Probability below which a constant that is not fitted is named.
_HELPS = 0.05
# Distance from a limit that counts as at it, as a part of the scale of a constant.
_AT_LIMIT = 1e-6

NO_PROBLEMS = "No problems found."
"""Sentence that is printed if `diagnose` finds nothing."""


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
    yield from _branches(calibration)
    yield from _limits(calibration)
    yield from _far(calibration)
    if not calibration.tells_no_noise:
        for name, interval in calibration.intervals.items():
            yield from _loose(calibration, name, interval)
    yield from _alike(calibration)
    yield from _noise(calibration)
    if calibration.is_likelihood and not calibration.tells_no_noise:
        yield from _correlated_rows(calibration)


_PATTERNS = {
    "runs": "residuals of neighbouring loads are alike",
    "notches": "residuals have a trend over the notches",
    "missing": "a constant that is not fitted explains part of them",
}


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
    best = next(iter(tests.missing), None)
    if best is not None and best.chance < _HELPS:
        yield (
            f"Try adding {best.name} to the fit: the misfit would fall by about "
            f"{100.0 * best.share:.0f} %."
        )


def _branches(calibration: Calibration) -> Iterator[str]:
    """Tables whose unloading rows deviate from the model by another amount than loading rows."""
    residuals = calibration.residuals
    for number, sample in enumerate(calibration.problem.samples.every):
        rows = len(sample.measured)
        for name in ("total_angle", "notch_angle"):
            mine = residuals.of(number, name)
            if mine.any():
                count = np.bincount(residuals.row[mine], minlength=rows)
                total = np.bincount(residuals.row[mine], residuals.values[mine], rows)
                off = np.where(count > 0, -total / np.maximum(count, 1), np.nan)
                yield from branch_words(off, name, sample.measured)
                break


def _limits(calibration: Calibration) -> Iterator[str]:
    numbers = zip(
        calibration.problem.unknowns,
        calibration.best.values,
        calibration.reached.gradient,
        strict=True,
    )
    for unknown, value, slope in numbers:
        for limit, side, push in (
            (unknown.lower, "lower", slope),
            (unknown.upper, "upper", -slope),
        ):
            near = math.isfinite(limit) and abs(value - limit) <= _AT_LIMIT * unknown.scale
            # A constant that nothing depends on stays where it is: it is not pushed there.
            if near and push > 0.0:
                yield (
                    f"{unknown.name} went to its {side} limit, {with_unit(limit, unknown.unit)}: "
                    "the optimum lies outside the bound; the other constants compensate."
                )


def _far(calibration: Calibration) -> Iterator[str]:
    """Constants far from the robot file, or from their prior."""
    for unknown, value in zip(
        calibration.problem.unknowns, calibration.best.values.tolist(), strict=True
    ):
        within = unknown.first <= value <= unknown.last
        if not within and unknown.path not in SENSOR:
            was, now = (with_unit(one, unknown.unit) for one in (unknown.start, value))
            yield (
                f"{unknown.name} went from {was} to {now}, much farther than such values differ: "
                "look at the units of the data, and whether they are of this robot."
            )
        if unknown.prior is not None:
            mean, deviation = unknown.prior
            off = abs(value - mean) / deviation
            if off > _UNLIKE_PRIOR:
                yield (
                    f"{unknown.name} lies {off:.2g} standard deviations from its prior: what was "
                    "known beforehand and the data contradict each other."
                )


def _loose(calibration: Calibration, name: str, interval: Interval) -> Iterator[str]:
    value, unit = calibration.values[name], calibration.units[name]
    lower, upper = interval.lower, interval.upper
    if lower is None and upper is None and interval.reason == NO_SOLUTION:
        yield f"How far {name} may go is not known: {interval.reason}."
    elif lower is None and upper is None:
        yield (
            f"The data do not determine {name}: any value fits as well. Its estimate means nothing."
        )
    elif upper is None or lower is None:
        word, end = ("at most", upper) if lower is None else ("at least", lower)
        assert end is not None
        limit = f"{word} {with_unit(end, unit)}"
        yield f"The data only show that {name} is {limit} ({interval.reason})."
    else:
        unknown = calibration.problem.unknowns[calibration.names.index(name)]
        # A constant of either sign may well be 0: it is compared with where it is searched.
        either = unknown.lower < 0.0 < unknown.upper
        size = max(abs(value), 0.5 * unknown.scale if either else 0.0)
        if 0.5 * (upper - lower) > _LOOSE * size:
            ends = f"{with_unit(lower, unit)} to {with_unit(upper, unit)}"
            yield f"The data hardly determine {name}: {ends}."


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
            "No more numbers were measured than constants fitted, and their noise is unknown: "
            "the fit passes through any such data, so its accuracy is unknown. "
            "Measure more, or give standard deviations."
        )
    elif not calibration.noise.is_known:
        sources = calibration.noise.source.items()
        names = sorted({name for (_, name), source in sources if source == "fit"})
        yield (
            f"The noise of {' and '.join(names)} is unknown (no repeats, no standard "
            "deviations); it is estimated from the residuals, as if the model were right."
        )


def _correlated_rows(calibration: Calibration) -> Iterator[str]:
    by_pulls = calibration.by_pulls
    wide = [name for name, counts in zip(calibration.names, by_pulls.counts, strict=True) if counts]
    if wide:
        yield (
            f"By whole pulls, whose rows may err together: the interval of {' and '.join(wide)}. "
            f"There are {int(by_pulls.pulls.max())}; more pulls narrow it more than more rows."
        )
