"""Robots within tolerances, solved under all loads: at levels, drawn, in memory or in pieces.

A piece is a part of one replicate of scrambled Sobol points.
"""

from __future__ import annotations

import dataclasses
import math
import os
import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex import (
    EquilibriumPath,
    ErrorCode,
    InputError,
    LoadPath,
    Robot,
    Settings,
    batch,
    simulate,
)
from notchflex.analysis.draws import ToleranceSource, sources_of, values_at
from notchflex.pieces.folder import (
    ACCEPTED,
    CODES,
    FAILED,
    INVALID,
    REJECTED,
    Manifest,
    Piece,
    Recipe,
    finished_head,
    plain,
)
from notchflex.pieces.run import PieceFolder, Progress
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.pieces.sobol import SobolPart
from notchflex.support import Tolerance, to_table
from notchflex.tolerancing.spec import Criterion, ToleranceSpec, criteria_of
from notchflex.tolerancing.yields import REPLICATES, points_of_each, replicate

TAIL = 1e-6
"""What a normal distribution has beyond its end is drawn at the end: 1e-6 on either side, 4.8
standard deviations."""


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
        """Independent sources of deviations."""
        return [one for one in sources_of(self.exact, self.tolerances) if np.ptp(_ends(one)) > 0.0]

    @cached_property
    def loads(self) -> dict[str, LoadPath]:
        """The loads that any limit is about, each up to the last step that has one."""
        last: dict[str, int] = {}
        for one in self.criteria:
            last[one.load] = max(last.get(one.load, 0), one.step + 1)
        return {name: self.paths[name].load[:steps] for name, steps in last.items()}

    def drawn(self, levels: Float[np.ndarray, "robots d"]) -> dict[str, Float[np.ndarray, " r"]]:
        """Return the numbers of robots by name, at levels of the sources; see `TAIL`."""
        return values_at(self.sources, np.clip(levels, TAIL, 1.0 - TAIL))

    def at_levels(
        self,
        levels: Float[np.ndarray, "robots d"],
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots at levels of the sources, each between 0 and 1."""
        return self.solved(self.drawn(levels), len(levels), progress)

    def solved(
        self,
        drawn: Mapping[str, Float[np.ndarray, " r"]],
        count: int,
        progress: Callable[[int, int], None] | None = None,
    ) -> Outcomes:
        """Solve robots with other numbers under all loads.

        Args:
            drawn: The numbers by name, one per robot.
            count: How many robots.
            progress: Called with the robots done and all of them.
        """
        values = np.full((count, len(self.criteria)), np.nan)
        codes = np.full(count, ACCEPTED)
        for number, (name, load) in enumerate(self.loads.items()):
            own = [index for index, one in enumerate(self.criteria) if one.load == name]
            outputs = tuple(dict.fromkeys(self.criteria[index].quantity.name for index in own))
            part = _part_of(progress, number, len(self.loads))
            try:
                quantities = batch(
                    self.exact, drawn, load, outputs=outputs, settings=self.settings,
                    refinement=self.refinement, cores=self.cores, progress=part,
                )  # fmt: skip
            except InputError as error:
                if error.code is not ErrorCode.INVALID_ROBOT:
                    raise
                return Outcomes(values, np.full(count, INVALID))
            converged = quantities["converged"]
            for index in own:
                criterion = self.criteria[index]
                result = criterion.of(quantities[criterion.quantity.name])
                values[:, index] = np.where(converged[:, criterion.step], result, np.nan)
            codes[~converged.all(axis=1)] = FAILED
            codes[~quantities.valid] = INVALID
        codes[(codes == ACCEPTED) & ~self.within(values).all(axis=1)] = REJECTED
        return Outcomes(values, codes)

    def within(self, values: Float[np.ndarray, "robots k"]) -> Bool[np.ndarray, "robots k"]:
        """Return which numbers lie within their limits; NaN does not."""
        lower, upper = (
            np.array([getattr(one, end) for one in self.criteria]) for end in ("lower", "upper")
        )
        return (values >= lower) & (values <= upper)


def study_of(
    robot: Robot,
    spec: ToleranceSpec,
    tolerances: tuple[Tolerance, ...],
    settings: Settings | None,
    refinement: int,
    cores: int | None = None,
) -> Study:
    """Make the study of a robot; the other arguments are those of `Study`.

    Args:
        robot: The robot of the drawing.
        spec: Loads and limits.
        tolerances: What deviates.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes.
        cores: How many cores to use.

    Raises:
        InputError: The robot of the drawing does not converge under a load.
    """
    paths: dict[str, EquilibriumPath] = {}
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


def _ends(source: ToleranceSource) -> list[float]:
    """Return values of a source that differ where its tolerance is not zero."""
    first = next(iter(source.nominal))
    return [source.values(level)[first] for level in (0.25, 0.75)]


def _part_of(
    progress: Callable[[int, int], None] | None, number: int, parts: int
) -> Callable[[int, int], None] | None:
    """Return the progress of one of several batches as part of all."""
    if progress is None:
        return None
    return lambda done, count: progress(number * count + done, parts * count)


SAMPLE = 4096
"""Rows from all over a study, from which the scales of its statistics come."""

_PIECES = 16
"""Approximate number of pieces of a study, unless they would be too small or too large."""
_MIN_ROWS, _MAX_ROWS = 2**12, 2**18
_MAX_BYTES = 2**27
"""What the solver returns of one piece at most, so that a worker needs less than 1 GiB."""


@dataclass(frozen=True, eq=False)
class PieceStudy(Study):
    """A study that is solved in pieces.

    Attributes:
        sample: Numbers of some rows from all over the study, by name.
    """

    sample: Mapping[str, Float[np.ndarray, " k"]] = dataclasses.field(
        default_factory=dict[str, np.ndarray]
    )

    @property
    def row_bytes(self) -> int:
        """Bytes that the solver returns of one row."""
        sizes: dict[tuple[str, str], int] = {}
        for one in self.criteria:
            values = self.paths[one.load].quantity(one.quantity.name)[0]
            sizes[one.load, one.quantity.name] = len(self.loads[one.load]) * max(values.size, 1)
        return 8 * sum(sizes.values())

    def at(self, numbers: Mapping[str, Float[np.ndarray, " k"]]) -> Outcomes:
        """Solve robots: numbers in the units of files, NaN where there is no result."""
        count = len(next(iter(numbers.values())))
        outcomes = self.solved(numbers, count)
        scale = np.array([one.quantity.scale for one in self.criteria])
        return Outcomes(outcomes.values * scale, outcomes.codes)


def piece_rows(rows: int, study: PieceStudy) -> int:
    """Return the rows of a piece, a power of two.

    Args:
        rows: Rows of the study.
        study: The study.
    """
    size = 2 ** math.ceil(math.log2(max(rows / _PIECES, 1)))
    most = 2 ** int(math.log2(max(_MAX_BYTES / study.row_bytes, 16)))
    return min(max(size, _MIN_ROWS), _MAX_ROWS, most)


Histogram = tuple[Float[np.ndarray, " edges"], Int[np.ndarray, " bins"]]


@dataclass(frozen=True, eq=False)
class DrawnRobots:
    """The robots that were drawn within the tolerances.

    Attributes:
        numbers: Their numbers by name, (draws,).
        outcomes: What became of them.
    """

    numbers: Mapping[str, Float[np.ndarray, " draws"]]
    outcomes: Outcomes

    @property
    def codes(self) -> Int[np.ndarray, " codes"]:
        """Number of robots by each of `CODES`."""
        return np.bincount(self.outcomes.codes, minlength=len(CODES))

    @property
    def accepted(self) -> Int[np.ndarray, " replicates"]:
        """Number of accepted robots in each replicate."""
        return self.outcomes.accepted.reshape(REPLICATES, -1).sum(axis=1)

    def beyond(self, criteria: Sequence[Criterion]) -> tuple[np.ndarray, np.ndarray]:
        """Return how many robots are below and above the limits of each number, (k,) each."""
        return beyond(self.outcomes.values, criteria)

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the robots stays below."""
        values = self.outcomes.values
        values = values[np.isfinite(values).all(axis=1)]
        size = values.shape[1]
        return np.quantile(values, part, axis=0) if len(values) else np.full(size, np.nan)

    def histogram(self, index: int, bins: int) -> Histogram:
        """Return edges and counts of the values of a number; both empty without a result."""
        values = self.outcomes.values[:, index]
        values = values[np.isfinite(values)]
        if not len(values):
            return np.zeros(0), np.zeros(0, int)
        counts, edges = np.histogram(values, bins)
        return edges, counts


@dataclass(frozen=True, eq=False)
class DrawnPieces:
    """Summary of robots that were drawn in pieces.

    Attributes:
        directory: The folder of the pieces.
        codes: How many robots have each of `CODES`.
        accepted: How many robots of each replicate are accepted.
        below: How many robots are below the lower limit of each number, (k,).
        above: The same above the upper limit.
        sketches: Statistics of each number.
        scales: Scales of the statistics.
    """

    directory: str | os.PathLike[str]
    codes: Int[np.ndarray, " codes"]
    accepted: Int[np.ndarray, " replicates"]
    below: Int[np.ndarray, " k"]
    above: Int[np.ndarray, " k"]
    sketches: Sequence[Sketch]
    scales: Sequence[Scale]

    def beyond(self, criteria: Sequence[Criterion]) -> tuple[np.ndarray, np.ndarray]:
        """Return how many robots are below and above the limits of each number, (k,) each."""
        del criteria
        return self.below, self.above

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the robots stays below.

        It is exact to 1/1000 of half the range of most values.
        """
        both = zip(self.sketches, self.scales, strict=True)
        return np.array([sketch.quantile(part, scale) for sketch, scale in both])

    def histogram(self, index: int, bins: int) -> Histogram:
        """Return edges and counts of the values of a number; both empty without a result."""
        edges, counts = self.sketches[index].histogram(bins, self.scales[index])
        return np.array(edges), np.array(counts, int)


def beyond(
    values: Float[np.ndarray, "robots k"], criteria: Sequence[Criterion]
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return how many robots are below and above the limits of each number."""
    lower, upper = (np.array([getattr(one, end) for one in criteria]) for end in ("lower", "upper"))
    return (values < lower).sum(axis=0), (values > upper).sum(axis=0)


KIND = "tolerance"
_SCALED = 1024
"""Robots of the sample that find the scales of statistics."""
_EXTREMES = 10
"""Smallest and largest values that are kept of each number."""


class ToleranceTask:
    """Robots at levels of their tolerances, in pieces.

    Args:
        study: What deviates, and the numbers that have limits.
        spec: What it was made from.
        draws: About how many robots are drawn.
        seed: Of the draws.
    """

    def __init__(self, study: Study, spec: ToleranceSpec, draws: int, seed: int) -> None:
        self._content = (study.robot, spec, study.tolerances, study.settings, study.refinement)
        self._draws, self.seed, self.each = draws, seed, points_of_each(draws)
        self._own = threading.local()
        sources = len(study.sources)
        levels = np.concatenate(
            [
                replicate(sources, self.each, seed, number).between(0, SAMPLE // REPLICATES)
                for number in range(REPLICATES)
            ]
            if self.each >= SAMPLE // REPLICATES
            else [np.random.default_rng(seed).random((SAMPLE, sources))]
        )
        self.study = PieceStudy(
            study.robot, study.tolerances, study.paths, study.criteria, study.settings,
            study.refinement, 1, sample=study.drawn(levels),
        )  # fmt: skip
        self.manifest = self._manifest()

    def _manifest(self) -> Manifest:
        """Return all that the bytes of pieces depend on."""
        rows = REPLICATES * self.each
        study = self.study
        return Manifest.made(
            KIND,
            rows,
            min(piece_rows(rows, study), self.each),
            robot=to_table(study.exact),
            tolerances=plain(study.tolerances),
            loads=plain(study.loads),
            limits=[
                [one.name, one.load, one.step, plain(one.lower), plain(one.upper)]
                for one in study.criteria
            ],
            settings=plain(study.settings),
            refinement=study.refinement,
            seed=self.seed,
        )

    @property
    def recipe(self) -> Recipe:
        """Recipe by which another process makes the same task."""
        return Recipe(tolerance_task, pickle.dumps((self._content, self._draws, self.seed)))

    def prepare(self) -> None:
        """Find scales, which all threads need."""
        assert self.scales

    @cached_property
    def scales(self) -> list[Scale]:
        """Scales of the statistics of every number."""
        sample = {name: one[:: SAMPLE // _SCALED] for name, one in self.study.sample.items()}
        outcomes = self.study.solved(sample, len(next(iter(sample.values()))))
        return [Scale.of(column) for column in outcomes.values.T]

    def _sequence(self, number: int) -> SobolPart:
        """Return a replicate, for the calling thread."""
        if getattr(self._own, "number", None) != number:
            self._own.number = number
            self._own.part = replicate(len(self.study.sources), self.each, self.seed, number)
        return self._own.part

    def piece(self, number: int) -> Piece:
        """Draw and solve the robots of one piece."""
        import polars

        start, stop = self.manifest.between(number)
        which, first = divmod(start, self.each)
        levels = self._sequence(which).between(first, first + stop - start)
        outcomes = self.study.at_levels(levels)
        below, above = beyond(outcomes.values, self.study.criteria)
        solved = np.asarray(np.isfinite(outcomes.values).all(axis=1))
        complete = np.where(solved[:, None], outcomes.values, np.nan)
        columns = zip(np.ascontiguousarray(complete.T), self.scales, strict=True)
        head = {
            "codes": np.bincount(outcomes.codes, minlength=len(CODES)).tolist(),
            "replicate": which,
            "below": below.tolist(),
            "above": above.tolist(),
            "scales": [[one.middle, one.half] for one in self.scales],
            "columns": [
                Sketch.of(values, start, scale, _EXTREMES).document() for values, scale in columns
            ],
        }
        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(outcomes.codes)
        frame: dict[str, Any] = {"code": code}
        for one, values in zip(self.study.criteria, outcomes.values.T, strict=True):
            unit = f" [{one.quantity.unit}]" if one.quantity.unit else ""
            frame[f"{one.name}{unit}"] = np.ascontiguousarray(values) * one.quantity.scale
        return Piece(polars.DataFrame(frame, nan_to_null=True), head)


def tolerance_task(content: bytes) -> ToleranceTask:
    """Make the task of another process again, from objects that it pickled."""
    (robot, spec, tolerances, settings, refinement), draws, seed = pickle.loads(content)
    study = study_of(robot, spec, tolerances, settings, refinement)
    return ToleranceTask(study, spec, draws, seed)


def draw_in_pieces(
    study: Study,
    spec: ToleranceSpec,
    draws: int,
    seed: int,
    folder: PieceFolder,
    progress: Progress | None = None,
) -> DrawnPieces:
    """Draw robots in pieces, and sum up what became of them.

    Args:
        study: What deviates, and the numbers that have limits.
        spec: What it was made from.
        draws: About how many robots are drawn.
        seed: Of the draws.
        folder: Where pieces are kept.
        progress: Called with robots done, robots in all, those without a result, and those done by
            earlier calls.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    task = ToleranceTask(study, spec, draws, seed)
    folder.run(task, cores=study.cores, progress=progress)
    size, manifest = len(study.criteria), task.manifest
    codes, accepted = np.zeros(len(CODES), int), np.zeros(REPLICATES, int)
    below, above = np.zeros(size, int), np.zeros(size, int)
    sketches, scales = [Sketch() for _ in range(size)], [Scale(0.0, 1.0)] * size
    for piece in range(manifest.pieces):
        head = finished_head(folder.directory, manifest, piece)
        codes += np.array(head["codes"])
        accepted[head["replicate"]] += head["codes"][ACCEPTED]
        below += np.array(head["below"], int)
        above += np.array(head["above"], int)
        scales = [Scale(*pair) for pair in head["scales"]]
        sketches = [
            one.merged(Sketch.read(document), _EXTREMES)
            for one, document in zip(sketches, head["columns"], strict=True)
        ]
    return DrawnPieces(folder.directory, codes, accepted, below, above, sketches, scales)
