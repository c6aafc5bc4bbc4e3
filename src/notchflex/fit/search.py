"""The objective of a fit as a function of its constants, and the search for its minimum.

`scipy.optimize.least_squares` searches, with its trust region and its steps along limits. It takes
residuals: a function that is not a sum of squares is passed as residuals that have its value,
gradient and curvature. A trial value at which the model has no solution counts as infinite.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.stats import qmc

from notchflex import InputError
from notchflex.fit.constants import Unknown
from notchflex.fit.objective import Cost, FitObjective, Noise, Vector, first_noise
from notchflex.fit.residuals import Samples
from notchflex.pieces import Manifest, PieceFolder, PieceTask, heads
from notchflex.support import to_table

if TYPE_CHECKING:
    from polars import DataFrame

    from notchflex.fit.residuals import Residuals

Progress = Callable[[str, int, int], None]
"""Called with the name of the task, how much of it is done, and how much there is."""

KIND = "calibration"

_EVALUATIONS = 200
# Part of the objective that a full step may still promise to gain at the end: at a kink, such as
# where a notch closes, no step gains what the curvature promises.
_KINK = 1e-3
# Number of candidates for each start, some of which have no solution.
_CANDIDATES = 8


class Minimum(NamedTuple):
    """Result of one search.

    Attributes:
        values: The values.
        cost: The objective there, with derivatives; None if the search could not start.
        converged: Whether it is a minimum.
        reason: Why not, "" if it is.
        iterations: Number of steps.
        calls: Number of evaluations of the objective.
    """

    values: Vector
    cost: Cost | None
    converged: bool
    reason: str
    iterations: int
    calls: int


def minimise(
    objective: Callable[[Vector], Cost | None],
    start: Vector,
    lower: Vector,
    upper: Vector,
    *,
    tolerance: float = 1e-10,
) -> Minimum:
    """Search for a minimum from a start, within limits; equal limits hold a value.

    The search stops if a step lowers the objective by less than `tolerance` of it.

    Example:
        >>> def bowl(at):
        ...     return Cost(float((at - 2.0) @ (at - 2.0)), 2.0 * (at - 2.0), 2.0 * np.eye(1))
        >>> minimise(bowl, np.zeros(1), np.zeros(1), np.ones(1)).values
        array([1.])
    """
    start = np.clip(np.asarray(start, float), lower, upper)
    first, free = objective(start), np.flatnonzero(lower < upper)
    if first is None:
        return Minimum(start, None, False, "the model has no solution at the start", 0, 1)
    if not len(free):
        return Minimum(start, first, True, "", 0, 1)
    curvature, size = np.diag(first.curvature)[free], np.abs(start[free])
    size[size == 0.0] = 1.0
    scale = np.divide(1.0, np.sqrt(curvature), out=size, where=curvature > 0.0)
    least, most = ((limit - start)[free] / scale for limit in (lower, upper))
    tried: dict[bytes, Cost | None] = {np.zeros(len(free)).tobytes(): first}

    def values_at(step: Vector) -> Vector:
        values, moved = start.copy(), start[free] + scale * step
        values[free] = np.select([step <= least, step >= most], [lower[free], upper[free]], moved)
        return np.clip(values, lower, upper)

    def squares(step: Vector) -> tuple[Vector, Float[np.ndarray, "k+1 k"]]:
        key = step.tobytes()
        if key not in tried:
            tried[key] = objective(values_at(step))
        return as_squares(tried[key], free, scale)

    result: Any = least_squares(
        lambda step: squares(step)[0],
        np.zeros(len(free)),
        lambda step: squares(step)[1],  # pyright: ignore[reportArgumentType] - it takes functions
        (least, most),
        method="dogbox",
        ftol=tolerance,
        xtol=1e-10,
        gtol=None,  # pyright: ignore[reportArgumentType] - it takes None
        max_nfev=_EVALUATIONS,
    )
    cost = tried[result.x.tobytes()]
    assert cost is not None
    # How much lower a full step of the values that are not at a limit should be.
    residual, slopes = as_squares(cost, free, scale)
    slopes = slopes[:, result.active_mask == 0]
    promised = 0.5 * np.sum((slopes @ np.linalg.lstsq(slopes, residual)[0]) ** 2)
    reason = ""
    if result.status == 0:
        reason = f"not settled after {_EVALUATIONS} evaluations"
    elif promised > _KINK * (1.0 + cost.value):
        reason = "no step lowers the objective (a kink, or rounding)"
    values = values_at(result.x)
    return Minimum(values, cost, not reason, reason, int(result.njev) - 1, len(tried))


def as_squares(
    cost: Cost | None, free: np.ndarray, scale: Vector
) -> tuple[Vector, Float[np.ndarray, "k+1 k"]]:
    """Return residuals f with derivatives J: |f|^2 / 2 is the objective, J^T f its gradient.

    J^T J is its curvature, or more: the objective is never below 0, so no step may promise to
    lower it by more than its value.
    """
    if cost is None:
        return np.full(len(free) + 1, np.inf), np.zeros((len(free) + 1, len(free)))
    curvature = cost.curvature[np.ix_(free, free)] * np.outer(scale, scale)
    sizes, axes = np.linalg.eigh(curvature)
    root = np.sqrt(np.where(sizes > 1e-12 * sizes[-1], sizes, np.inf))
    along = axes.T @ (scale * cost.gradient[free]) / root
    root = np.where(np.isfinite(root), root, 0.0)
    stiffer = max(np.sqrt(along @ along / max(2.0 * cost.value, 1e-300)), 1.0)
    along, slopes = along / stiffer, root[:, None] * axes.T * stiffer
    rest = np.sqrt(max(2.0 * cost.value - along @ along, 0.0))
    return np.append(along, rest), np.vstack([slopes, np.zeros(len(scale))])


class FitProblem:
    """An objective as a function of constants.

    Attributes:
        samples: The measurements.
        objective: The objective.
        unknowns: The constants.
        drawing: What else may deviate, within the tolerances of the drawings (`deviations_of`).
        noise: Standard deviations of the measurements; None before the first call.
    """

    def __init__(
        self, samples: Samples, objective: FitObjective, drawing: tuple[Unknown, ...] = ()
    ) -> None:
        objective.check(samples.quantities)
        if not objective.takes_priors and any(unknown.prior for unknown in samples.unknowns):
            raise InputError.UNSUPPORTED(
                "a prior needs LeastSquares() or SumOfRobotErrors(); other objectives take none"
            )
        self.samples, self.objective, self.unknowns = samples, objective, samples.unknowns
        self.drawing = drawing
        self.noise: Noise | None = None

    @property
    def varied(self) -> tuple[Unknown, ...]:
        """The constants, and with `with_drawing` what deviates, in standard deviations."""
        return self.samples.unknowns

    @property
    def lower(self) -> Vector:
        """Least values allowed of all that is varied."""
        return np.array([unknown.lower for unknown in self.varied], float)

    @property
    def upper(self) -> Vector:
        """Greatest values allowed of all that is varied."""
        return np.array([unknown.upper for unknown in self.varied], float)

    def __call__(self, values: Vector) -> Cost | None:
        """Return the objective; None if the model has no solution, or no finite derivatives."""
        residuals = self.samples.residuals(values)
        if residuals is None:
            return None
        if not (np.isfinite(residuals.values).all() and np.isfinite(residuals.slopes).all()):
            return None
        if self.noise is None:
            self.noise = first_noise(self.samples, residuals)
        cost = self.objective.cost(residuals, self.noise.deviation)
        for number, unknown in enumerate(self.varied):
            if unknown.prior is not None:
                mean, deviation = unknown.prior
                weight = self.objective.weight_of_one(residuals, self.noise.deviation)
                cost = cost.with_prior(number, float(values[number]) - mean, deviation, weight)
        return cost

    def with_drawing(self, values: Vector) -> FitProblem:
        """Return the same objective as a function of what deviates from the drawing too.

        Deviations by which the model cannot be varied at some values are left out.
        """
        whole = copy(self)
        whole.samples = self.samples.of_unknowns((*self.unknowns, *self.drawing))
        residuals = whole.samples.residuals(np.append(values, np.zeros(len(self.drawing))))
        slopes = np.full((1, len(whole.varied)), np.nan) if residuals is None else residuals.slopes
        is_known = np.isfinite(slopes[:, len(self.unknowns) :]).all(axis=0)
        whole.drawing = tuple(np.array(self.drawing, object)[is_known])
        whole.samples = self.samples.of_unknowns((*self.unknowns, *whole.drawing))
        return whole

    def fitted(self, residuals: Residuals) -> float:
        """Return how many of the measured numbers a fit takes to find what is varied.

        One for each constant that has no prior; less where priors tell a part (the trace of what
        maps numbers measured to numbers fitted; MacKay 1992, *Neural Computation* 4, 415).
        """
        if self.noise is None or not any(unknown.prior for unknown in self.varied):
            return float(len(self.varied))
        counts = np.isfinite(self.noise.deviation)
        scaled = residuals.slopes[counts] / self.noise.deviation[counts, None]
        priors = [1.0 / unknown.prior[1] if unknown.prior else 0.0 for unknown in self.varied]
        orthogonal = np.linalg.qr(np.concatenate([scaled, np.diag(priors)]))[0]
        return float(np.sum(orthogonal[: len(scaled)] ** 2))

    def minimum(self, start: Vector) -> Minimum:
        """Return the minimum that a search from a start ends at."""
        return minimise(self, start, self.lower, self.upper)

    def held(self, number: int, value: float, start: Vector) -> Minimum:
        """Return the minimum with a constant held at a value, searched from a start."""
        start, lower, upper = (values.copy() for values in (start, self.lower, self.upper))
        start[number] = lower[number] = upper[number] = value
        return minimise(self, start, lower, upper, tolerance=1e-7)


class SearchTask(PieceTask):
    """Searches from starting points, each of which is a piece.

    What each finds does not depend on the others.

    Args:
        problem: The objective.
        starts: Number of starting points that have a solution.
        seed: Seed of the starting points.
    """

    def __init__(self, problem: FitProblem, starts: int, seed: int) -> None:
        self.problem, self.starts, self.seed = problem, starts, seed
        # The robots as they are and, for several starts, candidates of Sobol's sequence.
        start, first, last = np.array(
            [(unknown.start, unknown.first, unknown.last) for unknown in problem.unknowns]
        ).T
        self.points = start[None]
        if starts > 1:
            sobol = qmc.Sobol(len(first), rng=np.random.default_rng(seed))
            parts = sobol.random_base2(int(np.ceil(np.log2((starts - 1) * _CANDIDATES))))
            self.points = np.concatenate([self.points, first + parts * (last - first)])

    @cached_property
    def manifest(self) -> Manifest:
        """What the searches follow from."""
        samples, objective = self.problem.samples, self.problem.objective
        return Manifest.of(
            KIND,
            len(self.points),
            1,
            robots={label: to_table(robot) for label, robot in samples.robots.items()},
            measurements=[[sample.label, sample.measured] for sample in samples.every],
            constants=samples.unknowns,
            objective=[type(objective).__name__, objective],
            settings=samples.every[0].settings,
            starts=self.starts,
            seed=self.seed,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Tell how another process makes the same task."""
        samples = self.problem.samples
        data = {label: tuple(samples.of_robot(label)) for label in samples.robots}
        content = (samples.robots, data, samples.unknowns, samples.every[0].settings)
        return _search_task, (content, self.problem.objective, self.starts, self.seed)

    def prepare(self) -> None:
        """Estimate the noise, as the first search does at the first point with a solution."""
        for point in self.points:
            if self.problem.noise is not None:
                break
            self.problem(point)

    def search(self, number: int) -> Minimum:
        """Search from one starting point."""
        return self.problem.minimum(self.points[number])

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Search from one starting point, for the folder."""
        import polars

        self.prepare()
        search = self.search(number)._asdict()
        values, cost = search.pop("values"), search.pop("cost")
        columns = {
            unknown.name: [value]
            for unknown, value in zip(self.problem.unknowns, values, strict=True)
        }
        columns["objective"] = [np.nan if cost is None else cost.value]
        columns["converged"] = [search["converged"]]
        codes = [0, 0, 1, 0] if cost is None else [1, 0, 0, 0]
        return polars.DataFrame(columns), {"codes": codes, "values": values.tolist(), **search}

    def minimum(self, head: dict[str, Any]) -> Minimum:
        """Return what a search found, from the head of its piece."""
        values = np.array(head["values"])
        cost = self.problem(values) if head["codes"][0] else None
        return Minimum(values, cost, *(head[name] for name in Minimum._fields[2:]))

    def in_folder(self, folder: PieceFolder) -> Iterator[Minimum]:
        """Yield what the searches found, which a folder keeps.

        Raises:
            InputError: The folder holds something else, or cannot be written.
        """
        for number in range(len(self.points)):
            # As many at once as are needed, for the workers of the folder.
            last = min(max(self.starts, number + 1), len(self.points))
            folder.run(self, pieces=range(number, last), cores=1)
            needed = range(number, number + 1)
            yield from map(self.minimum, heads(folder.directory, self.manifest, needed))


def _search_task(
    content: tuple[Any, ...], objective: FitObjective, starts: int, seed: int
) -> SearchTask:
    """Make the task of another process again."""
    return SearchTask(FitProblem(Samples.of(*content), objective), starts, seed)


def search(
    problem: FitProblem,
    starts: int,
    seed: int,
    progress: Progress | None,
    folder: PieceFolder | None = None,
) -> tuple[Minimum, ...]:
    """Search from several starts; another one replaces a start without a solution."""
    task = SearchTask(problem, starts, seed)
    found = map(task.search, range(len(task.points))) if folder is None else task.in_folder(folder)
    minima: list[Minimum] = []
    for minimum in found:
        if minimum.cost is None and minima:
            continue
        minima.append(minimum)
        if progress is not None:
            progress("searching", len(minima), starts)
        if len(minima) == starts:
            break
    return tuple(minima)


def unit_free(curvature: Float[np.ndarray, "k k"]) -> tuple[Vector, Float[np.ndarray, "k k"]]:
    """Return the units that give a curvature ones on its diagonal, and the curvature in these.

    Example:
        >>> unit_free(np.array([[4.0, 1.0], [1.0, 1.0]]))[1].tolist()
        [[1.0, 0.5], [0.5, 1.0]]
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    return sizes, curvature / np.outer(sizes, sizes)
