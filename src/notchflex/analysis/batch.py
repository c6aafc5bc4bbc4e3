"""Batches: many robots or many loads at once, in pieces that fit the cache.

Robots of one form (as many notches, tendons and modes, the same laws) run through one program, a
row of numbers each. A batch is cut into pieces; the cores take one after the other, so that memory
is bounded whatever the batch. Where JAX has a GPU they run there, whole pieces side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from threadpoolctl import threadpool_limits

from lanewise import WIDTH
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import (
    DEFAULT_OUTPUTS,
    Batch,
    check_outputs,
    follow_row,
)
from notchflex.analysis.solve import prepare_for
from notchflex.analysis.varied.varied_chains import VariedChains, varied_chains
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import make_commands, pad_commands
from notchflex.loads.load_path import join_paths, load_path
from notchflex.loads.validation import check_integer, one_or_several, short_repr
from notchflex.robot import Robot
from notchflex.robot.varied import VariedRobots
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.prepare import PreparedChain, pad_prepared
from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.programs.threads import number_of_cores, on_cores

# Rows of a piece at most, by how many rows there are.
_PIECES = {0: 64, 512: 256, 8192: 2048}


def solve_batch(
    robots: Robot | Sequence[Robot],
    loads: Load | LoadPath | Sequence[Load],
    *,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Batch:
    """Solve many loads or many robots, each from rest.

    Args:
        robots: One robot, or one per row.
        loads: One load, or one per row (the steps of a `LoadPath` are loads of their own here).
        outputs: What to return, by names of `EquilibriumPath`; fewer names need less memory.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.
        cores: How many cores to use; all where not given.
        progress: Called with the rows done and the rows of the whole batch.

    Returns:
        Arrays by name, rows as leading axis. A row that did not converge says so in `converged`
        and holds the last good state.

    Raises:
        InputError: Robots and loads that are not one or equally many, no such output, or no core.

    Example:
        >>> from notchflex import load_robot, pull
        >>> batch = solve_batch(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=100))
        >>> batch["total_angle"].shape
        (100,)
    """
    every = _Robots.of(robots)
    path = load_path(loads, every.most_tendons)
    arrays = _simulate(every, path, len(path), outputs, settings, refinement, cores, progress)
    return Batch({name: array[:, 0] for name, array in arrays.items()})


def simulate_batch(
    robots: Robot | Sequence[Robot],
    loads: LoadPath | Sequence[LoadPath],
    *,
    outputs: Sequence[str] = DEFAULT_OUTPUTS,
    settings: Settings | None = None,
    refinement: int = 0,
    cores: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Batch:
    """Follow many paths of loads, each with its own friction history.

    Args:
        robots: One robot, or one per row.
        loads: One path, or one per row, of equally many steps.
        outputs: What to return, as for `solve_batch`.
        settings: As for `solve_batch`.
        refinement: As for `solve_batch`.
        cores: As for `solve_batch`.
        progress: As for `solve_batch`.

    Returns:
        Arrays by name, rows and then steps as leading axes.

    Raises:
        InputError: Robots and paths that are not one or equally many, paths of unlike lengths, no
            such output, or no core.

    Example:
        >>> from notchflex import load_robot, pull
        >>> paths = [pull(0.0, top, steps=4).release() for top in (1.0, 2.0)]
        >>> simulate_batch(load_robot("pacheco2021-a"), paths)["total_angle"].shape
        (2, 8)
    """
    every = _Robots.of(robots)
    tendons = every.most_tendons
    message = "simulate_batch needs a notchflex.LoadPath, or some in order"
    paths = [load_path(one, tendons) for one in one_or_several(loads, LoadPath, message)]
    if not paths or len({len(path) for path in paths}) > 1:
        raise InputError.WRONG_SHAPE("a batch needs one path or more, all of equally many steps")
    joined = paths[0] if len(paths) == 1 else join_paths(paths)
    common = (outputs, settings, refinement, cores, progress)
    return Batch(_simulate(every, joined, len(paths), *common))


def simulate_varied(
    chains: VariedChains, *, outputs: Sequence[str], settings: Settings | None = None
) -> Batch:
    """Follow one path of loads with varied robots, in the calling thread.

    Args:
        chains: Chains of the robots under the path.
        outputs: As for `solve_batch`.
        settings: As for `solve_batch`.

    Returns:
        Arrays by name, rows and then steps as leading axes.
    """
    rows = _varied_rows(chains, len(chains.numbers), check_outputs(outputs))
    numbers = np.array((settings or DEFAULT).numbers)
    arrays: dict[str, np.ndarray] = {}
    for index in rows.pieces(1):
        for name, values in rows.run(index, numbers).items():
            _store(arrays, name, rows.rows[index], values, len(rows.rows))
    return Batch(arrays)


@dataclass(frozen=True)
class _Robots:
    """The robots of a batch.

    Attributes:
        every: One for all rows, or one per row.
        varied: The same where they are one robot with other numbers, which need not be made.
    """

    every: Sequence[Robot]
    varied: VariedRobots | None = None

    @classmethod
    def of(cls, robots: Any) -> _Robots:
        """Take what a caller gives for the robots of a batch."""
        if isinstance(robots, VariedRobots):
            return cls(robots, robots)
        message = "a batch needs a notchflex.Robot, or some of them"
        every = one_or_several(robots, Robot, message)
        if not every or not all(isinstance(robot, Robot) for robot in every):
            raise InputError.WRONG_TYPE(f"{message}; got {short_repr(robots)}")
        return cls(every)

    @property
    def most_tendons(self) -> int:
        """Number of tendons of the robot that has most."""
        unlike = self.every if self.varied is None else [self.varied.robot]
        return max(robot.number_of_tendons for robot in unlike)

    @property
    def threads(self) -> AbstractContextManager[Any]:
        """What limits threads while rows are solved.

        Every core has a piece of its own: a product of matrices, by which varied robots are found,
        is not to take the others too.
        """
        return nullcontext() if self.varied is None else threadpool_limits(1)


def _simulate(
    robots: _Robots,
    joined: LoadPath,
    paths: int,
    outputs: Sequence[str],
    settings: Settings | None,
    refinement: int,
    cores: int | None,
    progress: Callable[[int, int], None] | None,
) -> dict[str, np.ndarray]:
    """Follow paths, given one after the other as a long one, each from rest."""
    asked = check_outputs(outputs)
    threads = number_of_cores() if cores is None else check_integer(cores, "cores")
    if threads < 1:
        raise InputError.OUT_OF_RANGE(f"cores must be 1 or more, or None for all; got {threads}")
    given = len(robots.every)
    count = max(given, paths)
    if given not in (1, count) or paths not in (1, count):
        raise InputError.WRONG_SHAPE(
            "a batch needs as many robots as loads, or one of either; "
            f"got {given} robots and {paths} loads"
        )
    numbers = np.array((settings or DEFAULT).numbers)
    arrays: dict[str, np.ndarray] = {}
    done = 0
    work = [
        (table, index)
        for table in _tables(robots, joined, paths, count, asked, refinement)
        for index in table.pieces(threads)
    ]
    solving = on_cores(lambda one: one[0].run(one[1], numbers), work, threads)
    with robots.threads, closing(solving) as pieces:
        for (table, index), piece in zip(work, pieces, strict=True):
            rows = table.rows[index]
            for name, values in piece.items():
                _store(arrays, name, rows, values, count)
            done += len(rows)
            if progress is not None:
                progress(done, count)
    return arrays


def _store(
    arrays: dict[str, np.ndarray], name: str, rows: np.ndarray, values: np.ndarray, count: int
) -> None:
    """Store the values of some rows; NaN where robots have fewer notches than others."""
    array = arrays.get(name, np.empty((count, *values.shape[1:]), values.dtype))
    shape = tuple(np.maximum(array.shape[1:], values.shape[1:]))
    if shape != array.shape[1:]:
        wider = [(0, 0), *((0, b - a) for a, b in zip(array.shape[1:], shape, strict=True))]
        array = np.pad(array, wider, constant_values=_empty(values))
    first, last = int(rows[0]), int(rows[-1]) + 1
    where = rows if last - first > len(rows) else slice(first, last)
    if shape != values.shape[1:]:
        array[where] = _empty(values)
    array[(where, *(slice(size) for size in values.shape[1:]))] = values
    arrays[name] = array


@dataclass(frozen=True)
class _BatchRows:
    """Rows of a batch whose robots run through one program.

    Attributes:
        rows: Which rows of the batch these are.
        chains: A row per robot, or one for all.
        commands: A row per path, or one for all, then the steps.
        flexures: Number of flexures of each robot, by row, or one for all.
        layouts: Layouts of the chains and of one command, and names of the outputs.
    """

    rows: np.ndarray
    chains: Float[np.ndarray, "k chain"]
    commands: Float[np.ndarray, "k s command"]
    flexures: Int[np.ndarray, " k"]
    layouts: tuple[StaticStructure, PytreeLayout, tuple[str, ...]]

    def pieces(self, cores: int) -> Iterator[slice]:
        """Rows that are solved in one call of the program: pieces alike, as many for each core."""
        rows = len(self.rows)
        most = max(size for least, size in _PIECES.items() if rows >= least)
        each = -(-rows // (most * cores))
        size = -(-rows // (each * cores * WIDTH)) * WIDTH
        return (slice(start, min(start + size, rows)) for start in range(0, rows, size))

    def packed(
        self, index: slice
    ) -> tuple[Float[np.ndarray, "*k chain"], Float[np.ndarray, "k s command"]]:
        """Chains of a piece of the rows, one alone if they share it, and their commands."""
        commands = self.commands[index]
        if len(self.commands) == 1:
            commands = np.repeat(self.commands, index.stop - index.start, axis=0)
        return self.chains[0] if len(self.chains) == 1 else self.chains[index], commands

    def run(self, index: slice, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve a piece of the rows."""
        chains, commands = self.packed(index)
        by_row = (chains.ndim == 2, True, False)
        outputs = follow_row.rows(by_row, chains, commands, numbers, *self.layouts)
        flexures = self.flexures[index] if len(self.flexures) > 1 else self.flexures
        return {name: _unpad(name, values, flexures) for name, values in outputs.items()}


@dataclass(frozen=True)
class _VariedRows(_BatchRows):
    """Rows whose robots differ by a few numbers: chains are worked out piece by piece."""

    varied: VariedChains

    def packed(self, index: slice) -> tuple[np.ndarray, np.ndarray]:
        """Chains and commands of a piece of the rows."""
        return self.varied.rows(index)


def _varied_rows(varied: VariedChains, count: int, outputs: tuple[str, ...]) -> _VariedRows:
    layouts = (varied.structure, varied.command, outputs)
    flexures = np.array([varied.ready.chain.flexures])
    nothing = np.zeros((0, 0))
    return _VariedRows(np.arange(count), nothing, nothing, flexures, layouts, varied)


def _unpad(name: str, values: np.ndarray, flexures: Int[np.ndarray, " rows"]) -> np.ndarray:
    """Values by flexure or body, empty where a robot has none, rows and steps as leading axes."""
    along = REGISTERED[name].per[:1]
    count = flexures + (along == ("body",))
    if along in (("notch",), ("body",)) and (count < values.shape[2]).any():
        beyond = np.arange(values.shape[2]) >= count[:, None]
        values[np.broadcast_to(beyond[:, None], values.shape[:3])] = _empty(values)
    return values


def _empty(values: np.ndarray) -> float:
    """What stands where a robot has no number: NaN, or 0 in whole numbers and flags."""
    return np.nan if values.dtype.kind == "f" else 0


def _tables(
    robots: _Robots,
    joined: LoadPath,
    paths: int,
    count: int,
    outputs: tuple[str, ...],
    refinement: int,
) -> Sequence[_BatchRows]:
    """The rows of a batch by the layout of their robots, shorter ones padded to the longest."""
    steps = len(joined) // paths
    if robots.varied is not None and paths == 1:
        varied = varied_chains(robots.varied, joined, refinement)
        if varied is not None:
            return [_varied_rows(varied, count, outputs)]
    # The modes that any of the loads asks for, so that rows share a program.
    every = [prepare_for(robot, joined, None, refinement) for robot in robots.every]
    flexures = max(ready.chain.flexures for ready in every)
    edges = max(ready.chain.contacts.shape[1] for ready in every)
    by_stroke = not np.isnan(joined.stroke).all()
    groups: dict[Any, list[tuple[int, PreparedChain, np.ndarray]]] = {}
    for row, (robot, unpadded) in enumerate(zip(robots.every, every, strict=True)):
        part = joined if len(robots.every) == 1 or paths == 1 else joined.part(row * steps, steps)
        commands = pad_commands(make_commands(part, robot, unpadded.chain), flexures, by_stroke)
        ready = pad_prepared(unpadded, flexures, edges)
        layout = ready.command_layout(commands)
        packed = layout.pack(commands, leading=1).reshape(-1, steps, layout.size)
        groups.setdefault((ready.chain_layout, layout), []).append((row, ready, packed))
    tables = []
    for (chain_layout, layout), entries in groups.items():
        numbers, prepared, commands = zip(*entries, strict=True)
        rows = np.arange(count) if len(robots.every) == 1 else np.array(numbers)
        vectors = np.stack([ready.vector for ready in prepared])
        structure = StaticStructure.of(chain_layout, [ready.chain for ready in prepared], vectors)
        counts = np.array([every[number].chain.flexures for number in numbers])
        chains, loads = structure.pack(vectors), np.concatenate(commands)
        tables.append(_BatchRows(rows, chains, loads, counts, (structure, layout, outputs)))
    return tables
