"""Cross-validation: constants fitted without a pull, or a robot, tested on what was left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.fit import check_search, fitted
from notchflex.fit.estimation.problem import Problem, Progress
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.model.samples import Samples

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
    """Fit again without each pull, or each robot, and test the constants on it.

    Args:
        found: A fit to everything.
        by: "pull" or "robot".
        starts: Number of starting points of each search.
        seed: Seed of the starting points.
        progress: Called with the name of the task, how much of it is done, and how much there is.

    Returns:
        The fit to everything, and errors on each part of constants fitted without it.

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
    if by not in ("pull", "robot"):
        raise InputError.UNKNOWN_NAME(f'leave out by "pull" or by "robot"; got {by!r}')
    check_search(starts, seed)
    data = {label: tuple(found.problem.samples.of_robot(label)) for label in found.given}
    parts = list(_parts(data, by))
    if len(parts) < 2:
        raise InputError.TOO_FEW_DATA(
            f"there is only one {by}; leaving it out leaves nothing to fit to"
        )
    settings = found.problem.samples.every[0].settings
    folds: list[Fold] = []
    for number, (name, label, part, rest) in enumerate(parts, start=1):
        kept = {label: found.given[label] for label, every in rest.items() if every}
        constants = tuple(one.among(kept) for one in found.problem.unknowns)
        problem = Problem(Samples.of(kept, rest, constants, settings), found.problem.objective)
        again = fitted(kept, problem, starts, seed, intervals=False)
        errors, of_all = _errors(again, found, label, part), _errors(found, found, label, part)
        folds.append(Fold(name, again, errors or {}, of_all or {}, errors is not None))
        if progress is not None:
            progress("leaving out", number, len(parts))
    return LeftOut(by, found, tuple(folds))


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


def _errors(
    fit: Calibration, whole: Calibration, label: str, part: Sequence[Measurements]
) -> dict[str, float] | None:
    """Errors of fitted constants on a part; None if one of its rows has no solution."""
    constants = tuple(one.shared_with(label) for one in fit.problem.unknowns)
    settings = whole.problem.samples.every[0].settings
    samples = Samples.of({label: whole.given[label]}, {label: part}, constants, settings)
    residuals = samples.residuals(fit.best.values)
    return None if residuals is None else residuals.root_mean_squares()
