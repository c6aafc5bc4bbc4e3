"""Runs a sweep, or what is left of it; estimates before it starts.

What a row gives depends on the plan alone: not on the process, on the rows before, or on cores.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from notchflex import ErrorCode, InputError, Robot, load_robot, simulate
from notchflex.pieces import (
    CODES,
    FAILED,
    Manifest,
    PieceFolder,
    PieceTask,
    Progress,
    Scale,
    check_target,
    encoded,
    scale_of,
    sobol_points,
    summed_up,
)
from notchflex.specification import Criterion, entry_names, limited_numbers, placed, read_load
from notchflex.support import (
    check_integer,
    need,
    number_at,
    number_of_cores,
    short_repr,
    to_table,
    write_json,
)
from notchflex.sweeping.plan import (
    Sampling,
    SweepPlan,
    SweepVariable,
    plan_from_table,
    plan_table,
    read_plan,
)
from notchflex.sweeping.result import KIND, Sweep, read_sweep
from notchflex.tolerancing import Study, piece_rows

if TYPE_CHECKING:
    from polars import DataFrame

_MAX_LATIN = 20_000_000
"""A Latin hypercube is made whole: so many numbers fit into memory beside all else."""

_SAMPLE = 1024
"""Rows from all over a sweep, from which the scales of its statistics come."""


def axis_values(variable: SweepVariable) -> Float[np.ndarray, " k"]:
    """Return the values of a variable of the grid."""
    if variable.values is not None:
        return np.array(variable.values)
    spaced = np.geomspace if variable.spacing == "log" else np.linspace
    return spaced(variable.lower, variable.upper, variable.count)  # pyright: ignore


def _ends(variable: SweepVariable) -> tuple[float, float]:
    """Return the least and the greatest value of a variable."""
    values = variable.values or (variable.lower, variable.upper)
    return min(values), max(values)  # pyright: ignore


def numbers_between(plan: SweepPlan, start: int, stop: int) -> dict[str, Float[np.ndarray, " k"]]:
    """Return the numbers of rows by name; points change fastest, then the last axis of the grid.

    Args:
        plan: The plan.
        start: First row, from 0.
        stop: The row behind the last one.
    """
    each = 1 if plan.sampling is None else plan.sampling.points
    places, points = np.divmod(np.arange(start, stop), each)
    if plan.sampling is None:
        return _numbers(plan, places, points)
    if each <= len(points):  # all points, more than once
        return _numbers(plan, places, _levels(plan, 0, each)[points])
    turns = np.flatnonzero(np.diff(points) < 0) + 1  # where the sequence begins anew
    parts = [_levels(plan, int(part[0]), int(part[-1]) + 1) for part in np.split(points, turns)]
    return _numbers(plan, places, np.concatenate(parts))


def _sample(plan: SweepPlan) -> dict[str, Float[np.ndarray, " k"]]:
    """Return the numbers of some rows: the first points, at places all over the grid."""
    each = 1 if plan.sampling is None else plan.sampling.points
    count = min(4 * _SAMPLE, plan.rows)
    places = np.random.default_rng(0).integers(0, plan.rows // each, count)
    levels = np.zeros((1, 0)) if plan.sampling is None else _levels(plan, 0, min(count, each))
    step = max(count // _SAMPLE, 1)
    return _numbers(plan, places[::step], levels[np.arange(count) % len(levels)][::step])


def _numbers(
    plan: SweepPlan, places: Int[np.ndarray, " k"], levels: Float[np.ndarray, "k d"]
) -> dict[str, Float[np.ndarray, " k"]]:
    """Return numbers by name at places of the grid and sampled levels."""
    numbers: dict[str, np.ndarray] = {}
    for variable in plan.grid[::-1]:
        values = axis_values(variable)
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
    assert sampling is not None
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


def _study_of(plan: SweepPlan, robot: Robot) -> Study:
    """Make the study of a plan.

    Raises:
        InputError: The robot has no such number, load, quantity or entry.
    """
    base = _middle(plan, robot.replace(tolerance=None))
    for variable in plan.variable:
        number_at(base, variable.value)
    loads = {name: read_load(table, name, base) for name, table in plan.load.items()}
    paths = {name: simulate(base, load, refinement=plan.refinement) for name, load in loads.items()}
    criteria: dict[str, Criterion] = {}
    for number, kept in enumerate(plan.keep, start=1):
        with placed(f"`keep[{number}]`"):
            for entry in limited_numbers(kept.in_python, paths):
                if entry.name in criteria:
                    raise InputError.CONFLICT(f"{entry.name} is kept twice; keep it once.")
                criteria[entry.name] = entry
    if not criteria:
        raise InputError.NO_DATA("no number is kept: the quantities have none for this robot.")
    return Study(base, (), paths, tuple(criteria.values()), None, plan.refinement, 1)


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


def _column_name(criterion: Criterion, has_load: bool) -> str:
    """Return the name of a column, such as `notch_angle_3_deg_at_pulled_step_2`."""
    words = [criterion.quantity.name, *entry_names(criterion.quantity.per, criterion.index)]
    words.append(criterion.quantity.unit.replace(" ", ""))
    words.append(f"at_{criterion.load}" if has_load else "")
    words.append(f"step_{criterion.step + 1}" if "step " in criterion.name else "")
    return "_".join(filter(None, words))


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
        """The robot under its loads, and the numbers that are kept."""
        return _study_of(self.plan, self.robot)

    @cached_property
    def columns(self) -> list[str]:
        """Names of the columns of the kept numbers."""
        has_load = len(self.study.paths) > 1
        return [_column_name(criterion, has_load) for criterion in self.study.criteria]

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
    ) -> tuple[dict[str, Float[np.ndarray, " k"]], Int[np.ndarray, " k"]]:
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
        frame = polars.DataFrame(named, nan_to_null=len(without) > 0)
        if not output.rows:
            rows = set(failures)
            for column in head["columns"].values():
                rows |= {row for _, row in column["smallest"] + column["largest"]}
            chosen = np.array(sorted(rows), np.int64)
            frame = frame[chosen - start].insert_column(0, polars.Series("row", chosen))
        return frame, head


def sweep(
    plan: SweepPlan | Mapping[str, Any] | str | os.PathLike[str],
    directory: str | os.PathLike[str],
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
    first, count = _checked_part(part)
    task = SweepTask(*_plan_and_robot(plan))
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


def _plan_and_robot(
    plan: SweepPlan | Mapping[str, Any] | str | os.PathLike[str],
) -> tuple[SweepPlan, Robot]:
    """Return a plan and the robot that it names.

    Raises:
        InputError: It is not a plan, or its file or its robot cannot be read.
    """
    if isinstance(plan, Mapping):
        plan = plan_from_table(plan)
    if isinstance(plan, SweepPlan):
        return plan, load_robot(plan.robot)
    if not isinstance(plan, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(
            f"a notchflex.SweepPlan is needed, or the path of a file; got {short_repr(plan)}"
        )
    return read_plan(plan)


def _checked_part(part: tuple[int, int]) -> tuple[int, int]:
    """Return which part of how many, checked.

    Raises:
        InputError: They are not two whole numbers, or not 1 <= part <= parts.
    """
    if not isinstance(part, tuple) or len(part) != 2:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError.WRONG_TYPE(f"part must be two numbers, such as (7, 100); got {part!r}")
    first, count = (check_integer(one, "part") for one in part)
    if not 1 <= first <= count <= 10**9:
        raise InputError.OUT_OF_RANGE(f"part {first} of {count}: give one from 1 to {count}.")
    return first, count


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


def estimate(plan: SweepPlan | str | os.PathLike[str], *, workers: int | None = None) -> Estimate:
    """Solve the first piece of a sweep, and estimate its whole time and size; nothing is written.

    Args:
        plan: The plan, or the file that holds it.
        workers: As for `sweep`.
    """
    need("polars", "data", "sweep")
    task = SweepTask(*_plan_and_robot(plan))
    manifest = task.manifest
    data, head, taken = _timed(task)
    if taken < _LONG:
        data, head, taken = _timed(task)
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


def _timed(task: SweepTask) -> tuple[memoryview, dict[str, Any], float]:
    """Return the bytes of the first piece, its head, and the seconds that it took."""
    start = time.perf_counter()
    data, head = encoded(task, 0)
    return data, head, time.perf_counter() - start
