"""Fitting constants to measurements, with intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from notchflex import InputError, Robot, Settings
from notchflex.fit.calibration import Calibration, Interval, reached
from notchflex.fit.constants import Constant, deviations_of, unknowns
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.objective import FitObjective, LeastSquares, noise_left
from notchflex.fit.residuals import Samples
from notchflex.fit.search import FitProblem, Minimum, Progress, search
from notchflex.pieces import PieceFolder
from notchflex.support import AnyPath, short_repr

# How often noise and constants are estimated from each other.
_ROUNDS = 10

Measured = Measurements | Sequence[Measurements]


def calibrate(
    robots: Robot | Mapping[str, Robot],
    measurements: Measured | Mapping[str, Measured],
    fit: str | Sequence[str | Constant],
    *,
    objective: FitObjective | None = None,
    priors: bool = True,
    starts: int = 4,
    seed: int = 0,
    intervals: bool = True,
    settings: Settings | None = None,
    progress: Progress | None = None,
    folder: PieceFolder | AnyPath | None = None,
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
        priors: Whether what is not fitted may deviate from the robot files within their
            tolerances, or those that `uncertain` assumes (of `LeastSquares` only, and not if
            robots have constants of their own, `each:`).
        starts: Number of starting points; the first is the robots as they are. The misfit has
            kinks where notches close and laws of materials begin, and so shallow minima.
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
    if priors and problem.objective.is_likelihood and not any(c.each for c in problem.unknowns):
        problem.drawing = deviations_of(named, problem.unknowns)
    return fitted(named, problem, starts, seed, intervals, progress, folder)


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
    named = dict(robots) if isinstance(robots, Mapping) else {getattr(robots, "name", ""): robots}
    if not all(isinstance(robot, Robot) for robot in named.values()):  # pyright: ignore
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
        measurements = dict.fromkeys(robots, measurements)
    if not robots or set(robots) != set(measurements):
        raise InputError.CONFLICT(
            f"robots are {', '.join(robots) or 'none'}, but measurements are of "
            f"{', '.join(measurements) or 'none'}; give both by the same labels"
        )
    data: dict[str, tuple[Measurements, ...]] = {}
    for label in robots:
        of_robot = measurements[label]
        tables = tuple(of_robot) if isinstance(of_robot, Iterable) else (of_robot,)
        if not tables or not all(isinstance(table, Measurements) for table in tables):  # pyright: ignore
            raise InputError.NO_DATA(
                f"{label} needs one Measurements or more; got {short_repr(of_robot)}"
            )
        for number, table in enumerate(tables):
            if table in tables[:number]:
                raise InputError.CONFLICT(
                    f"{table.source} of {label} holds the same rows as "
                    f"{tables[tables.index(table)].source}; give them once, or they count twice"
                )
        data[label] = tables
    return data


def fitted(
    robots: Mapping[str, Robot],
    problem: FitProblem,
    starts: int,
    seed: int,
    intervals: bool,
    progress: Progress | None = None,
    folder: PieceFolder | AnyPath | None = None,
) -> Calibration:
    """Fit a problem, its noise if unknown, and intervals; arguments as for `calibrate`.

    Raises:
        InputError: The model has no solution at any start.
    """
    kept = None if folder is None else PieceFolder.of(folder)
    searches = search(problem, starts, seed, progress, kept)
    costs = [np.inf if minimum.cost is None else minimum.cost.value for minimum in searches]
    if np.isinf(costs).all():
        raise _no_start(problem.samples)
    problem, best = _with_noise(problem, searches[int(np.argmin(costs))])
    calibration = Calibration(robots, problem, best, searches, {})
    if not intervals or not calibration.is_likelihood:
        return calibration
    for number, unknown in enumerate(problem.unknowns, start=1):
        name = unknown.name
        if calibration.tells_no_noise:
            point = np.array([[calibration.values[name], 0.0]])
            interval = Interval(None, None, point, "the noise is unknown")
        else:
            rise = calibration.allowed_rise(name)
            interval = calibration.profile(name).interval(rise=rise, scale=unknown.scale)
        calibration.intervals[name] = interval
        if progress is not None:
            progress("intervals", number, len(problem.unknowns))
    return calibration


def _no_start(samples: Samples) -> InputError:
    if samples.refused:
        return InputError.NOT_CONVERGED(
            f"no robot can be as the search would start: {samples.refused.rstrip('.')}. Give other "
            "limits to search between"
        )
    where = [f"{source}, row {row + 1}" for source, row in samples.failed]
    at = f": no solution at {where[0]} ({len(where)} rows)" if where else ""
    return InputError.NOT_CONVERGED(
        f"the model has no solution at any start{at}. Check units and loads of the file, "
        "or give other limits to search between"
    )


def _with_noise(problem: FitProblem, best: Minimum) -> tuple[FitProblem, Minimum]:
    """Fit what deviates from the drawing too, and again with the noise that each fit leaves."""
    robust = getattr(problem.objective, "huber", None) is not None
    if problem.drawing:
        problem = problem.with_drawing(best.values)
        best = problem.minimum(np.append(best.values, np.zeros(len(problem.drawing))))
    for _ in range(_ROUNDS):
        noise = problem.noise
        if noise is None or noise.is_known:
            break
        residuals = reached(best).residuals
        problem.noise = noise_left(noise, residuals, problem.fitted(residuals), robust=robust)
        again = problem.minimum(best.values)
        if again.cost is None:
            break
        best = again
        if np.allclose(problem.noise.deviation, noise.deviation, rtol=1e-3, atol=0.0):
            break
    return problem, best
