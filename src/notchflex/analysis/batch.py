"""Batches: many robots or many loads at once, in pieces that fit the cache.

A row of a batch is a robot and a path of loads; both may be one of several, with numbers of their
own. One program solves all rows of one form (equal numbers of notches, tendons and modes, the same
laws, the same kinds of loads), one row of numbers each. A batch is divided into pieces that the
cores take in turn, which bounds the memory. Where JAX has a GPU, whole pieces run there in
parallel.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, TypedDict, Unpack

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import ArrayLike

from lanewise import WIDTH
from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary, short
from notchflex._values import ByValue, frozen
from notchflex.analysis.outputs import (
    DEFAULT_OUTPUTS,
    LOADS,
    OUTPUTS,
    WORKS,
    Arrays,
    UnknownOutputError,
    check_outputs,
    follow_row,
)
from notchflex.analysis.solve import check_refinement, follow_path
from notchflex.analysis.varied import FEW, Chains, VariedRobots, prepare_kind, single_chains
from notchflex.errors import ConvergenceError, Failure, InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import LoadKind, acting, row_commands
from notchflex.loads.load import NO_VECTOR, check_integer, one_or_several, short_repr
from notchflex.loads.load_path import TENDONS, TIP, join_paths, load_path
from notchflex.results.path import EquilibriumPath
from notchflex.results.quantities import QUANTITIES, work_of_steps
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.compiled import Packed, number_of_cores, on_cores
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout

Rows = Int[np.ndarray, " k"]
"""Numbers of some rows."""

# Largest number of rows of a piece, by the number of rows.
_PIECE_SIZES = {0: 64, 512: 256, 8192: 2048}
_CONVERGES_ALONE = "solved alone this row converges; `path` of the batch returns it"


class Batch(ByValue, Displayed, Mapping[str, np.ndarray]):
    """Result of a batch: arrays by name, the rows of the batch as leading axis.

    Example:
        >>> from notchflex import batch, load_robot, pull
        >>> wrist = load_robot("pacheco2021-a")
        >>> found = batch(wrist, {"notch.depth": [1.39, 1.7]}, pull(0.0, 2.0, steps=3))
        >>> found["tip_position"].shape, found["converged"].tolist()
        ((2, 3, 3), [[True, True, True], [False, False, False]])
        >>> print(found.reason[1, 0].partition(";")[0])
        `notch[1].depth` is 1.7 mm
    """

    def __init__(self, arrays: Mapping[str, np.ndarray], rows: BatchRows | None = None) -> None:
        """Hold arrays by name, and the rows that they are of."""
        self._arrays = {name: frozen(values) for name, values in arrays.items()}
        self._rows = rows

    def _value(self) -> Any:
        return self._arrays

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one of the arrays."""
        if name not in self._arrays:
            raise UnknownOutputError(name, self._arrays)
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._arrays)

    def __len__(self) -> int:
        """Return the number of arrays."""
        return len(self._arrays)

    @property
    def valid(self) -> Bool[np.ndarray, " rows"]:
        """Whether the numbers of each row make a valid robot."""
        return self._known_rows.valid

    def path(self, row: int) -> EquilibriumPath:
        """Solve one row alone, for all that a path has.

        Args:
            row: Number of the row, from 0.

        Raises:
            InputError: Its numbers make no valid robot.
        """
        return self._known_rows.alone(row)

    @cached_property
    def reason(self) -> np.ndarray:
        """Why a row or step did not converge, in the shape of `converged`; empty where it did."""
        converged = self["converged"]
        reasons = np.full(converged.shape, "", object)
        table, states = (array.reshape(len(converged), -1) for array in (reasons, converged))
        for row in np.flatnonzero(~states.all(axis=1)).tolist():
            texts = [text for _, text in self._failures(row)]
            table[row] = np.where(states[row], "", texts)
        return frozen(reasons)

    def raise_if_failed(self) -> Batch:
        """Return itself, if every row converged.

        Raises:
            ConvergenceError: A row did not; the message says which and why.
        """
        converged = self["converged"]
        states = converged.reshape(len(converged), -1)
        if not states.all():
            row, step = divmod(int(np.argmin(states)), states.shape[1])
            failure, text = self._failures(row)[step]
            place = f"row {row + 1} of {len(states)}" + f", step {step + 1}" * (converged.ndim > 1)
            raise ConvergenceError(f"{place}: {text}", failure)
        return self

    def _failures(self, row: int) -> Sequence[tuple[Failure | None, str]]:
        """Return the failure of every step of a row, and a sentence on it."""
        try:
            failures = self.path(row).failures
        except InputError as error:
            return [(None, str(error))] * self["converged"][row].size
        return [(failure, text or _CONVERGES_ALONE) for failure, text in failures]

    @property
    def _known_rows(self) -> BatchRows:
        if self._rows is None:
            raise InputError.NO_DATA("this batch holds arrays alone, without robots and loads")
        return self._rows

    def _summary(self) -> Summary:
        count = len(next(iter(self.values()), ()))
        title = f"Batch of {count} row{'s' * (count != 1)}"
        rows = [(name, range_of(name, array)) for name, array in self.items()]
        return Summary(title, rows, "[name] is the array of one output; .reason, .path(row)")


def range_of(name: str, array: np.ndarray) -> str:
    """Describe an array by its shape, and what its values lie between; a number by itself."""
    unit = QUANTITIES[name].python_unit if name in QUANTITIES else ""
    if array.ndim == 0:
        return f"{array if array.dtype == bool else short(float(array))} {unit}".rstrip()
    shape = "×".join(map(str, array.shape))
    if array.dtype == bool:
        return f"{shape}, {int(array.sum())} of {array.size} true"
    if not np.isfinite(array).any():
        return f"{shape}, no number"
    ends = f"{short(float(np.nanmin(array)))} to {short(float(np.nanmax(array)))} {unit}"
    return f"{shape}, {ends}".rstrip()


class BatchOptions(TypedDict, total=False):
    """Further arguments of a batch; see `batch`."""

    outputs: Sequence[str]
    settings: Settings | None
    refinement: int
    cores: int | None
    progress: Callable[[int, int], None] | None


def batch(
    robots: Robot | Sequence[Robot],
    values: Mapping[str, ArrayLike],
    loads: Load | LoadPath | Sequence[Load] | Sequence[LoadPath],
    *,
    product: bool = False,
    **options: Unpack[BatchOptions],
) -> Batch:
    """Solve many robots and many loads at once, each from rest, on all cores.

    A row is a robot under a load, or along a path of loads with friction history. Of robots, of
    loads and of each named number there is one, for all rows, or one for each row. With `product`
    they are the axes of a grid, whose points are the rows: robots, then names in their order, then
    loads, the last of them fastest.

    Args:
        robots: A robot, or several, which may differ in everything.
        values: Numbers by name, rows as leading axis: numbers of robots, named as for
            `Robot.with_value`, in the units of the robot file; and of loads "tension" (N) and
            "stroke" (mm), where the loads command them, "tip_force" (N) and "tip_moment" (N mm),
            with tendons or components as last axis, and steps before it where they differ. One
            tension or stroke for each row is that of all tendons.
        loads: A `Load` or a `LoadPath`, or several, paths of equally many steps.
        product: Whether to solve all combinations.
        options: `outputs`, names of `EquilibriumPath` (fewer need less memory); `settings`,
            tolerance and limits of the solver; `refinement`, more strain modes, as for `simulate`;
            `cores`, the number of cores to use (all where not given); `progress`, called with the
            rows done and the rows of the whole batch.

    Returns:
        Arrays by name, rows and, of paths, steps as leading axes, in the world, and `converged`
        always. A row that did not converge, or whose numbers make no valid robot, holds NaN;
        `reason` says why.

    Raises:
        InputError: Unequal numbers of rows, no such name or output, invalid loads, or not one valid
            robot.

    Example:
        >>> from notchflex import Load, load_robot
        >>> wrist = load_robot("pacheco2021-a")
        >>> values = {"notch[2].depth": [1.38, 1.40], "tension": [0.5, 1.0, 1.5]}
        >>> found = batch(wrist, values, Load(tension=1.0), product=True)
        >>> np.degrees(found["total_angle"].reshape(2, 3)).round(1).tolist()
        [[25.5, 49.8, 106.5], [26.4, 51.5, 111.6]]
    """
    checked = _checked_robots(robots)
    message = "a batch needs a notchflex.Load or LoadPath, or some in order"
    listed = [loads] if isinstance(loads, Load) else one_or_several(loads, LoadPath, message)
    paths = [load_path(load, _tendons(checked)) for load in listed]
    if not paths or len({len(path) for path in paths}) > 1:
        raise InputError.WRONG_SHAPE("a batch needs one path or more, all of equally many steps")
    joined = LoadRows(paths[0] if len(paths) == 1 else join_paths(paths), len(paths[0]))
    single = all(isinstance(load, Load) for load in listed)
    return _solved(_rows(checked, values, joined, product, options), options, single)


def solve_batch(
    robots: Robot | Sequence[Robot],
    loads: Load | LoadPath | Sequence[Load],
    **options: Unpack[BatchOptions],
) -> Batch:
    """Solve many loads or many robots, each from rest.

    Args:
        robots: One robot, or one per row.
        loads: One load, or one per row (the steps of a `LoadPath` are loads of their own here).
        options: As for `batch`.

    Returns:
        As of `batch`, without an axis of steps.

    Raises:
        InputError: Robots and loads that are not one or equally many, no such output, or no core.

    Example:
        >>> from notchflex import load_robot, pull
        >>> found = solve_batch(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=100))
        >>> found["total_angle"].shape
        (100,)
    """
    checked = _checked_robots(robots)
    single_loads = LoadRows(load_path(loads, _tendons(checked)), 1)
    return _solved(_rows(checked, {}, single_loads, False, options), options, True)


def simulate_batch(
    robots: Robot | Sequence[Robot],
    loads: LoadPath | Sequence[LoadPath],
    **options: Unpack[BatchOptions],
) -> Batch:
    """Simulate many paths of loads, each with its own friction history.

    Args:
        robots: One robot, or one per row.
        loads: One path, or one per row, of equally many steps.
        options: As for `batch`.

    Returns:
        As of `batch`.

    Raises:
        InputError: Robots and paths that are not one or equally many, paths of unlike lengths, no
            such output, or no core.

    Example:
        >>> from notchflex import load_robot, pull
        >>> paths = [pull(0.0, top, steps=4).release() for top in (1.0, 2.0)]
        >>> simulate_batch(load_robot("pacheco2021-a"), paths)["total_angle"].shape
        (2, 8)
    """
    return batch(robots, {}, loads, **options)


def _checked_robots(robots: Any) -> list[Robot]:
    """Return the robots that a caller gives, checked."""
    message = "a batch needs a notchflex.Robot, or some of them"
    listed = one_or_several(robots, Robot, message)
    if not listed or not all(isinstance(robot, Robot) for robot in listed):
        raise InputError.WRONG_TYPE(f"{message}; got {short_repr(robots)}")
    return listed


def _tendons(robots: Sequence[Robot]) -> int:
    return max(robot.number_of_tendons for robot in robots)


def _rows(
    robots: Sequence[Robot],
    values: Mapping[str, ArrayLike],
    loads: LoadRows,
    product: bool,
    options: BatchOptions,
) -> BatchRows:
    """Return the rows of a batch."""
    columns = {"robots": np.arange(len(robots))}
    columns |= {name: _numbers(name, array) for name, array in values.items()}
    columns["loads"] = np.arange(len(loads))
    sizes = {name: len(column) for name, column in columns.items()}
    count, places = _places(sizes, product)

    def distinct(names: list[str]) -> tuple[np.ndarray, Arrays]:
        """Return which combination of some names each row has, and the numbers of each."""
        axes = {name: sizes[name] for name in names}
        number, combinations = _places(axes, product)
        numbers = {name: columns[name][index] for name, index in combinations.items()}
        if not product:
            return np.arange(count) % number, numbers
        index = [places[name] for name in names]
        return np.ravel_multi_index(index, tuple(axes.values())), numbers

    # No error: of several loads of a study some may leave the temperature to the robot.
    for warning in loads.load.replaced(values):
        warnings.warn(warning, stacklevel=3)
    of_loads = [name for name in values if name in LOADS]
    robot_of, of_robot = distinct(["robots", *(name for name in values if name not in LOADS)])
    path_of, of_path = distinct([*of_loads, "loads"])
    varied = VariedRobots(robots, of_robot.pop("robots"), of_robot)
    paths = loads.varied(of_path.pop("loads"), of_path)
    names = check_outputs(options.get("outputs", DEFAULT_OUTPUTS), (*OUTPUTS, *WORKS))
    outputs = tuple(dict.fromkeys([*names, "converged"]))
    check_refinement(refinement := options.get("refinement", 0))
    settings = options.get("settings") or DEFAULT
    return BatchRows(varied, paths, robot_of, path_of, outputs, settings, refinement)


def _numbers(name: str, values: ArrayLike) -> np.ndarray:
    """Return the numbers of a name as an array."""
    if name in ("robots", "loads"):
        raise InputError.UNKNOWN_NAME(f"`{name}` is no number of a robot or of a load")
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        numbers = np.zeros(())
    if numbers.ndim == 0 or (numbers.ndim > 1 and name not in LOADS):
        raise InputError.WRONG_SHAPE(
            f"`{name}` needs numbers, one for each row; got {short_repr(values)}"
        )
    if not np.isfinite(numbers).all() and name in LOADS:
        raise InputError.NOT_FINITE(f"`{name}` needs finite numbers; got {short_repr(values)}")
    return numbers


def _places(sizes: Mapping[str, int], product: bool) -> tuple[int, Arrays]:
    """Return the number of rows, and of everything that varies its place in each row."""
    if product:
        shape = tuple(sizes.values())
        count = math.prod(shape)
        places = np.unravel_index(np.arange(count), shape)
        return count, dict(zip(sizes, places, strict=True))
    count = max(sizes.values())
    if not set(sizes.values()) <= {1, count}:
        listed = " and ".join(f"{size} {name}" for name, size in sizes.items() if size != 1)
        raise InputError.WRONG_SHAPE(
            f"a batch needs equally many of all that varies, or one of it; got {listed}; "
            "product=True solves all combinations"
        )
    return count, {name: np.arange(count) % size for name, size in sizes.items()}


def number_of_threads(cores: int | None) -> int:
    """Return how many threads work, of the cores that a caller gives."""
    threads = number_of_cores() if cores is None else check_integer(cores, "cores")
    if threads < 1:
        raise InputError.OUT_OF_RANGE(f"cores must be 1 or more, or None for all; got {threads}")
    return threads


def _solved(rows: BatchRows, options: BatchOptions, single: bool) -> Batch:
    """Solve the rows of a batch; single loads have no axis of steps."""
    threads = number_of_threads(options.get("cores"))
    if not len(rows.robot_of):
        raise InputError.NO_DATA("a batch needs one row or more")
    if not rows.valid.any():
        raise next(iter(rows.robots.errors.values()))
    arrays = rows.solved(threads, rows.tables(), options.get("progress"))
    if single:
        arrays = {name: array[:, 0] for name, array in arrays.items()}
    return Batch(arrays, rows)


@dataclass(frozen=True, eq=False)
class LoadRows:
    """Paths of loads of equally many steps."""

    load: LoadPath  # all steps of all paths
    steps: int  # of each path
    tip: Float[np.ndarray, "s 6"] | None = None  # force and moment, if not those of `load`

    def __len__(self) -> int:
        """Return the number of paths."""
        return len(self.load) // self.steps

    def steps_of(self, paths: Rows) -> Int[np.ndarray, "k steps"]:
        """Return the steps of some paths."""
        return paths[:, None] * self.steps + np.arange(self.steps)

    def __getitem__(self, path: int) -> LoadPath:
        """Return one of the paths."""
        steps = self.steps_of(np.array([path]))[0]
        load = self.load[steps]
        if self.tip is None:
            return load
        return load.commanding(dict(zip(TIP, np.split(self.tip[steps], 2, axis=1), strict=True)))

    def varied(self, which: Int[np.ndarray, " n"], values: Mapping[str, np.ndarray]) -> LoadRows:
        """Return paths made of some of these and of numbers of their own by name."""
        if not values and np.array_equal(which, np.arange(len(self))):
            return self
        load = self.load[self.steps_of(which).ravel()]
        tables: Arrays = {}
        for name, numbers in values.items():
            present = load.numbers(name)
            shape = (len(numbers), self.steps, present.shape[1])
            steps = numbers if numbers.ndim > 2 else numbers.reshape(len(numbers), 1, -1)
            try:
                if name in TIP and steps.shape[2] != 3:
                    raise ValueError
                tables[name] = np.broadcast_to(steps, shape).reshape(present.shape)
            except ValueError:
                last = "3" if name in TIP else f"{shape[2]} tendons or 1"
                raise InputError.WRONG_SHAPE(
                    f"`{name}` needs rows by {last}, or rows by {self.steps} steps by {last}; "
                    f"got numbers of shape {numbers.shape}"
                ) from None
        load = load.commanding({name: tables[name] for name in TENDONS if name in tables})
        if not any(name in TIP for name in tables):
            return replace(self, load=load)
        tip = np.hstack([tables[name] if name in tables else load.numbers(name) for name in TIP])
        load = load.loaded(tip_force=NO_VECTOR, tip_moment=NO_VECTOR)
        return replace(self, load=load, tip=tip)


@dataclass(frozen=True, eq=False)
class BatchRows:
    """Rows of a batch: robots and paths of loads."""

    robots: VariedRobots
    loads: LoadRows
    robot_of: Int[np.ndarray, " rows"]  # number of the robot of each row
    path_of: Int[np.ndarray, " rows"]  # number of its path
    outputs: tuple[str, ...]
    settings: Settings
    refinement: int

    @cached_property
    def valid(self) -> Bool[np.ndarray, " rows"]:
        """Whether the numbers of each row make a valid robot."""
        return np.isin(self.robot_of, [*self.robots.errors], invert=True)

    def alone(self, row: int) -> EquilibriumPath:
        """Solve one row alone."""
        robot, load = self.robots[int(self.robot_of[row])], self.loads[int(self.path_of[row])]
        tendons = slice(robot.number_of_tendons)
        load = replace(load, tension=load.tension[:, tendons], stroke=load.stroke[:, tendons])
        return follow_path(robot, load, None, self.settings, self.refinement)

    def tables(self) -> Iterator[BatchTable]:
        """Yield the valid rows by their programs, which make the chains of many robots."""
        rows = np.flatnonzero(self.valid)
        if len(self.robots) > FEW:
            singly = [rows[:0]]
            for form in self.robots.forms(np.unique(self.robot_of[rows])):
                of_form = rows[np.isin(self.robot_of[rows], form.members)]
                for kind, part in self._by_kind(form.example, of_form):
                    many = len(np.unique(self.robot_of[part])) > FEW
                    chains = form.chains(kind, self.refinement) if many else None
                    if chains is None:
                        singly.append(part)
                    else:
                        yield BatchTable(self, part, chains, kind)
            rows = np.concatenate(singly)
        yield from self.one_by_one(rows)

    def _by_kind(self, robot: Robot, rows: Rows) -> Iterator[tuple[int, Int[np.ndarray, " m"]]]:
        """Yield what acts, and rows where it does: no row changes the modes of another."""
        loads, steps = self.loads, self.loads.steps_of(self.path_of[rows])
        kinds = np.bitwise_or.reduce(acting(loads.load, robot, steps, loads.tip), axis=1)
        for kind in np.unique(kinds).tolist():
            yield kind, rows[kinds == kind]

    def one_by_one(self, rows: Rows) -> Iterator[BatchTable]:
        """Yield rows whose robots are assembled in Python, by the structures of their chains."""
        groups: dict[Any, tuple[list[np.ndarray], dict[int, PreparedChain]]] = {}
        rows = rows[np.argsort(self.robot_of[rows], kind="stable")]
        numbers, first = np.unique(self.robot_of[rows], return_index=True)
        for number, of_robot in zip(numbers.tolist(), np.split(rows, first)[1:], strict=True):
            robot = self.robots[number]
            for kind, part in self._by_kind(robot, of_robot):
                ready = prepare_kind(robot, kind, self.refinement)
                parts, chains = groups.setdefault((ready.static_structure, kind), ([], {}))
                parts.append(part)
                chains[number] = ready
        for (_, kind), (parts, chains) in groups.items():
            yield BatchTable(self, np.sort(np.concatenate(parts)), single_chains(chains), kind)

    def solved(
        self,
        threads: int,
        tables: Iterable[BatchTable],
        progress: Callable[[int, int], None] | None = None,
    ) -> Arrays:
        """Solve the rows of tables, on several cores."""
        arrays: Arrays = {}
        count, done = len(self.robot_of), int((~self.valid).sum())
        work = [(table, rows) for table in tables for rows in table.pieces(threads)]
        solving = on_cores(lambda task: task[0].run(task[1]), work, threads)
        with closing(solving) as pieces:
            for (_, rows), piece in zip(work, pieces, strict=True):
                for name, values in piece.items():
                    # NaN where robots have fewer notches than others.
                    missing = np.nan if values.dtype.kind == "f" else 0
                    shape = count, *values.shape[1:]
                    array = arrays.get(name, np.full(shape, missing, values.dtype))
                    wider = np.maximum(array.shape, shape) - array.shape
                    if wider.any():
                        array = np.pad(
                            array, [(0, more) for more in wider], constant_values=missing
                        )
                    array[(rows, *map(slice, shape[1:]))] = values
                    arrays[name] = array
                done += len(rows)
                if progress is not None:
                    progress(done, count)
        return arrays


@dataclass(frozen=True, eq=False)
class BatchTable:
    """Rows of a batch that run through one program."""

    batch: BatchRows
    rows: Rows  # their numbers, ascending
    chains: Chains
    kind: int  # what acts, as bits; see `acting`

    def pieces(self, cores: int) -> Iterator[Int[np.ndarray, " m"]]:
        """Yield the rows of each call of the program: equal pieces, balanced over the cores."""
        count = len(self.rows)
        max_size = max(size for limit, size in _PIECE_SIZES.items() if count >= limit)
        rounds = -(-count // (max_size * cores))
        size = -(-count // (rounds * cores * WIDTH)) * WIDTH
        # Rows that run side by side take as long as the slowest: like loads are put together.
        loads = self.batch.loads
        largest = abs(loads.load.target).reshape(len(loads), -1).max(axis=1)
        rows = self.rows[np.argsort(largest[self.batch.path_of[self.rows]], kind="stable")]
        return (rows[start : start + size] for start in range(0, count, size))

    def run(self, rows: Int[np.ndarray, " m"]) -> Arrays:
        """Solve a piece of the rows: quantities in the world, NaN where they are not known."""
        batch = self.batch
        outputs, alike = self.solved(rows)
        if not alike.all():
            wrong = rows[~alike]
            alone = replace(batch, robot_of=batch.robot_of[wrong], path_of=batch.path_of[wrong])
            for name, values in alone.solved(1, alone.one_by_one(np.arange(len(wrong)))).items():
                outputs[name][~alike] = values
        return outputs

    def solved(self, rows: Rows) -> tuple[Arrays, Bool[np.ndarray, " k"]]:
        """Solve some rows: quantities as `run` returns them, and which rows are right."""
        names, turn = self.batch.outputs, self.batch.loads.load.base_to_world
        needed = (source for name in names for source in WORKS.get(name, (name,)))
        followed = self.followed(rows, (*dict.fromkeys(needed),))
        outputs: Arrays = {}
        for name in sorted(names):
            if name not in WORKS:
                outputs[name] = followed.outputs[name]
                continue
            # Since rest, where force and length are 0.
            force, length = (
                (np.concatenate([np.zeros_like(after[:, :1]), after[:, :-1]], axis=1), after)
                for after in (followed.outputs[quantity] for quantity in WORKS[name])
            )
            outputs[name] = np.cumsum(work_of_steps(force, length), axis=1)
        failed = ~outputs["converged"]
        for name, values in outputs.items():
            if name in REGISTERED and values.dtype.kind == "f":
                outputs[name] = REGISTERED[name].turned(values, turn)
                if failed.any():
                    outputs[name][failed] = np.nan
        return outputs, followed.alike

    def followed(self, rows: Rows, names: tuple[str, ...]) -> FollowedRows:
        """Follow the paths of some rows; report quantities in the frame of the base."""
        batch = self.batch
        chains, alike = self.chains.packed(batch.robot_of[rows])
        steps, bodies = batch.loads.steps_of(batch.path_of[rows]), self.chains.bodies(chains)
        load, tip = batch.loads.load, batch.loads.tip
        commands = row_commands(load, steps, bodies, tip, draws=bool(self.kind & LoadKind.DRAWN))
        layout = self.chains.ready.command_layout(commands)
        packed_commands = np.asarray(layout.pack(commands, leading=2))
        outputs = follow_row.rows(
            Packed(chains, self.chains.structure, chains.ndim == 2),
            Packed(packed_commands, layout, True),
            np.array(batch.settings.numbers),
            names,
        )
        return FollowedRows(chains, alike, packed_commands, layout, outputs)


class FollowedRows(NamedTuple):
    """Rows of a batch that were followed along their paths."""

    chains: np.ndarray  # packed; one where all have the same
    alike: Bool[np.ndarray, " k"]  # which of the chains are right
    commands: Float[np.ndarray, "k s command"]  # packed loads
    layout: PytreeLayout  # of one load
    outputs: Arrays
