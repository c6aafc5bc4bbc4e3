"""Cross-validation: constants fitted without a pull, or a robot, tested on what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import norm

from notchflex.errors import InputError
from notchflex.fit.assessment.specimens import Specimen, prior_of, updated
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import check_search, fitted
from notchflex.fit.estimation.problem import FitProblem, Progress
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Samples

PHOTOGRAPH = 0.6
"""Part of the largest load at which the command line takes a photograph."""

Data = dict[str, tuple[Measurements, ...]]
"""Measurements by label of their robot."""


@dataclass(frozen=True, eq=False)
class Fold:
    """One part left out.

    Attributes:
        label: The robot, and the pull if a pull was left out.
        found: The fit to all the rest.
        errors: Root-mean-square error on what was left out by quantity (rad, mm, N).
        errors_of_all: The same of the constants fitted to everything.
        converged: Whether every row left out was solved.
        residuals: Model less measurement on what was left out; None if a row was not solved.
        deviation: Standard deviation of the prediction of each of these numbers (rad, mm, N), from
            the covariance of the constants, the scatter of the specimens and what the fit misses.
        before: Mean and standard deviation of constants of the robot left out that the others do
            not tell, by name.
        specimen: These constants updated by one photograph of the robot; None if not asked for.
        row: Row of the photograph in the robot's first measurements.
        errors_updated: Errors with these constants on the other rows.
    """

    label: str
    found: Calibration
    errors: dict[str, float]
    errors_of_all: dict[str, float]
    converged: bool
    residuals: Residuals | None = None
    deviation: np.ndarray = field(default_factory=lambda: np.zeros(0))
    before: dict[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    specimen: Specimen | None = None
    row: int = 0
    errors_updated: dict[str, float] = field(default_factory=dict[str, float])

    def share_inside(self, level: float = 0.9) -> dict[str, float]:
        """Return what share of the numbers left out lies inside the predicted interval.

        Args:
            level: Probability of the interval.
        """
        if self.residuals is None:
            return {}
        inside = np.abs(self.residuals.values) <= norm.ppf(0.5 + 0.5 * level) * self.deviation
        numbers = np.unique(self.residuals.quantity)
        of = self.residuals.quantity
        return {OBSERVED[one]: float(np.mean(inside[of == one])) for one in numbers}


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A fit to everything, and one without each part.

    Attributes:
        by: "pull" or "robot".
        whole: The fit to everything.
        folds: One per part.
    """

    by: str
    whole: Calibration
    folds: tuple[Fold, ...]


def leave_out(
    found: Calibration,
    *,
    by: Literal["pull", "robot"],
    photograph: float | None = None,
    starts: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> LeftOut:
    """Fit again without each pull, or each robot, and test the constants on it.

    A constant that each robot has of its own (`each:`) is not known of a robot left out: its prior,
    or without one the mean of the others, predicts it, and their scatter widens the prediction
    (`Fold.deviation`).

    Args:
        found: A fit to everything.
        by: "pull" or "robot".
        photograph: Also update these constants by one row of the robot left out, whose load is
            nearest to this part of its largest (such as 0.6), and try them on its other rows.
        starts: Number of starting points of each search.
        seed: Seed of the starting points.
        progress: Called with the name of the task, how much of it is done, and how much there is.

    Returns:
        The fit to everything, and errors on each part of constants fitted without it.

    Raises:
        InputError: There is only one part, a constant belongs to the one left out alone and has no
            prior, or a photograph is asked for without a constant that each robot has of its own.

    Example:
        >>> from notchflex import load_robot, pull
        >>> from notchflex.fit import calibrate, simulate_measurements
        >>> wrist = load_robot("pacheco2021-a")
        >>> noise = {"notch_angle": 0.01}
        >>> seen = [
        ...     simulate_measurements(wrist, pull(0.2, 1.4, steps=7), deviation=noise, seed=seed)
        ...     for seed in (1, 2)
        ... ]
        >>> found = calibrate(wrist, seen, "friction.coefficient", starts=1, intervals=False)
        >>> tested = leave_out(found, by="pull")
        >>> [fold.errors["notch_angle"] < 0.02 for fold in tested.folds]
        [True, True]
    """
    if by not in ("pull", "robot"):
        raise InputError.UNKNOWN_NAME(f'leave out by "pull" or by "robot"; got {by!r}')
    check_search(starts, seed)
    data = {label: tuple(found.problem.samples.of_robot(label)) for label in found.given}
    parts = list(_parts(data, by))
    if len(parts) < 2:
        raise InputError.TOO_FEW_DATA(
            f"there is only one {by}; leaving it out leaves nothing to fit to"
        )
    if photograph is not None:
        _check_photograph(found, by, photograph)
    folds: list[Fold] = []
    for number, (name, label, part, rest) in enumerate(parts, start=1):
        kept = {label: found.given[label] for label, every in rest.items() if every}
        every = [(one, one.among(kept)) for one in found.problem.unknowns]
        constants = tuple(one for _, one in every if one is not None)
        samples = Samples.of(kept, rest, constants, found.settings)
        again = fitted(
            kept, FitProblem(samples, found.problem.objective), starts, seed, intervals=False
        )
        own = [
            replace(one, prior=prior_of(one, again)) for one, remains in every if remains is None
        ]
        fold = _blind(name, again, found, label, part, own)
        if photograph is not None and own:
            fold = _with_photograph(fold, found, label, part, own, photograph)
        folds.append(fold)
        if progress is not None:
            progress("leaving out", number, len(parts))
    return LeftOut(by, found, tuple(folds))


def _check_photograph(calibration: Calibration, by: str, photograph: float) -> None:
    if not 0.0 < photograph <= 1.0:
        raise InputError.OUT_OF_RANGE(
            f"a photograph is at a part of the largest load, above 0 and up to 1; got {photograph}"
        )
    if by != "robot" or not any(one.each for one in calibration.problem.unknowns):
        raise InputError.CONFLICT(
            "one photograph updates constants that each robot has of its own, of a robot that was "
            'left out: leave out by "robot", and fit one, such as each:sensor.force_factor with a '
            "prior of 1 +- 0.05"
        )


def _parts(data: Data, by: str) -> Iterator[tuple[str, str, Sequence[Measurements], Data]]:
    """Yield name, robot and measurements of every part, and all the other measurements."""
    for label, every in data.items():
        if by == "robot":
            yield label, label, every, data | {label: ()}
            continue
        for number, measured in enumerate(every):
            source = f", {measured.source}" if len(every) > 1 else ""
            for pull in measured.pulls:
                others = [one for one in measured.pulls if one != pull]
                rest = (measured.of_pulls(others),) if others else ()
                kept = every[:number] + rest + every[number + 1 :]
                part = [measured.of_pulls([pull])]
                yield f"{label}{source}, pull {pull}", label, part, data | {label: kept}


def _blind(
    name: str,
    fit: Calibration,
    whole: Calibration,
    label: str,
    part: Sequence[Measurements],
    own: Sequence[Unknown],
) -> Fold:
    """Predict a part from a fit to the rest; constants of its robot alone by what is known."""
    before = {one.name: one.prior for one in own if one.prior is not None}
    constants = [*fit.problem.unknowns, *own]
    values = np.append(fit.best.values, [mean for mean, _ in before.values()])
    residuals = _residuals(whole, label, part, constants, values)
    of_all = _residuals(whole, label, part, whole.problem.unknowns, whole.best.values)
    errors, errors_of_all = (
        {} if one is None else one.root_mean_squares() for one in (residuals, of_all)
    )
    deviation = np.zeros(0)
    if residuals is not None:
        missed = fit.residuals.root_mean_squares()
        noise = [missed.get(OBSERVED[one], np.nan) for one in residuals.quantity]
        sizes = [size**2 for _, size in before.values()]
        covariance = np.asarray(block_diag(fit.covariance, np.diag(sizes)))
        depends = np.flatnonzero(residuals.slopes.any(axis=0))
        slopes, covariance = residuals.slopes[:, depends], covariance[np.ix_(depends, depends)]
        spread = np.sum(slopes @ covariance * slopes, axis=1)
        deviation = np.sqrt(np.maximum(spread, 0.0) + np.square(noise))
    return Fold(
        name, fit, errors, errors_of_all, residuals is not None, residuals, deviation, before
    )


def _with_photograph(
    fold: Fold,
    whole: Calibration,
    label: str,
    part: Sequence[Measurements],
    own: Sequence[Unknown],
    share: float,
) -> Fold:
    """Update constants of the robot left out by one row, and try them on the others."""
    first, robot = part[0], whole.given[label]
    command = np.nansum(np.fmax(first.measured_tension, first.load.stroke), axis=1)
    row = int(np.argmin(np.abs(command - share * command.max())))
    specimen = updated(fold.found, label, robot, first.taken([row]), own)
    others = [first.taken(np.arange(len(first)) != row), *part[1:]]
    constants = [*fold.found.problem.unknowns, *own]
    values = np.append(fold.found.best.values, specimen.found.best.values)
    residuals = _residuals(whole, label, others, constants, values)
    errors = {} if residuals is None else residuals.root_mean_squares()
    return replace(fold, specimen=specimen, row=row, errors_updated=errors)


def _residuals(
    whole: Calibration,
    label: str,
    part: Sequence[Measurements],
    constants: Sequence[Unknown],
    values: np.ndarray,
) -> Residuals | None:
    """Residuals of a part at values of constants; None if one of its rows has no solution."""
    robot = whole.given[label]
    mine = tuple(one.of(label, robot) for one in constants)
    return Samples.of({label: robot}, {label: part}, mine, whole.settings).residuals(values)
