"""Honest testing: constants fitted without a pull, or a robot, tried on what was left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import fitted
from notchflex.fit.estimation.problem import Problem, Progress
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Samples
from notchflex.robot import Robot


@dataclass(frozen=True, eq=False)
class Fold:
    """One thing left out.

    Attributes:
        label: The robot, and the pull where a pull was left out.
        found: The fit to all the rest.
        errors: Root-mean-square error on what was left out by quantity (rad, mm, N).
        errors_of_all: The same of constants that were fitted to everything.
        converged: Whether every row left out was solved.
    """

    label: str
    found: Calibration
    errors: dict[str, float]
    errors_of_all: dict[str, float]
    converged: bool


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
    starts: int = 1,
    seed: int = 0,
    progress: Progress | None = None,
) -> LeftOut:
    """Fit again without each pull, or each robot, and try the constants on it.

    Args:
        found: A fit to everything.
        by: "pull" or "robot".
        starts: From how many places to search each time.
        seed: Of the places.
        progress: Called with what is done, how much of it, and how much there is.

    Returns:
        The fit to everything, and what each part makes of constants fitted without it.

    Raises:
        InputError: There is only one part, or a constant belongs to the one left out alone.

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
    every = found.problem.samples.every
    data = {
        label: tuple(one.measured for one in every if one.label == label) for label in found.given
    }
    if starts < 1 or seed < 0:
        raise InputError.OUT_OF_RANGE(
            f"starts must be 1 or more, seed 0 or more; got {starts} and {seed}"
        )
    parts = _parts(data, by)
    if len(parts) < 2:
        raise InputError.TOO_FEW_DATA(
            f"there is only one {by}; leaving it out leaves nothing to fit to"
        )
    settings = every[0].rows.settings
    folds: list[Fold] = []
    for number, part in enumerate(parts):
        rest = {label: _without(data[label], label, part) for label in found.given}
        kept = {label: robot for label, robot in found.given.items() if rest[label]}
        constants = tuple(one.among(kept) for one in found.problem.unknowns)
        samples = Samples.of(kept, {label: rest[label] for label in kept}, constants, settings)
        problem = Problem(samples, found.problem.objective)
        again = fitted(kept, problem, starts, seed, intervals=False)
        own = (found.given[part.robot], data[part.robot], part)
        errors, of_all = _errors(*own, again), _errors(*own, found)
        folds.append(
            Fold(part.told(data[part.robot]), again, errors or {}, of_all or {}, errors is not None)
        )
        if progress is not None:
            progress("leaving out", number + 1, len(parts))
    return LeftOut(by, found, tuple(folds))


def root_mean_squares(residuals: Residuals) -> dict[str, float]:
    """Root-mean-square residuals by quantity (rad, mm, N)."""
    return {
        OBSERVED[quantity]: float(
            np.sqrt(np.mean(residuals.values[residuals.quantity == quantity] ** 2))
        )
        for quantity in np.unique(residuals.quantity)
    }


class _Part(NamedTuple):
    """A robot, or one of its pulls: the number of its measurement and the pull's label."""

    robot: str
    measurement: int = -1
    pull: str = ""

    def is_in(self, label: str, number: int) -> bool:
        """Whether it is, or lies in, a measurement of a robot."""
        return label == self.robot and self.measurement in (-1, number)

    def told(self, every: Sequence[Measurements]) -> str:
        """What it is called."""
        if self.measurement < 0:
            return self.robot
        source = f", {every[self.measurement].source}" if len(every) > 1 else ""
        return f"{self.robot}{source}, pull {self.pull}"


def _parts(data: Mapping[str, Sequence[Measurements]], by: str) -> list[_Part]:
    if by == "robot":
        return [_Part(label) for label in data]
    if by != "pull":
        raise InputError.UNKNOWN_NAME(f'leave out by "pull" or by "robot"; got {by!r}')
    return [
        _Part(label, number, pull)
        for label, every in data.items()
        for number, measured in enumerate(every)
        for pull in measured.pulls
    ]


def _without(every: Sequence[Measurements], label: str, part: _Part) -> tuple[Measurements, ...]:
    kept: list[Measurements] = []
    for number, measured in enumerate(every):
        if not part.is_in(label, number):
            kept.append(measured)
        elif part.pull and len(measured.pulls) > 1:
            kept.append(measured.of_pulls([pull for pull in measured.pulls if pull != part.pull]))
    return tuple(kept)


def _errors(
    robot: Robot, every: Sequence[Measurements], part: _Part, found: Calibration
) -> dict[str, float] | None:
    """Errors on the part left out; None where a row of it has no solution."""
    label = part.robot
    if part.pull:
        every = [every[part.measurement].of_pulls([part.pull])]
    constants = tuple(one.shared_with(label) for one in found.problem.unknowns)
    settings = found.problem.samples.every[0].rows.settings
    samples = Samples.of({label: robot}, {label: every}, constants, settings)
    residuals = samples.residuals(found.best.values)
    return None if residuals is None else root_mean_squares(residuals)


__all__ = ["Fold", "LeftOut", "leave_out", "root_mean_squares"]
