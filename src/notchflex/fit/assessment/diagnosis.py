"""What a fit can and cannot tell, in plain words."""

from __future__ import annotations

import math

import numpy as np

from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import NO_SOLUTION, Interval
from notchflex.fit.model.branch_residuals import (
    BRANCH_QUANTITIES,
    branch_difference,
    branch_words,
    off_by_row,
)
from notchflex.fit.model.rows import SENSOR

# A half-width of more than this part of the value is loose; constants more alike than that cannot
# be told apart.
_LOOSE, _ALIKE = 0.5, 0.95
# So many standard deviations from its prior a constant and what was known of it disagree.
_UNLIKE_PRIOR = 3.0
# As near to a limit as this part of where a search starts from.
_AT_LIMIT = 1e-6


NO_PROBLEMS = "No problems found."
"""What is said where `diagnose` finds nothing."""


def diagnose(found: Calibration) -> tuple[str, ...]:
    """What a user should know before trusting the constants, the gravest first.

    Args:
        found: The fit.

    Returns:
        Sentences; none where nothing speaks against any constant.
    """
    said: list[str] = []
    if not found.converged:
        said.append(f"The search did not settle: {found.reason}.")
    said += _branches(found)
    said += _limits(found)
    said += _far(found)
    for name, interval in found.intervals.items():
        said += _loose(found, name, interval)
    said += _alike(found)
    said += _noise(found)
    return tuple(said)


def with_unit(value: float, unit: str) -> str:
    """A number as text, with its unit."""
    return f"{value:.5g} {unit}".strip()


def _limits(found: Calibration) -> list[str]:
    said: list[str] = []
    numbers = zip(found.problem.unknowns, found.best.values, found.reached.gradient, strict=True)
    for unknown, value, slope in numbers:
        near = _AT_LIMIT * unknown.scale
        for limit, side, push in (
            (unknown.lower, "lower", slope),
            (unknown.upper, "upper", -slope),
        ):
            # One that nothing depends on stays where it is: it is not pushed there.
            if math.isfinite(limit) and abs(value - limit) <= near and push > 0.0:
                said.append(
                    f"{unknown.name} went to its {side} limit, {with_unit(limit, unknown.unit)}: "
                    "the data would rather have it beyond, and the other constants make up for it."
                )
    return said


def _far(found: Calibration) -> list[str]:
    """Constants far from what the robot file, or the user, said before."""
    said: list[str] = []
    for unknown, value in zip(found.problem.unknowns, found.best.values.tolist(), strict=True):
        within = unknown.first <= value <= unknown.last
        if not within and unknown.sets[0][1] not in SENSOR:
            was, now = (with_unit(one, unknown.unit) for one in (unknown.start, value))
            said.append(
                f"{unknown.name} went from {was} to {now}, much farther than such values differ: "
                "look at the units of the data, and whether they are of this robot."
            )
        if unknown.prior is not None:
            mean, deviation = unknown.prior
            off = abs(value - mean) / deviation
            if off > _UNLIKE_PRIOR:
                said.append(
                    f"{unknown.name} lies {off:.2g} standard deviations from its prior: what was "
                    "known beforehand and the data contradict each other."
                )
    return said


def _loose(found: Calibration, name: str, interval: Interval) -> list[str]:
    value, unit = found.values[name], found.units[name]
    lower, upper = interval.lower, interval.upper
    if found.tells_no_noise:
        return []
    if lower is None and upper is None and interval.reason == NO_SOLUTION:
        return [f"How far {name} may go is not known: {interval.reason}."]
    if lower is None and upper is None:
        return [f"The data cannot tell {name}: any value fits as well. Its estimate means nothing."]
    if upper is None or lower is None:
        end, word = (lower, "at least") if upper is None else (upper, "at most")
        assert end is not None
        return [
            f"The data only tell that {name} is {word} {with_unit(end, unit)} ({interval.reason})."
        ]
    half = 0.5 * (upper - lower)
    unknown = found.problem.unknowns[found.names.index(name)]
    # What may be of either sign is compared with where it is looked for; it may well be 0.
    either = unknown.lower < 0.0 < unknown.upper
    if half > _LOOSE * max(abs(value), 0.5 * unknown.scale if either else 0.0):
        return [
            f"The data hardly tell {name}: {with_unit(lower, unit)} to {with_unit(upper, unit)}."
        ]
    return []


def _alike(found: Calibration) -> list[str]:
    said: list[str] = []
    correlation, names = found.correlation, found.names
    for i in range(len(names)):
        for j in range(i):
            value = correlation[i, j]
            if np.isfinite(value) and abs(value) > _ALIKE:
                way = "lower" if value < 0.0 else "higher"
                said.append(
                    f"The data can hardly tell {names[j]} from {names[i]} (correlation "
                    f"{value:.3f}): a higher {names[j]} with a {way} {names[i]} fits nearly as "
                    "well. Measure one of them otherwise, or give a prior."
                )
    return said


def _noise(found: Calibration) -> list[str]:
    said: list[str] = []
    if found.misses:
        said.append(
            f"The model misses the data by {found.widened:.2g} times what they scatter by: "
            "something is not in the model. Intervals are wider by that factor."
        )
    if not found.problem.objective.is_likelihood:
        kind = type(found.problem.objective).__name__
        said.append(f"{kind} is no likelihood: it gives no intervals. LeastSquares does.")
    elif found.tells_no_noise:
        said.append(
            "No more numbers were measured than constants fitted, and nothing tells their noise: "
            "the fit goes through them whatever they are, and how far to trust it is not known. "
            "Measure more, or give standard deviations."
        )
    elif not found.noise.is_known:
        names = sorted(
            {name for (_, name), source in found.noise.source.items() if source == "fit"}
        )
        said.append(
            f"Nothing tells the noise of {' and '.join(names)} (no repeats, no standard "
            "deviations): what the fit leaves is taken for it, as if the model were right."
        )
    if found.problem.objective.is_likelihood:
        wider = found.by_pulls.wider
        wide = [name for name, one in zip(found.names, wider, strict=True) if one > 1.0]
        if wide and not found.tells_no_noise:
            pulls = int(found.by_pulls.pulls.max())
            said.append(
                f"Residuals within a pull are correlated: judged by whole pulls ({pulls}), "
                f"{', '.join(wide)} {'is' if len(wide) == 1 else 'are'} up to "
                f"{float(np.max(wider)):.2g} times less certain than independent rows would say. "
                f"The {'interval is' if len(wide) == 1 else 'intervals are'} by pulls. More pulls "
                "would help more than more rows."
            )
    return said


def _branches(found: Calibration) -> list[str]:
    """Tables whose unloading rows the model misses otherwise than their loading rows."""
    said: list[str] = []
    for number, sample in enumerate(found.problem.samples.every):
        measured = sample.measured
        for name in BRANCH_QUANTITIES:
            off = off_by_row(found.residuals, number, name, len(measured))
            difference = branch_difference(-off, measured.branches)
            if difference is not None:
                said.append(branch_words(difference, name, measured))
            if np.isfinite(off).any():
                break
    return said


__all__ = ["NO_PROBLEMS", "diagnose", "with_unit"]
