"""Robots within tolerances, drawn and solved under all loads: in memory or in pieces.

They are drawn as independent replicates of scrambled Sobol points; a piece is a part of one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import t as student_t

from notchflex import (
    EquilibriumPath,
    ErrorCode,
    InputError,
    Robot,
    Settings,
    batch,
    simulate,
)
from notchflex.pieces import (
    ACCEPTED,
    CODES,
    FAILED,
    INVALID,
    REJECTED,
    Manifest,
    PieceFolder,
    PieceTask,
    Progress,
    Scale,
    Sketch,
    add_to,
    heads,
    scale_of,
    sobol_points,
    summed_up,
)
from notchflex.support import (
    AnyPath,
    Tolerance,
    ToleranceSource,
    sources_of,
    to_table,
    tolerances_of,
    values_at,
)
from notchflex.tolerancing.spec import Criterion, ToleranceSpec, criteria_of

if TYPE_CHECKING:
    from polars import DataFrame

TAIL = 1e-6
"""What a normal distribution has beyond its end is drawn at the end: 1e-6 on either side, 4.8
standard deviations."""

Counts = Int[np.ndarray, " k"]


def drawn_numbers(
    sources: Sequence[ToleranceSource], levels: Float[np.ndarray, "robots d"]
) -> dict[str, Float[np.ndarray, " robots"]]:
    """Return the numbers of robots by name, at levels of the sources; see `TAIL`."""
    return values_at(sources, np.clip(levels, TAIL, 1.0 - TAIL))


class Outcomes(NamedTuple):
    """Outcomes of robots.

    Attributes:
        values: The numbers that have limits, (robots, criteria); NaN where there is no result.
        codes: What became of each robot, an index of `CODES`.
    """

    values: Float[np.ndarray, "robots criteria"]
    codes: Int[np.ndarray, " robots"]

    @property
    def accepted(self) -> Bool[np.ndarray, " robots"]:
        """Which robots meet all limits."""
        return self.codes == ACCEPTED


class StudyLoad(NamedTuple):
    """A load of a study."""

    path: EquilibriumPath  # of the drawing
    criteria: Mapping[int, Criterion]  # by their places
    outputs: tuple[str, ...]  # their quantities


@dataclass(frozen=True, eq=False)
class Study:
    """A robot with tolerances under loads, and what its results must meet.

    Attributes:
        robot: The robot of the drawing.
        tolerances: What deviates.
        paths: The robot of the drawing under every load, by name.
        criteria: The numbers that have limits.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: As for `batch`.
    """

    robot: Robot
    tolerances: tuple[Tolerance, ...]
    paths: Mapping[str, EquilibriumPath]
    criteria: Sequence[Criterion]
    settings: Settings | None = None
    refinement: int = 0
    cores: int | None = None

    @cached_property
    def exact(self) -> Robot:
        """The robot without tolerances."""
        return self.robot.replace(tolerance=None)

    @cached_property
    def sources(self) -> list[ToleranceSource]:
        """Independent sources of deviations, those that deviate by nothing left out."""

        def deviates(source: ToleranceSource) -> bool:
            low, high = (next(iter(source.values(level).values())) for level in (0.25, 0.75))
            return low < high

        return [source for source in sources_of(self.exact, self.tolerances) if deviates(source)]

    @cached_property
    def loads(self) -> dict[str, StudyLoad]:
        """The loads that any limit is about, each up to the last step that has one."""
        loads: dict[str, StudyLoad] = {}
        for name, path in self.paths.items():
            criteria = {k: one for k, one in enumerate(self.criteria) if one.load == name}
            if criteria:
                last = max(criterion.step for criterion in criteria.values())
                outputs = dict.fromkeys(one.quantity.name for one in criteria.values())
                loads[name] = StudyLoad(path[: last + 1], criteria, tuple(outputs))
        return loads

    def at_levels(
        self,
        levels: Float[np.ndarray, "robots d"],
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots at levels of the sources, each between 0 and 1."""
        return self.solved(drawn_numbers(self.sources, levels), len(levels), progress)

    def solved(
        self,
        numbers: Mapping[str, Float[np.ndarray, " r"]],
        count: int,
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots with other numbers under all loads.

        Args:
            numbers: The numbers by name, one per robot.
            count: How many robots.
            progress: Called with the robots done and all of them.
        """
        values = np.full((count, len(self.criteria)), np.nan)
        codes = np.full(count, ACCEPTED)
        for turn, (path, criteria, outputs) in enumerate(self.loads.values()):

            def report(done: int, total: int, turn: int = turn) -> None:
                if progress is not None:
                    progress(turn * total + done, len(self.loads) * total)

            try:
                quantities = batch(
                    self.exact, numbers, path.load, outputs=outputs, settings=self.settings,
                    refinement=self.refinement, cores=self.cores, progress=report,
                )  # fmt: skip
            except InputError as error:
                if error.code is not ErrorCode.INVALID_ROBOT:
                    raise
                return Outcomes(values, np.full(count, INVALID))
            converged = quantities["converged"]
            for place, criterion in criteria.items():
                result = criterion.of(quantities[criterion.quantity.name])
                values[:, place] = np.where(converged[:, criterion.step], result, np.nan)
            codes[~converged.all(axis=1)] = FAILED
            codes[~quantities.valid] = INVALID
        below, above = self.beyond(values)
        limited = np.array([max(one.lower, -one.upper) > -np.inf for one in self.criteria])
        # What is not known is within no limits.
        outside = (below | above | np.isnan(values) & limited).any(axis=1)
        codes[(codes == ACCEPTED) & outside] = REJECTED
        return Outcomes(values, codes)

    def beyond(self, values: Float[np.ndarray, "r k"]) -> tuple[np.ndarray, np.ndarray]:
        """Return which numbers are below the lower limits, and above the upper ones."""
        lower, upper = np.array([[one.lower, one.upper] for one in self.criteria]).T
        return values < lower, values > upper


def tolerances_for(
    robot: Robot, spec: ToleranceSpec
) -> tuple[tuple[Tolerance, ...], tuple[str, ...]]:
    """Return the tolerances, and the names of those that are assumed."""
    if spec.tolerances is None:
        return tolerances_of(robot)
    return robot.replace(tolerance=spec.tolerances).tolerance, ()


def study_of(
    robot: Robot,
    spec: ToleranceSpec,
    settings: Settings | None,
    refinement: int,
    cores: int | None = None,
) -> Study:
    """Make the study of a robot.

    Raises:
        InputError: The robot of the drawing does not converge under a load.
    """
    paths: dict[str, EquilibriumPath] = {}
    tolerances, _ = tolerances_for(robot, spec)
    for name, load in spec.loads.items():
        paths[name] = simulate(robot, load, settings=settings, refinement=refinement)
        if not paths[name].converged.all():
            step = int(np.argmin(paths[name].converged))
            raise InputError.NOT_CONVERGED(
                f"load {name}: the robot of the drawing has no result at step {step + 1}: "
                f"{paths[name].reason[step]}."
            )
    criteria = tuple(criteria_of(spec, paths))
    return Study(robot, tolerances, paths, criteria, settings, refinement, cores)


_PIECES = 16
"""Approximate number of pieces of a study, unless they would be too small or too large."""
_MIN_ROWS, _MAX_ROWS = 2**12, 2**18
_MAX_BYTES = 2**27
"""What the solver returns of one piece at most, so that a worker needs less than 1 GiB."""


def piece_rows(rows: int, study: Study) -> int:
    """Return the rows of a piece, a power of two, for so many rows of a study."""
    numbers = sum(  # that the solver returns of a row
        len(path) * max(path.quantity(name)[0].size, 1)
        for path, _, outputs in study.loads.values()
        for name in outputs
    )
    size = 2 ** math.ceil(math.log2(max(rows / _PIECES, 1)))
    most = 2 ** int(math.log2(max(_MAX_BYTES / (8 * numbers), 16)))
    return min(max(size, _MIN_ROWS), _MAX_ROWS, most)


REPLICATES = 25
"""Independent sets of points: the quantile of t is 5 % above that of infinitely many."""

_CONFIDENCE = 0.95


def points_of_each(draws: int) -> int:
    """Return how many points each replicate has: the power of two nearest to its share.

    Example:
        >>> REPLICATES * points_of_each(100_000)
        102400
    """
    return 2 ** max(round(math.log2(draws / REPLICATES)), 1)


def replicates(
    sources: int, each: int, seed: int, first: int | None = None
) -> list[Float[np.ndarray, "first d"]]:
    """Return independent sets of levels, scrambled Sobol points between 0 and 1.

    Args:
        sources: How many numbers are drawn.
        each: Points of a set, a power of two.
        seed: The same seed makes the same points.
        first: Only so many points of each set.
    """
    return [
        sobol_points(sources, seed, 0, first or each, each, number) for number in range(REPLICATES)
    ]


def yield_interval(accepted: Int[np.ndarray, " replicates"], each: int) -> tuple[float, float]:
    r"""Return the 95 % interval of the yield.

    Scrambled Sobol points fill the tolerances more evenly than independent draws, so that a
    binomial interval of all points would be too wide. The scatter of the yields $\hat p_r$ of
    independent replicates gives the variance of the mean. That is worth
    $n_e = \hat p(1 - \hat p)/\operatorname{var}(\bar p)$ independent draws, which Wilson's interval
    takes with the quantile of Student's t for the number of replicates.

    Args:
        accepted: How many robots of each replicate are accepted.
        each: Robots of a replicate.

    Example:
        >>> low, high = yield_interval(np.full(25, 40), 40)
        >>> round(low, 4), high
        (0.9958, 1.0)
    """
    parts = np.asarray(accepted) / each
    part, variance = float(parts.mean()), float(parts.var(ddof=1)) / len(parts)
    draws = part * (1.0 - part) / variance if variance > 0.0 else float(len(parts) * each)
    square = float(student_t.ppf(0.5 + 0.5 * _CONFIDENCE, len(parts) - 1)) ** 2 / draws
    middle = (part + 0.5 * square) / (1.0 + square)
    half = math.sqrt(square * part * (1.0 - part) + 0.25 * square**2) / (1.0 + square)
    return (
        max(middle - half, 0.0) if part > 0.0 else 0.0,
        min(middle + half, 1.0) if part < 1.0 else 1.0,
    )


def drawn_levels(sources: int, draws: int, seed: int) -> Float[np.ndarray, "draws d"]:
    """Return levels of about so many robots, one set of points after the other."""
    return np.concatenate(replicates(sources, points_of_each(draws), seed))


def yield_of(accepted: Bool[np.ndarray, " draws"]) -> tuple[float, tuple[float, float]]:
    """Return which part of robots at `drawn_levels` is accepted, and its 95 % interval."""
    sets = accepted.reshape(REPLICATES, -1)
    return float(accepted.mean()), yield_interval(sets.sum(axis=1), sets.shape[1])


@dataclass(frozen=True, eq=False)
class DrawnCounts:
    """Counts of drawn robots, k numbers with limits.

    Attributes:
        codes: How many robots have each of `CODES`.
        accepted: How many robots of each replicate are accepted.
        below: How many robots are below the lower limit of each number, (k,).
        above: The same above the upper limit.
    """

    codes: Counts
    accepted: Int[np.ndarray, " replicates"]
    below: Counts
    above: Counts


@dataclass(frozen=True, eq=False)
class DrawnRobots(DrawnCounts):
    """The robots that were drawn within the tolerances.

    Attributes:
        numbers: Their numbers by name, (draws,).
        outcomes: What became of them.
    """

    numbers: Mapping[str, Float[np.ndarray, " draws"]]
    outcomes: Outcomes

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the robots stays below."""
        values = self.outcomes.values[np.isfinite(self.outcomes.values).all(axis=1)]
        return np.quantile(values if len(values) else self.outcomes.values[:1], part, axis=0)

    def histogram(self, index: int, bins: int) -> tuple[np.ndarray, np.ndarray]:
        """Return edges and counts of the values of a number; both empty without a result."""
        values = self.outcomes.values[:, index]
        values = values[np.isfinite(values)]
        counts, edges = np.histogram(values, bins)
        return (edges, counts) if len(values) else (np.zeros(0), np.zeros(0, int))


def draw(
    study: Study, draws: int, seed: int, progress: Callable[[int, int], None] | None
) -> DrawnRobots:
    """Draw robots in memory; arguments as for `tolerance_analysis`."""
    levels = drawn_levels(len(study.sources), draws, seed)
    outcomes = study.at_levels(levels, progress)
    codes = np.bincount(outcomes.codes, minlength=len(CODES))
    accepted = outcomes.accepted.reshape(REPLICATES, -1).sum(axis=1)
    below, above = (part.sum(axis=0) for part in study.beyond(outcomes.values))
    numbers = drawn_numbers(study.sources, levels)
    return DrawnRobots(codes, accepted, below, above, numbers, outcomes)


@dataclass(frozen=True, eq=False)
class DrawnPieces(DrawnCounts):
    """Summary of robots that were drawn in pieces.

    Attributes:
        directory: The folder of the pieces.
        sketches: Statistics of each number.
    """

    directory: AnyPath
    sketches: Sequence[Sketch]

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return percentiles, exact to 1/1000 of half the range of most values."""
        return np.array([sketch.quantile(part) for sketch in self.sketches])

    def histogram(self, index: int, bins: int) -> tuple[np.ndarray, np.ndarray]:
        """Return edges and counts of the values of a number; both empty without a result."""
        edges, counts = self.sketches[index].histogram(bins)
        return np.array(edges), np.array(counts, int)


_SAMPLE = 1024
"""Robots of the sample that finds the scales of statistics, or fewer."""
_EXTREMES = 10
"""Smallest and largest values that are kept of each number."""


@dataclass(frozen=True, eq=False)
class ToleranceTask(PieceTask):
    """Drawn robots in pieces; arguments as for `tolerance_analysis`."""

    robot: Robot
    spec: ToleranceSpec
    draws: int
    seed: int
    settings: Settings | None
    refinement: int

    @cached_property
    def study(self) -> Study:
        """The robot and what it must meet, solved by one thread a piece."""
        return study_of(self.robot, self.spec, self.settings, self.refinement, 1)

    @cached_property
    def manifest(self) -> Manifest:
        """All that the bytes of pieces depend on."""
        study, each = self.study, points_of_each(self.draws)
        rows = REPLICATES * each
        return Manifest.of(
            "tolerance",
            rows,
            min(piece_rows(rows, study), each),
            robot=to_table(study.exact),
            tolerances=study.tolerances,
            loads={name: load.path.load for name, load in study.loads.items()},
            limits=[[one.name, one.load, one.step, one.lower, one.upper] for one in study.criteria],
            settings=study.settings,
            refinement=study.refinement,
            seed=self.seed,
        )

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """Scales of the statistics of every number."""
        sources, each = len(self.study.sources), points_of_each(self.draws)
        first = min(4 * _SAMPLE // REPLICATES, each)
        levels = np.concatenate(replicates(sources, each, self.seed, first))
        values = self.study.at_levels(levels[:: -(-len(levels) // _SAMPLE)]).values
        return {
            criterion.name: scale_of(column)
            for criterion, column in zip(self.study.criteria, values.T, strict=True)
        }

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Draw and solve the robots of one piece."""
        import polars

        study, each = self.study, points_of_each(self.draws)
        start, stop = self.manifest.between(number)
        which, first = divmod(start, each)
        last = first + stop - start
        levels = sobol_points(len(study.sources), self.seed, first, last, each, which)
        outcomes = study.at_levels(levels)
        below, above = (part.sum(axis=0) for part in study.beyond(outcomes.values))
        solved = np.isfinite(outcomes.values).all(axis=1)
        columns = dict(zip(self.scales, np.where(solved, outcomes.values.T, np.nan), strict=True))
        counts = {"replicate": which, "below": below.tolist(), "above": above.tolist()}
        head = summed_up(columns, outcomes.codes, start, self.scales, _EXTREMES, **counts)
        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(outcomes.codes)
        named = {"code": code, **limited_columns(study.criteria, outcomes.values)}
        return polars.DataFrame(named, nan_to_null=True), head


def limited_columns(
    criteria: Sequence[Criterion], values: Float[np.ndarray, "robots k"]
) -> dict[str, Float[np.ndarray, " robots"]]:
    """Return the numbers that have limits by name and unit, in the units of files."""
    columns: dict[str, np.ndarray] = {}
    for criterion, column in zip(criteria, values.T, strict=True):
        unit = f" [{criterion.quantity.unit}]" if criterion.quantity.unit else ""
        columns[f"{criterion.name}{unit}"] = np.ascontiguousarray(column) * criterion.quantity.scale
    return columns


def draw_in_pieces(
    task: ToleranceTask, folder: PieceFolder, cores: int | None, progress: Progress | None
) -> DrawnPieces:
    """Draw robots in pieces, and sum up what became of them.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    assert task.scales  # all threads need them
    folder.run(task, cores=cores, progress=progress)
    size = len(task.study.criteria)
    codes, accepted = np.zeros(len(CODES), int), np.zeros(REPLICATES, int)
    below, above = np.zeros(size, int), np.zeros(size, int)
    sketches: dict[str, Sketch] = {}
    for head in heads(folder.directory, task.manifest, range(task.manifest.pieces)):
        codes += head["codes"]
        accepted[head["replicate"]] += head["codes"][ACCEPTED]
        below += head["below"]
        above += head["above"]
        add_to(sketches, head, _EXTREMES)
    return DrawnPieces(codes, accepted, below, above, folder.directory, list(sketches.values()))
