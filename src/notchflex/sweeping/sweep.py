"""Sweeps: runs one, or what is left of it, reads it from its folder, and estimates it before.

What a row gives depends on the plan alone: not on the process, on the rows before, or on cores.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from notchflex import ErrorCode, InputError, Robot, simulate
from notchflex.pieces import (
    CODES,
    FAILED,
    Manifest,
    PieceFolder,
    PieceTask,
    Progress,
    Scale,
    Sketch,
    add_to,
    check_target,
    damaged,
    encoded,
    heads,
    piece_file,
    scale_of,
    sobol_points,
    summed_up,
)
from notchflex.specification import (
    Criterion,
    entry_names,
    limited_numbers,
    made,
    placed,
    read_load,
    whole,
    with_robot,
)
from notchflex.support import (
    AnyPath,
    Displayed,
    Summary,
    from_table,
    nearest,
    need,
    number_at,
    number_of_cores,
    short,
    to_table,
    write_json,
)
from notchflex.sweeping.plan import (
    Sampling,
    SweepPlan,
    SweepVariable,
    plan_table,
)
from notchflex.tolerancing import Study, piece_rows

if TYPE_CHECKING:
    from polars import DataFrame, LazyFrame
    from xarray import Dataset

KIND = "sweep"
_MAX_XARRAY = 100_000_000
"""Rows of a data set at most, which is in memory."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Displayed):
    """A sweep in its folder, finished or not.

    Attributes:
        directory: The folder.
        manifest: What the sweep is.
        plan: The plan; its robot is only a name.
        robot: The robot that is varied.
        pieces: Numbers of the pieces that are there.
        counts: How many rows have each code.
        failures: Numbers of the first rows without a result, as many as the plan asks for.
        sketches: Statistics of every kept quantity.
    """

    directory: Path
    manifest: Manifest
    plan: SweepPlan
    robot: Robot
    pieces: tuple[int, ...]
    counts: dict[str, int]
    failures: list[int]
    sketches: dict[str, Sketch]

    @property
    def rows(self) -> int:
        """Rows that are there."""
        return sum(self.counts.values())

    @property
    def finished(self) -> bool:
        """Whether all pieces are there."""
        return len(self.pieces) == self.manifest.pieces

    @property
    def columns(self) -> list[str]:
        """Names of the kept quantities, with their units."""
        return list(self.sketches)

    def lazy(self) -> LazyFrame:
        """Return the rows as a lazy frame of polars, in their order.

        Columns are `row`, the variables, `code` and the kept quantities, in the units of files.
        `code` is "accepted", "rejected" (outside of a limit, or not known where there is one),
        "NOT_CONVERGED" or "INVALID_ROBOT"; the last two have no quantities.

        Raises:
            InputError: No piece is there.
        """
        import polars

        if not self.pieces:
            raise InputError.NO_DATA(f"{self.directory} has no finished piece yet.")
        return polars.concat([self._piece(piece) for piece in self.pieces])

    def _piece(self, piece: int) -> LazyFrame:
        """Return the rows of a piece with their numbers."""
        import polars

        frame = polars.scan_parquet(piece_file(self.directory, piece))
        if not self.plan.output.rows:
            return frame
        row = polars.int_range(polars.len(), dtype=polars.Int64) + self.manifest.between(piece)[0]
        return frame.select(row.alias("row"), polars.all())

    def to_xarray(self) -> Dataset:
        """Return the rows as a data set: a dimension for each variable of a grid, and `point`.

        Raises:
            InputError: The sweep is not finished, keeps not all rows, has more than 1e8, or xarray
                is not installed.
        """
        need("xarray", "data", "to_xarray")
        import xarray

        if not self.finished or not self.plan.output.rows or self.rows > _MAX_XARRAY:
            raise InputError.UNSUPPORTED(
                "to_xarray needs all rows of a finished sweep, at most 1e8; use lazy()."
            )
        plan, frame = self.plan, self.lazy().collect()
        axes: dict[str, Any] = {
            variable.value: frame[variable.value].unique(maintain_order=True).to_numpy()
            for variable in plan.grid
        }
        dimensions, sizes = list(axes), [len(values) for values in axes.values()]
        if plan.sampled:
            dimensions, sizes = [*dimensions, "point"], [*sizes, -1]

        def column(name: str) -> np.ndarray:
            return frame[name].to_numpy().reshape(sizes)

        code = frame["code"].cast(str).to_numpy().reshape(sizes).astype(str)
        values: dict[str, Any] = {name: (dimensions, column(name)) for name in self.columns}
        values["code"] = dimensions, code
        for variable in plan.sampled:
            values[variable.value] = ["point"], column(variable.value)[(0,) * len(axes)]
        attributes = {"sweep": plan.name, "robot": self.robot.name}
        return xarray.Dataset(values, coords=axes, attrs=attributes)

    def worst(self, column: str, *, largest: bool = True) -> DataFrame:
        """Return the rows with the largest values of a kept quantity, or with the smallest.

        Args:
            column: Name of the quantity, as in `columns`.
            largest: Whether the largest are meant.

        Raises:
            InputError: There is no such quantity.
        """
        sketch = self._sketch(column)
        pairs = (sketch.largest if largest else sketch.smallest)[: self.plan.output.extremes]
        rows = self._rows([row for _, row in pairs])
        return rows.sort(column, descending=largest, maintain_order=True)

    def first_failures(self) -> DataFrame:
        """Return the first rows without a result."""
        return self._rows(self.failures)

    def quantiles(self, column: str, parts: Sequence[float] | None = None) -> list[float]:
        """Return quantiles of a kept quantity, exact to 1/1000 of half the range of most values.

        Args:
            column: Name of the quantity, as in `columns`.
            parts: Numbers between 0 and 1; those of the plan if None.
        """
        levels = self.plan.output.quantiles if parts is None else parts
        return [self._sketch(column).quantile(part) for part in levels]

    def histogram(self, column: str, bins: int | None = None) -> tuple[list[float], list[int]]:
        """Return edges and counts of a histogram of a kept quantity.

        Args:
            column: Name of the quantity, as in `columns`.
            bins: Number of bins; that of the plan if None.
        """
        return self._sketch(column).histogram(self.plan.output.bins if bins is None else bins)

    def _sketch(self, name: str) -> Sketch:
        if name not in self.sketches:
            raise InputError.UNKNOWN_NAME(
                f'no quantity "{name}" is kept{nearest(name, self.columns)}; there are '
                f"{', '.join(self.columns)}."
            )
        return self.sketches[name]

    def _rows(self, rows: Sequence[int]) -> DataFrame:
        """Read rows by their numbers, from the pieces that hold them."""
        import polars

        size = self.manifest.document["piece"]
        pieces = sorted({row // size for row in rows}) or self.pieces[:1]
        frame = polars.concat([self._piece(piece) for piece in pieces])
        return frame.filter(polars.col("row").is_in(list(rows))).collect()

    def document(self) -> dict[str, Any]:
        """Return what is summed up of all rows, as plain values."""
        columns: dict[str, Any] = {}
        for name, sketch in self.sketches.items():
            mean, sd = sketch.moments
            smallest, largest = sketch.ends
            edges, counts = self.histogram(name)
            levels = [f"{part:g}" for part in self.plan.output.quantiles]
            columns[name] = {
                "count": sketch.count,
                "mean": mean,
                "sd": sd,
                "smallest": smallest,
                "largest": largest,
                "quantiles": dict(zip(levels, self.quantiles(name), strict=True)),
                "histogram": {"edges": edges, "counts": counts},
            }
        return {
            "name": self.plan.name,
            "program": "notchflex",
            "version": self.manifest.document["versions"]["notchflex"],
            "robot": self.robot.name,
            "rows": self.rows,
            "pieces": len(self.pieces),
            "finished": self.finished,
            "codes": self.counts,
            "first_failures": self.failures,
            "columns": columns,
        }

    def _summary(self) -> Summary:
        done = "" if self.finished else f" of {self.manifest.rows}"
        title = f"Sweep {self.plan.name}: {self.rows}{done} rows"
        rows = [(code, str(count)) for code, count in self.counts.items() if count]
        for name, sketch in self.sketches.items():
            if sketch.count:
                rows.append((name, " to ".join(map(short, sketch.ends))))
        return Summary(title, rows, ".lazy() is a frame of polars, .to_xarray() a data set")


def read_sweep(directory: AnyPath) -> Sweep:
    """Read a sweep, which may be unfinished.

    Args:
        directory: Its folder.

    Returns:
        The sweep: `lazy` and `to_xarray` are its rows.

    Raises:
        InputError: It is not a folder of a sweep, its `sweep.json` was changed, or polars is not
            installed.
    """
    need("polars", "data", "read_sweep")
    manifest = Manifest.read(directory, KIND)
    content = manifest.document
    try:
        robot = from_table(content["robot"])
        plan = made(SweepPlan, {**content["plan"], "robot": robot.name})
        sketches = {str(name): Sketch() for name in content["columns"]}
    except (InputError, LookupError, TypeError, AttributeError):
        raise damaged(Path(directory, "sweep.json")) from None
    pieces: list[int] = []
    codes = np.zeros(len(CODES), int)
    failures: list[int] = []
    keep = max(plan.output.extremes, 1)
    for head in heads(directory, manifest):
        pieces.append(head["piece"])
        codes += head["codes"]
        failures += head["failures"][: plan.output.failures - len(failures)]
        add_to(sketches, head, keep)
    counts: dict[str, int] = dict(zip(CODES, codes.tolist(), strict=True))
    return Sweep(Path(directory), manifest, plan, robot, tuple(pieces), counts, failures, sketches)


Columns = dict[str, Float[np.ndarray, " k"]]
"""Numbers of rows by name."""

_MAX_LATIN = 20_000_000
"""A Latin hypercube is made whole: so many numbers fit into memory beside all else."""

_SAMPLE = 1024
"""Rows from all over a sweep, from which the scales of its statistics come."""


def _ends(variable: SweepVariable) -> tuple[float, float]:
    """Return the least and the greatest value of a variable."""
    values = variable.values or (variable.lower, variable.upper)
    return min(values), max(values)  # pyright: ignore


def numbers_between(plan: SweepPlan, start: int, stop: int) -> Columns:
    """Return the numbers of rows by name; points change fastest, then the last axis of the grid.

    Args:
        plan: The plan.
        start: First row, from 0.
        stop: The row behind the last one.
    """
    each = 1 if plan.sampling is None else plan.sampling.points
    places, points = np.divmod(np.arange(start, stop), each)
    if each <= len(points):  # all points, more than once
        return _numbers(plan, places, _levels(plan, 0, each)[points])
    turns = np.flatnonzero(np.diff(points) < 0) + 1  # where the sequence begins anew
    parts = [_levels(plan, int(part[0]), int(part[-1]) + 1) for part in np.split(points, turns)]
    return _numbers(plan, places, np.concatenate(parts))


def _sample(plan: SweepPlan) -> Columns:
    """Return the numbers of some rows: the first points, at places all over the grid."""
    each = 1 if plan.sampling is None else plan.sampling.points
    count = min(4 * _SAMPLE, plan.rows)
    places = np.random.default_rng(0).integers(0, plan.rows // each, count)
    levels = _levels(plan, 0, min(count, each))
    step = max(count // _SAMPLE, 1)
    return _numbers(plan, places[::step], levels[np.arange(count) % len(levels)][::step])


def _numbers(
    plan: SweepPlan, places: Int[np.ndarray, " k"], levels: Float[np.ndarray, "k d"]
) -> Columns:
    """Return numbers by name at places of the grid and sampled levels."""
    numbers: dict[str, np.ndarray] = {}
    for variable in plan.grid[::-1]:
        spaced = np.geomspace if variable.spacing == "log" else np.linspace
        values: Any = variable.values or spaced(variable.lower, variable.upper, variable.count)  # pyright: ignore
        values = np.array(values)
        places, place = np.divmod(places, len(values))
        numbers[variable.value] = values[place]
    for variable, level in zip(plan.sampled, levels.T, strict=False):
        low, high = _ends(variable)
        is_log = variable.spacing == "log"
        values = low * (high / low) ** level if is_log else low + (high - low) * level
        numbers[variable.value] = np.clip(values, low, high)
    return {variable.value: numbers[variable.value] for variable in plan.variable}


def _levels(plan: SweepPlan, start: int, stop: int) -> Float[np.ndarray, "k d"]:
    """Return sampled points, between 0 and 1."""
    sampling, dimension = plan.sampling, len(plan.sampled)
    if sampling is None:
        return np.zeros((stop - start, 0))
    if sampling.method == "latin-hypercube":
        return _latin(sampling, dimension)[start:stop]
    return sobol_points(dimension, sampling.seed, start, stop, sampling.points)


@lru_cache(maxsize=1)
def _latin(sampling: Sampling, dimension: int) -> Float[np.ndarray, "k d"]:
    if sampling.points * dimension > _MAX_LATIN:
        raise InputError.OUT_OF_RANGE(
            f"a Latin hypercube is made whole, and {sampling.points} points of {dimension} "
            f"variables are more than {_MAX_LATIN} numbers; take fewer points, or method = "
            '"sobol".'
        )
    engine = qmc.LatinHypercube(dimension, rng=np.random.default_rng(sampling.seed))  # pyright: ignore
    return engine.random(sampling.points)


def _middle(plan: SweepPlan, robot: Robot) -> Robot:
    """Return the robot in the middle of the ranges.

    Raises:
        InputError: It has no such number, or the numbers make no valid robot.
    """
    try:
        return robot.with_values({one.value: 0.5 * sum(_ends(one)) for one in plan.variable})
    except InputError as problem:
        message = f"in the middle of all variables there must be a valid robot: {problem}"
        invalid = problem.code is ErrorCode.INVALID_ROBOT
        raise type(problem)(message if invalid else str(problem), problem.code) from None


@dataclass(frozen=True, eq=False)
class SweepTask(PieceTask):
    """The robots of a sweep, in pieces.

    Attributes:
        plan: The plan.
        robot: The robot that is varied.
    """

    plan: SweepPlan
    robot: Robot

    @cached_property
    def study(self) -> Study:
        """The robot under its loads, and the numbers that are kept.

        Raises:
            InputError: The robot has no such number, load, quantity or entry.
        """
        plan, base = self.plan, _middle(self.plan, self.robot.replace(tolerance=None))
        for variable in plan.variable:
            number_at(base, variable.value)
        loads = {name: read_load(table, name, base) for name, table in plan.load.items()}
        paths = {
            name: simulate(base, load, refinement=plan.refinement) for name, load in loads.items()
        }
        criteria: dict[str, Criterion] = {}
        for number, kept in enumerate(plan.keep, start=1):
            with placed(f"`keep[{number}]`"):
                for entry in limited_numbers(kept.in_python, paths):
                    if entry.name in criteria:
                        raise InputError.CONFLICT(f"{entry.name} is kept twice; keep it once.")
                    criteria[entry.name] = entry
        return Study(base, (), paths, tuple(criteria.values()), None, plan.refinement, 1)

    @cached_property
    def columns(self) -> list[str]:
        """Names of the columns of the kept numbers: `notch_angle_3_deg_at_pulled_step_2`."""
        columns, has_load = list[str](), len(self.study.paths) > 1
        for one in self.study.criteria:
            words = [one.quantity.name, *entry_names(one.quantity.per, one.index)]
            words.append(one.quantity.unit.replace(" ", ""))
            words.append(f"at_{one.load}" if has_load else "")
            words.append(f"step_{one.step + 1}" if "step " in one.name else "")
            columns.append("_".join(filter(None, words)))
        return columns

    @cached_property
    def manifest(self) -> Manifest:
        """All that the bytes of pieces depend on."""
        table, rows = plan_table(self.plan), self.plan.rows
        del table["robot"]
        return Manifest.of(
            KIND,
            rows,
            self.plan.piece or piece_rows(rows, self.study),
            plan=table,
            robot=to_table(self.robot),
            columns=self.columns,
        )

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """Scales of the statistics of every column."""
        columns, _ = self._solved(_sample(self.plan))
        return {name: scale_of(values) for name, values in columns.items()}

    def _solved(
        self, numbers: Mapping[str, Float[np.ndarray, " k"]]
    ) -> tuple[Columns, Int[np.ndarray, " k"]]:
        """Solve robots; return columns in the units of files, NaN where there is no result."""
        values, codes = self.study.solved(numbers, len(next(iter(numbers.values()))))
        scales = np.array([criterion.quantity.scale for criterion in self.study.criteria])
        columns = np.ascontiguousarray((values * scales).T)
        return dict(zip(self.columns, columns, strict=True)), codes

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Solve the robots of one piece."""
        import polars

        start, stop = self.manifest.between(number)
        numbers = numbers_between(self.plan, start, stop)
        columns, codes = self._solved(numbers)
        output, without = self.plan.output, np.flatnonzero(codes >= FAILED)
        failures = (without[: output.failures] + start).tolist()
        keep = max(output.extremes, 1)
        head = summed_up(columns, codes, start, self.scales, keep, failures=failures)
        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(codes)
        named = {**numbers, "code": code, **columns}
        frame = polars.DataFrame(named, nan_to_null=True)
        if not output.rows:
            rows = set(failures)
            for column in head["columns"].values():
                rows |= {row for _, row in column["smallest"] + column["largest"]}
            chosen = np.array(sorted(rows), np.int64)
            frame = frame[chosen - start].insert_column(0, polars.Series("row", chosen))
        return frame, head


def sweep(
    plan: SweepPlan | Mapping[str, Any] | AnyPath,
    directory: AnyPath,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    part: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> Sweep:
    """Solve many robots that differ by a few numbers, and keep the results as files.

    A sweep is cut into pieces, and each piece is one file. A sweep that was stopped resumes where
    it was. The files do not depend on who works on the pieces, and in which order.

    Args:
        plan: The plan, or the file that holds it; or its tables, as in the file.
        directory: The folder of the sweep; it is made if it is missing.
        workers: Number of processes of this machine; threads of this process if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.
        part: Only this part of the pieces, such as (7, 100): the seventh of a hundred.
        progress: Called with rows done, rows in all, rows without a result, and rows done by
            earlier calls.

    Returns:
        The sweep, as `read_sweep` reads it.

    Raises:
        InputError: The plan cannot be used, or the folder holds another sweep, is being written by
            another process, or takes no more files.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> table = {
        ...     "robot": "pacheco2021-a",
        ...     "variable": [{"value": "notch.depth", "lower": 1.36, "upper": 1.42, "count": 7}],
        ...     "load": {"pulled": {"tension": 1.0}},
        ...     "keep": [{"quantity": "total_angle"}],
        ... }
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.sweep(table, folder).rows
        7
    """
    folder = PieceFolder(directory, workers, scheduler)
    if not isinstance(part, tuple) or len(part) != 2:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(f"part must be two numbers, such as (7, 100); got {part!r}")
    count = whole(part[1], "parts", 1, 10**9)
    first = whole(part[0], "part", 1, count)
    task = SweepTask(*with_robot(plan, SweepPlan, "plan file"))
    check_target(directory, KIND, "-o", [plan] if isinstance(plan, str | Path) else [])
    with threadpool_limits(1):  # more threads may give other last digits
        number = task.manifest.pieces
        assert task.scales  # all threads need them
    pieces = range((first - 1) * number // count, first * number // count)
    folder.run(task, pieces=pieces, progress=progress)
    result = read_sweep(directory)
    if result.finished:
        write_json(str(result.directory / "summary.json"), result.document())
    return result


_LONG = 1.0
"""Seconds: a shorter piece is timed once more, without what the first one prepares."""


class Estimate(NamedTuple):
    """Estimated size and time of a sweep.

    Attributes:
        rows: Its rows.
        pieces: Its pieces.
        piece_rows: Rows of a piece.
        workers: Threads or processes.
        row_seconds: Time of one row on one core, s.
        seconds: Time of the sweep, s.
        bytes: Size of its files.
        free: Free space where the sweep would be written from, in bytes.
        solved: Rows that were solved for this.
        unsolved: How many of them have no result.
    """

    rows: int
    pieces: int
    piece_rows: int
    workers: int
    row_seconds: float
    seconds: float
    bytes: float
    free: int
    solved: int
    unsolved: int


def estimate(plan: SweepPlan | AnyPath, *, workers: int | None = None) -> Estimate:
    """Solve the first piece of a sweep, and estimate its whole time and size; nothing is written.

    Args:
        plan: The plan, or the file that holds it.
        workers: As for `sweep`.
    """
    need("polars", "data", "sweep")
    task = SweepTask(*with_robot(plan, SweepPlan, "plan file"))
    manifest = task.manifest
    data, head, taken = memoryview(b""), dict[str, Any](), 0.0
    for _ in range(2):
        if taken < _LONG:
            start = time.perf_counter()
            data, head = encoded(task, 0)
            taken = time.perf_counter() - start
    solved = manifest.between(0)[1]
    cores = min(workers or number_of_cores(), manifest.pieces)
    more = manifest.rows / solved if task.plan.output.rows else manifest.pieces
    return Estimate(
        rows=manifest.rows,
        pieces=manifest.pieces,
        piece_rows=manifest.document["piece"],
        workers=cores,
        row_seconds=taken / solved,
        seconds=taken / solved * manifest.rows / cores,
        bytes=len(data) * more,
        free=shutil.disk_usage(".").free,
        solved=solved,
        unsolved=sum(head["codes"][FAILED:]),
    )
