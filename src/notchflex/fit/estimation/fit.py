"""Fitting constants to measurements, with intervals."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError, Robot, Settings
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.estimation.intervals import Cost, Interval, Minimum
from notchflex.fit.estimation.objective import FitObjective, LeastSquares, noise_left
from notchflex.fit.estimation.problem import (
    FitProblem,
    Progress,
    search,
    search_from,
    starting_points,
)
from notchflex.fit.measurements.measurements import Measurements
from notchflex.fit.model.constants import Constant, unknowns
from notchflex.fit.model.drawing import deviations_of
from notchflex.fit.model.samples import Samples
from notchflex.pieces import Manifest, PieceFolder, PieceTask, heads
from notchflex.support import to_table

if TYPE_CHECKING:
    from polars import DataFrame

KIND = "calibration"


class SearchTask(PieceTask):
    """Searches from starting points, each of which is a piece.

    Args:
        problem: The objective.
        starts: Number of starting points that have a solution.
        seed: Seed of the starting points.
    """

    def __init__(self, problem: FitProblem, starts: int, seed: int) -> None:
        self.problem, self.starts, self.seed = problem, starts, seed
        self.points = starting_points(problem, starts, seed)
        samples = problem.samples
        self._robots = {one.label: one.robot for one in samples.every}
        self._settings = samples.every[0].settings
        self.manifest = Manifest.of(
            KIND,
            len(self.points),
            1,
            robots={label: to_table(robot) for label, robot in self._robots.items()},
            measurements=[[one.label, one.measured] for one in samples.every],
            constants=samples.unknowns,
            objective=[type(problem.objective).__name__, problem.objective],
            settings=self._settings,
            starts=starts,
            seed=seed,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Tell how another process makes the same task."""
        samples = self.problem.samples
        data = {label: tuple(samples.of_robot(label)) for label in self._robots}
        content = (self._robots, data, samples.unknowns, self._settings)
        return _search_task, (content, self.problem.objective, self.starts, self.seed)

    def prepare(self) -> None:
        """Estimate the noise, as the first search does at the first point with a solution."""
        for point in self.points:
            if self.problem.noise is not None:
                break
            self.problem(point)

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Search from one starting point."""
        import polars

        self.prepare()
        search = search_from(self.problem, self.points[number], number, self.starts, self.seed)
        names = [one.name for one in self.problem.unknowns]
        cost = np.nan if search.cost is None else search.cost.value
        columns: dict[str, Any] = dict(zip(names, search.values[:, None], strict=True))
        frame = {**columns, "objective": [cost], "converged": [search.converged]}
        head = {
            "codes": [1, 0, 0, 0] if search.cost is not None else [0, 0, 1, 0],
            "values": search.values.tolist(),
            **{name: getattr(search, name) for name in ("converged", "reason")},
            **{name: int(getattr(search, name)) for name in ("iterations", "calls")},
        }
        return polars.DataFrame(frame), head

    def minimum(self, head: dict[str, Any]) -> Minimum:
        """Return what a search found, from the head of its piece."""
        values = np.array(head["values"])
        cost = self.problem(values) if head["codes"][0] else None
        rest = (head[name] for name in ("converged", "reason", "iterations", "calls"))
        return Minimum(values, cost, *rest)


def _search_task(
    content: tuple[Any, ...], objective: FitObjective, starts: int, seed: int
) -> SearchTask:
    """Make the task of another process again."""
    return SearchTask(FitProblem(Samples.of(*content), objective), starts, seed)


def search_in_pieces(
    problem: FitProblem, starts: int, seed: int, folder: PieceFolder, progress: Progress | None
) -> tuple[Minimum, ...]:
    """Search from several starts; another one replaces a start without a solution.

    Args:
        problem: The objective.
        starts: Number of starting points.
        seed: Their seed.
        folder: Where searches are kept.
        progress: As for `search`, which finds the same.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    task = SearchTask(problem, starts, seed)
    task.prepare()
    minima: list[Minimum] = []
    done, last = 0, 0
    while len(minima) < starts and last < task.manifest.pieces:
        last = min(last + starts - len(minima), task.manifest.pieces)

        def report(rows: int, *_: int, before: int = done) -> None:
            if progress is not None:
                progress("searching", min(before + rows, starts), starts)

        folder.run(task, pieces=range(done, last), cores=1, progress=report)
        for head in heads(folder.directory, task.manifest, range(done, last)):
            if head["codes"][0] or not head["piece"]:
                minima.append(task.minimum(head))
        done = last
    if all(one.cost is None for one in minima):
        problem(task.points[0])  # tells where there is no solution
    return tuple(minima)


# How often noise and constants are estimated from each other.
_ROUNDS = 10
# Standard deviations by which the constants may still move in the last round.
_SETTLED = 0.05

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
        priors: Whether what is not fitted may deviate from the robot files within their
            tolerances, or those that `uncertain` assumes (linearised; of `LeastSquares` only, and
            not if robots have constants of their own, `each:`).
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
    if priors and problem.objective.is_likelihood and not any(c.each for c in problem.unknowns):
        problem.drawing = deviations_of(named, problem.unknowns)
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
    problem, best, reached = _with_noise(problem, searches[int(np.argmin(costs))])
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


def _with_noise(problem: FitProblem, best: Minimum) -> tuple[FitProblem, Minimum, Cost]:
    """Estimate unknown noise and deviations from the drawing, and fit again, until all agree."""
    cost, noise = best.cost, problem.noise
    assert cost is not None
    robust = getattr(problem.objective, "huber", None) is not None
    deviations = np.zeros(len(problem.drawing))
    for _ in range(_ROUNDS):
        if noise is None or (noise.is_known and not problem.drawing):
            break
        left = noise_left(noise, cost.residuals, len(problem.unknowns), robust=robust)
        settled = np.allclose(left.deviation, noise.deviation, rtol=1e-3, atol=0.0)
        problem.noise = noise = left
        if problem.drawing:
            linearised = problem.linearised(best.values, deviations)
            if linearised is None:
                break
            problem = linearised
        again = problem.minimum(best.values)
        if again.cost is None:
            break
        moved = again.values - best.values
        settled &= float(moved @ again.cost.curvature @ moved) < _SETTLED**2
        best, cost = again, again.cost
        deviations = problem.means + cost.deviations
        if settled:
            break
    return problem, best, cost


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
