"""Fitting constants to measurements, with intervals."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import Interval
from notchflex.fit.estimation.minimise import Cost, Minimum
from notchflex.fit.estimation.noise import noise_left
from notchflex.fit.estimation.objective import FitObjective, LeastSquares
from notchflex.fit.estimation.problem import FitProblem, Progress, search
from notchflex.fit.estimation.searches_in_pieces import search_in_pieces
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.model.constant import Constant
from notchflex.fit.model.constants import unknowns
from notchflex.fit.model.samples import Samples
from notchflex.pieces.options import PieceFolder
from notchflex.robot import Robot
from notchflex.solver.newton import Settings

# How often noise and constants are estimated from each other.
_ROUNDS = 6

Measured = Measurements | Sequence[Measurements]


def calibrate(
    robots: Robot | Mapping[str, Robot],
    measurements: Measured | Mapping[str, Measured],
    fit: str | Sequence[str | Constant],
    *,
    objective: FitObjective | None = None,
    starts: int = 4,
    seed: int = 0,
    intervals: bool = True,
    settings: Settings | None = None,
    progress: Progress | None = None,
    folder: PieceFolder | str | os.PathLike[str] | None = None,
) -> Calibration:
    """Fit constants of robots to measurements.

    The search uses derivatives through the solver (implicit function theorem). It starts from the
    robots as they are and from a spread of other values (Sobol's sequence).

    Args:
        robots: The robot, or robots by label.
        measurements: Measurements of the robot; of several robots by the same labels.
        fit: The constants, by name (see `Constant`), in the units of the robot file.
        objective: `LeastSquares()` by default, `SumOfRobotErrors()` (Pacheco 2021, eq. 17) or
            `SumOfDistances()` (Gao 2017, eq. 27).
        starts: Number of starting points; the first is the robots as they are. With two or more,
            every search looks again from points near its end.
        seed: Seed of the starting points.
        intervals: Whether to find 95 % intervals too (profile likelihood; of `LeastSquares` only).
        settings: Settings of the solver.
        progress: Called with the name of the task, how much of it is done, and how much there is.
        folder: Search from every start as a piece that this folder keeps: by many processes
            (`PieceFolder`), resumed by the same call. The result is the same.

    Returns:
        The fitted robots, and how far to trust their constants.

    Raises:
        InputError: Robots, measurements or constants do not belong together, or the model has no
            solution at any start.

    Example:
        >>> from notchflex import load_robot, pull
        >>> from notchflex.fit import simulate_measurements
        >>> wrist = load_robot("pacheco2021-a")
        >>> seen = simulate_measurements(
        ...     wrist, pull(0.2, 1.4, steps=7), deviation={"notch_angle": 0.01}, seed=1
        ... )
        >>> found = calibrate(wrist, seen, "friction.coefficient", starts=1)
        >>> interval = found.intervals["friction.coefficient"]
        >>> interval.lower < 0.13 < interval.upper
        True
    """
    check_search(starts, seed)
    named = by_label(robots)
    data = _of_robots(named, measurements)
    samples = Samples.of(named, data, unknowns(named, fit), settings)
    problem = FitProblem(samples, objective or LeastSquares())
    searches = None
    if folder is not None:
        searches = search_in_pieces(problem, starts, seed, PieceFolder.of(folder), progress)
    return fitted(named, problem, starts, seed, intervals, progress, searches)


def check_search(starts: object, seed: object) -> None:
    """Raise InputError unless starts and seed are whole numbers in their ranges."""
    for name, value, least in (("starts", starts, 1), ("seed", seed, 0)):
        if not isinstance(value, int) or value < least:
            raise InputError.OUT_OF_RANGE(
                f"{name} must be a whole number from {least} on; got {value!r}"
            )


def by_label(robots: Robot | Mapping[str, Robot]) -> dict[str, Robot]:
    """Return robots by label; a single one has its name for it.

    Raises:
        InputError: They are no robots.
    """
    single = not isinstance(robots, Mapping)
    named = {getattr(robots, "name", ""): robots} if single else dict(robots)
    if not all(isinstance(one, Robot) for one in named.values()):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            "calibrate needs a Robot, or robots by label; load_robot makes one"
        )
    return named


def _of_robots(
    robots: dict[str, Robot], measurements: Measured | Mapping[str, Measured]
) -> dict[str, tuple[Measurements, ...]]:
    """Measurements by label, checked."""
    if not isinstance(measurements, Mapping):
        if len(robots) != 1:
            raise InputError.WRONG_SHAPE(
                "several robots need their measurements by the same labels"
            )
        measurements = {next(iter(robots)): measurements}
    if not robots or set(robots) != set(measurements):
        raise InputError.CONFLICT(
            f"robots are {', '.join(robots) or 'none'}, but measurements are of "
            f"{', '.join(measurements) or 'none'}; give both by the same labels"
        )
    data: dict[str, tuple[Measurements, ...]] = {}
    for label in robots:
        mine = measurements[label]
        every = data[label] = (mine,) if isinstance(mine, Measurements) else tuple(mine)
        if not every or not all(isinstance(one, Measurements) for one in every):  # pyright: ignore
            raise InputError.NO_DATA(f"{label} needs one Measurements or more")
        for number, one in enumerate(every):
            if one in every[:number]:
                same = every[every.index(one)].source
                raise InputError.CONFLICT(
                    f"{one.source} of {label} holds the same rows as {same}; give them once, or "
                    "they count twice"
                )
    return data


def fitted(
    robots: Mapping[str, Robot],
    problem: FitProblem,
    starts: int,
    seed: int,
    intervals: bool,
    progress: Progress | None = None,
    searches: tuple[Minimum, ...] | None = None,
) -> Calibration:
    """Fit a problem, its noise if unknown, and intervals; arguments as for `calibrate`.

    `searches` are what the starts led to, if that is known.

    Raises:
        InputError: The model has no solution at any start.
    """
    searches = searches or search(problem, starts, seed, progress)
    costs = [np.inf if one.cost is None else one.cost.value for one in searches]
    if np.isinf(costs).all():
        raise _no_start(problem.samples)
    best, reached = _with_noise(problem, searches[int(np.argmin(costs))])
    calibration = Calibration(robots, problem, best, reached, searches, {})
    if intervals and calibration.is_likelihood:
        return replace(calibration, intervals=_intervals(calibration, progress))
    return calibration


def _no_start(samples: Samples) -> InputError:
    refused = samples.refused.rstrip(".")
    if refused:
        return InputError.NOT_CONVERGED(
            f"no robot can be as the search would start: {refused}. Give other limits to "
            "search between"
        )
    where = [f"{source}, row {row + 1}" for source, row in samples.failed]
    at = f": no solution at {where[0]} ({len(where)} rows)" if where else ""
    return InputError.NOT_CONVERGED(
        f"the model has no solution at any start{at}. Check units and loads of the file, "
        "or give other limits to search between"
    )


def _with_noise(problem: FitProblem, best: Minimum) -> tuple[Minimum, Cost]:
    """Estimate unknown noise from the residuals, and fit again, until both agree."""
    cost, noise = best.cost, problem.noise
    assert cost is not None
    for _ in range(_ROUNDS):
        if noise is None or noise.is_known:
            break
        left = noise_left(noise, cost.residuals, len(problem.unknowns))
        settled = np.allclose(left.deviation, noise.deviation, rtol=1e-3, atol=0.0)
        problem.noise = noise = left
        again = problem.minimum(best.values)
        if again.cost is None:
            break
        best, cost = again, again.cost
        if settled:
            break
    return best, cost


def _intervals(calibration: Calibration, progress: Progress | None) -> dict[str, Interval]:
    if calibration.tells_no_noise:
        return {
            name: Interval(None, None, np.array([[value, 0.0]]), "the noise is unknown")
            for name, value in calibration.values.items()
        }
    intervals: dict[str, Interval] = {}
    for number, unknown in enumerate(calibration.problem.unknowns, start=1):
        name = unknown.name
        profile = calibration.profile(name)
        intervals[name] = profile.interval(rise=calibration.allowed_rise(name), scale=unknown.scale)
        if progress is not None:
            progress("intervals", number, len(calibration.names))
    return intervals
