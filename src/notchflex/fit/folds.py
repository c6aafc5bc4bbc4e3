"""Constants tested on what was left out, and of one more specimen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import norm

from notchflex import InputError, Robot
from notchflex.fit.calibrate import by_label, check_search, fitted
from notchflex.fit.calibration import Calibration
from notchflex.fit.constants import Constant, RobotNumber, Unknown, unknowns
from notchflex.fit.measurements.measurements import OBSERVED, Measurements, Numbers
from notchflex.fit.objective import LeastSquares
from notchflex.fit.residuals import Residuals, Samples, deviated
from notchflex.fit.search import FitProblem, Progress


@dataclass(frozen=True, eq=False)
class Specimen:
    """A robot of a fitted kind whose own constants follow from few rows measured of it.

    Attributes:
        found: The fit of its own constants to these rows and to what was known before.
        before: Mean and standard deviation of each constant as known before.
        gain: Width of its total angle at these rows after over before; 1 gains nothing.
    """

    found: Calibration
    before: dict[str, tuple[float, float]]
    gain: float

    @property
    def values(self) -> dict[str, float]:
        """Its own constants."""
        return self.found.values

    @property
    def robot(self) -> Robot:
        """The robot with the constants of all and its own; without those of the sensor."""
        return next(iter(self.found.robots.values()))


def update_specimen(
    found: Calibration,
    robot: Robot,
    measured: Measurements,
    constants: str | Sequence[str | Constant] = "sensor.force_factor",
) -> Specimen:
    """Find the constants of one more specimen from few rows, such as one photograph.

    The constants that all robots of `found` share stay as fitted. Of its own constants the prior
    is known (that of `found`, or of a `Constant` given here), and how the other specimens scatter
    about it; the noise is what `found` misses of its measurements.

    Args:
        found: A fit of other robots of the kind, some of whose constants are `each:` robot's.
        robot: The robot as drawn.
        measured: What was measured of it, one row or more.
        constants: Its own constants, by name without a label.

    Returns:
        Its constants, with their intervals after the update.

    Raises:
        InputError: Nothing is known of a constant before, or the model has no solution.

    Example:
        >>> from notchflex import load_robot, pull
        >>> from notchflex.fit import Constant, calibrate, simulate_measurements
        >>> wrist, noise = load_robot("pacheco2021-a"), {"notch_angle": 0.01}
        >>> seen = simulate_measurements(wrist, pull(0.2, 1.4, steps=7), deviation=noise)
        >>> found = calibrate(wrist, seen, "friction.coefficient", starts=1, intervals=False)
        >>> own = Constant("sensor.force_factor", prior=(1.0, 0.05))
        >>> photograph = simulate_measurements(wrist, pull(1.2, 1.2, steps=1), deviation=noise)
        >>> update_specimen(found, wrist, photograph, own).gain < 0.5
        True
    """
    ((label, robot),) = by_label(robot).items()
    if not isinstance(measured, Measurements):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            "a photograph is Measurements of one row or more; `measurements.taken([row])` takes one"
        )
    priors = {unknown.path: unknown.prior for unknown in reversed(found.problem.unknowns)}
    own = [
        replace(
            constant,
            prior=prior_of(
                replace(constant, prior=constant.prior or priors.get(constant.path)), found
            ),
        )
        for constant in unknowns({label: robot}, constants)
    ]
    return updated(found, label, robot, measured, own)


def updated(
    calibration: Calibration,
    label: str,
    robot: Robot,
    measured: Measurements,
    own: Sequence[Unknown],
) -> Specimen:
    """Fit constants of a specimen, which have priors, to rows; the shared ones stay as found."""
    # A shared constant sets numbers that those of the specimen leave as they are.
    held = [
        RobotNumber(label, number.path, number.base + number.slope * value, 0.0)
        for unknown, value in zip(
            calibration.problem.unknowns, calibration.estimate.tolist(), strict=True
        )
        if unknown.shared
        for number in unknown.of(label, robot).sets
    ]
    twice = {number.path for number in held} & {
        number.path for unknown in own for number in unknown.sets
    }
    if not own or twice:
        raise InputError.CONFLICT(
            f"{min(twice, default='no constant')} is of one specimen, and all the others have it "
            "in common; name constants such as sensor.force_factor"
        )
    constants = (replace(own[0], sets=(*own[0].sets, *held)), *own[1:])
    sizes = calibration.residuals.root_mean_squares()
    missed = {
        name: np.full(values.shape, sizes[name])
        for name, values in measured.observed.items()
        if name in sizes
    }
    rows = replace(measured, deviation={**measured.deviation, **missed})
    samples = Samples.of({label: robot}, {label: [rows]}, constants, calibration.settings)
    again = fitted({label: robot}, FitProblem(samples, LeastSquares()), 1, 0, intervals=False)
    before = {constant.name: constant.prior for constant in own if constant.prior is not None}
    prior = np.diag([size**2 for _, size in before.values()])
    residuals = again.residuals
    angles = residuals.are(*(name for name in OBSERVED if name.endswith("angle")))
    slopes = np.zeros((len(measured), len(own)))
    np.add.at(slopes, residuals.row[angles], residuals.slopes[angles])
    after, earlier = (
        np.sqrt(np.einsum("ri,ij,rj->", slopes, one, slopes)) for one in (again.covariance, prior)
    )
    return Specimen(again, before, float(after / earlier) if earlier else 1.0)


def prior_of(unknown: Unknown, calibration: Calibration) -> tuple[float, float]:
    """Return mean and standard deviation of a constant of one more specimen.

    The prior counts as one specimen: the variance is the mean of its own and of the squared
    distances of the fitted specimens from its mean, each with the variance of its estimate. Without
    a prior mean and variance are those of the fitted specimens.

    Raises:
        InputError: There is no prior, and fewer than two fitted specimens.
    """
    of_specimens = [
        constant.path == unknown.path and constant.each for constant in calibration.problem.unknowns
    ]
    values = calibration.estimate[of_specimens]
    if unknown.prior is not None:
        mean, size = unknown.prior
        variance = np.diag(calibration.covariance)[of_specimens]
        squares = (values - mean) ** 2 + np.where(np.isfinite(variance), variance, size**2)
        return mean, float(np.sqrt(np.mean(np.append(squares, size**2))))
    if len(values) < 2:
        raise InputError.MISSING_VALUE(
            f"nothing is known of `{unknown.name}` before it is measured; give a prior, or fit "
            f"`each:{unknown.path}` to two robots or more"
        )
    return float(np.mean(values)), float(np.std(values, ddof=1))


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
        names = self.residuals.root_mean_squares()
        return {name: float(np.mean(inside[self.residuals.are(name)])) for name in names}


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
    if photograph is not None and not 0.0 < photograph <= 1.0:
        raise InputError.OUT_OF_RANGE(
            f"a photograph is at a part of the largest load, above 0 and up to 1; got {photograph}"
        )
    has_own = by == "robot" and any(unknown.each for unknown in found.problem.unknowns)
    if photograph is not None and not has_own:
        raise InputError.CONFLICT(
            "one photograph updates constants that each robot has of its own, of a robot that was "
            'left out: leave out by "robot", and fit one, such as each:sensor.force_factor with a '
            "prior of 1 +- 0.05"
        )
    folds: list[Fold] = []
    for number, (name, label, part, rest) in enumerate(parts, start=1):
        again, own = _without(found, rest, starts, seed)
        blind = _Blind(again, own, found.given[label], label, part)
        fold = blind.fold(name, found)
        if photograph is not None and own:
            fold = blind.with_photograph(fold, photograph)
        folds.append(fold)
        if progress is not None:
            progress("leaving out", number, len(parts))
    return LeftOut(by, found, tuple(folds))


def _parts(data: Data, by: str) -> Iterator[tuple[str, str, list[Measurements], Data]]:
    """Yield name, robot and measurements of every part, and all the other measurements."""
    for label, tables in data.items():
        if by == "robot":
            yield label, label, [*tables], data | {label: ()}
            continue
        for number, measured in enumerate(tables):
            source = f", {measured.source}" if len(tables) > 1 else ""
            for pull in measured.pulls:
                others = [other for other in measured.pulls if other != pull]
                rest = (measured.of_pulls(others),) if others else ()
                kept = data | {label: tables[:number] + rest + tables[number + 1 :]}
                yield f"{label}{source}, pull {pull}", label, [measured.of_pulls([pull])], kept


def _without(
    whole: Calibration, rest: Data, starts: int, seed: int
) -> tuple[Calibration, list[Unknown]]:
    """Fit to the rest; return it, and what is known of constants that it does not tell."""
    kept = {label: whole.given[label] for label, tables in rest.items() if tables}
    lost = [constant for constant in whole.problem.unknowns if not constant.only_of(kept).sets]
    for unknown in lost:
        if unknown.prior is None and not (unknown.each and len(kept) > 1):
            raise InputError.TOO_FEW_DATA(
                f"`{unknown.name}` belongs to {unknown.sets[0].label} alone; without it there is "
                "nothing to find it from. Give a prior (--prior), or measure more robots"
            )
    constants, drawing = (
        tuple(of_rest for constant in every if (of_rest := constant.only_of(kept)).sets)
        for every in (whole.problem.unknowns, whole.problem.drawing)
    )
    samples = Samples.of(kept, rest, constants, whole.settings)
    problem = FitProblem(samples, whole.problem.objective, drawing)
    again = fitted(kept, problem, starts, seed, intervals=False)
    return again, [replace(constant, prior=prior_of(constant, again)) for constant in lost]


class _Blind(NamedTuple):
    """Measurements of a robot, and a fit that never saw them, with the constants that it lacks."""

    fit: Calibration
    own: Sequence[Unknown]
    robot: Robot
    label: str
    part: Sequence[Measurements]

    def residuals(self, part: Sequence[Measurements], own: Numbers) -> Residuals | None:
        """Residuals of a part at values of the own constants; None if a row has no solution."""
        robot = deviated(self.robot, self.label, self.fit.drawing)
        constants = [
            unknown.of(self.label, robot) for unknown in (*self.fit.problem.unknowns, *self.own)
        ]
        samples = Samples.of(
            {self.label: robot}, {self.label: part}, tuple(constants), self.fit.settings
        )
        return samples.residuals(np.append(self.fit.estimate, own))

    def fold(self, name: str, whole: Calibration) -> Fold:
        """Predict the part; constants of its robot alone by what is known of them."""
        before = {unknown.name: unknown.prior for unknown in self.own if unknown.prior is not None}
        means, sizes = np.reshape([*before.values()], (-1, 2)).T
        residuals = self.residuals(self.part, means)
        of_all = self._replace(fit=whole, own=()).residuals(self.part, np.zeros(0))
        errors, errors_of_all = (
            {} if one is None else one.root_mean_squares() for one in (residuals, of_all)
        )
        fold = Fold(name, self.fit, errors, errors_of_all, residuals is not None, before=before)
        if residuals is None:
            return fold
        missed = self.fit.residuals.root_mean_squares()
        noise = [missed.get(OBSERVED[quantity], np.nan) for quantity in residuals.quantity]
        depends = residuals.slopes.any(axis=0)
        slopes = residuals.slopes[:, depends]
        covariance = np.asarray(block_diag(self.fit.covariance, np.diag(sizes**2)))
        spread = np.sum(slopes @ covariance[np.ix_(depends, depends)] * slopes, axis=1)
        deviation = np.sqrt(np.maximum(spread, 0.0) + np.square(noise))
        return replace(fold, residuals=residuals, deviation=deviation)

    def with_photograph(self, fold: Fold, share: float) -> Fold:
        """Update constants of the robot left out by one row, and try them on the others."""
        first = self.part[0]
        row = int(np.argmin(np.abs(first.command - share * first.command.max())))
        specimen = updated(self.fit, self.label, self.robot, first.taken([row]), self.own)
        others = [first.taken(np.arange(len(first)) != row), *self.part[1:]]
        residuals = self.residuals(others, specimen.found.best.values)
        errors = {} if residuals is None else residuals.root_mean_squares()
        return replace(fold, specimen=specimen, row=row, errors_updated=errors)
