"""From measurements to constants, with how far to trust them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from notchflex.errors import InputError
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import Interval, profile_interval
from notchflex.fit.estimation.minimise import Cost, Minimum, minimise
from notchflex.fit.estimation.noise import noise_left
from notchflex.fit.estimation.objective import FitObjective, LeastSquares
from notchflex.fit.estimation.problem import Problem, Progress, search
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.model.constants import Constant, unknowns
from notchflex.fit.model.samples import Samples
from notchflex.robot import Robot
from notchflex.solver.newton import Settings

# How often noise and fit are told by one another.
_ROUNDS = 6


def calibrate(
    robots: Robot | Mapping[str, Robot],
    measurements: Measurements
    | Sequence[Measurements]
    | Mapping[str, Measurements | Sequence[Measurements]],
    fit: str | Sequence[str | Constant],
    *,
    objective: FitObjective | None = None,
    starts: int = 4,
    seed: int = 0,
    intervals: bool = True,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Find constants of robots so that the model meets what was measured.

    The search goes along slopes through the solver (implicit function theorem), from the robots as
    they are and from a spread of other starts (Sobol's sequence).

    Args:
        robots: The robot, or robots by label.
        measurements: What was measured of it; of several robots by the same labels.
        fit: The constants, by name (see `Constant`), in the units of the robot file.
        objective: What is made small: `LeastSquares()` where not given, `SumOfRobotErrors()`
            (Pacheco 2021, eq. 17) or `SumOfDistances()` (Gao 2017, eq. 27).
        starts: From how many places to search; the first is the robots as they are. With two or
            more, every search looks again from beside where it ended.
        seed: Of the places.
        intervals: Whether to find 95 % intervals too (profile likelihood; of `LeastSquares` only).
        settings: How hard the solver tries.
        progress: Called with what is done, how much of it, and how much there is.

    Returns:
        The fitted robots, and how far to trust their constants.

    Raises:
        InputError: Robots, measurements or constants do not belong together.

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
    if not isinstance(starts, int) or starts < 1:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.OUT_OF_RANGE(f"starts must be a whole number from 1 on; got {starts!r}")
    if not isinstance(seed, int) or seed < 0:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.OUT_OF_RANGE(f"seed must be a whole number from 0 on; got {seed!r}")
    named, data = _given(robots, measurements)
    unknown = unknowns(named, fit)
    problem = Problem(Samples.of(named, data, unknown, settings), objective or LeastSquares())
    return fitted(named, problem, starts, seed, intervals, progress)


def _given(
    robots: Robot | Mapping[str, Robot],
    measurements: Measurements
    | Sequence[Measurements]
    | Mapping[str, Measurements | Sequence[Measurements]],
) -> tuple[dict[str, Robot], dict[str, tuple[Measurements, ...]]]:
    """Robots and their measurements by label.

    Raises:
        InputError: They do not belong together.
    """
    single = not isinstance(robots, Mapping)
    named = {getattr(robots, "name", ""): robots} if single else dict(robots)
    if not all(isinstance(one, Robot) for one in named.values()):  # pyright: ignore
        raise InputError.WRONG_TYPE(
            "calibrate needs a Robot, or robots by label; load_robot makes one"
        )
    if not isinstance(measurements, Mapping):
        if len(named) != 1:
            raise InputError.WRONG_SHAPE(
                "several robots need their measurements by the same labels"
            )
        measurements = {next(iter(named)): measurements}
    if not named or set(named) != set(measurements):
        raise InputError.CONFLICT(
            f"robots are {', '.join(named) or 'none'}, but measurements are of "
            f"{', '.join(measurements) or 'none'}; give both by the same labels"
        )
    data: dict[str, tuple[Measurements, ...]] = {}
    for label in named:
        own = measurements[label]
        every = (own,) if isinstance(own, Measurements) else tuple(own)
        if not every or not all(isinstance(one, Measurements) for one in every):  # pyright: ignore
            raise InputError.NO_DATA(f"{label} needs one Measurements or more")
        for number, one in enumerate(every):
            if one in every[:number]:
                same = every[every.index(one)].source
                raise InputError.CONFLICT(
                    f"{one.source} of {label} holds the same rows as {same}; give them once, or "
                    "they count twice"
                )
        data[label] = every
    return named, data


def fitted(
    robots: Mapping[str, Robot],
    problem: Problem,
    starts: int,
    seed: int,
    intervals: bool,
    progress: Progress | None = None,
) -> Calibration:
    """Search, tell the noise where it is not known, and how far to trust what was found.

    Args:
        robots: The robots by label.
        problem: What is fitted to what.
        starts: As for `calibrate`.
        seed: As for `calibrate`.
        intervals: As for `calibrate`.
        progress: As for `calibrate`.

    Raises:
        InputError: The model has no solution at any start.
    """
    every = search(problem, starts, seed, progress)
    able = [(one.cost.value, number) for number, one in enumerate(every) if one.cost is not None]
    if not able:
        where = [f"{source}, row {row + 1}" for source, row in problem.samples.failed]
        told = f": no solution at {where[0]} ({len(where)} rows)" if where else ""
        refused = problem.samples.refused.rstrip(".")
        if refused:
            raise InputError.NOT_CONVERGED(
                f"no robot can be as the search would start: {refused}. Give other limits to "
                "search between"
            )
        raise InputError.NOT_CONVERGED(
            f"the model has no solution at any start{told}. Check units and loads of the file, "
            "or give other limits to search between"
        )
    best, reached = _with_own_noise(problem, every[min(able)[1]])
    found = Calibration(robots, problem, best, reached, every, {})
    if intervals and problem.objective.is_likelihood:
        return replace(found, intervals=_intervals(found, progress))
    return found


def _with_own_noise(problem: Problem, best: Minimum) -> tuple[Minimum, Cost]:
    """Where the noise is not known: what the fit leaves, and the fit again, until both agree."""
    cost, noise = best.cost, problem.noise
    assert cost is not None
    for _ in range(_ROUNDS):
        if noise is None or noise.is_known:
            break
        told = noise_left(noise, cost.residuals, len(problem.unknowns))
        settled = np.allclose(told.deviation, noise.deviation, rtol=1e-3, atol=0.0)
        problem.noise = noise = told
        again = minimise(problem, best.values, problem.lower, problem.upper)
        if again.cost is None:
            break
        best, cost = again, again.cost
        if settled:
            break
    return best, cost


def _intervals(found: Calibration, progress: Progress | None) -> dict[str, Interval]:
    problem, best = found.problem, found.best
    if found.tells_no_noise:
        return {
            name: Interval(None, None, np.array([[value, 0.0]]), "nothing tells the noise")
            for name, value in found.values.items()
        }
    told: dict[str, Interval] = {}
    for number, unknown in enumerate(problem.unknowns):
        told[unknown.name] = profile_interval(
            problem,
            best.values,
            found.reached,
            number,
            problem.lower,
            problem.upper,
            rise=found.allowed_rise(unknown.name),
            scale=unknown.scale,
        )
        if progress is not None:
            progress("intervals", number + 1, len(problem.unknowns))
    return told


__all__ = ["calibrate", "fitted"]
