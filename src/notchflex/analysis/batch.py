"""Batches: many robots or many loads at once, in pieces that fit the cache.

One program solves all robots of one form (equal numbers of notches, tendons and modes, the same
laws), one row of numbers each. A batch is divided into pieces that the cores take in turn, which
bounds the memory. Where JAX has a GPU, whole pieces run there in parallel.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from lanewise import WIDTH
from notchflex._jax import jax
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import (
    DEFAULT_OUTPUTS,
    OUTPUTS,
    WORKS,
    Batch,
    check_outputs,
    follow_row,
)
from notchflex.analysis.solve import prepare_for
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import (
    Command,
    follows,
    is_planar,
    is_unloaded,
    make_commands,
)
from notchflex.loads.load import (
    check_integer,
    one_or_several,
    short_repr,
)
from notchflex.loads.load_path import (
    join_paths,
    load_path,
)
from notchflex.mechanics.chain import Chain
from notchflex.results.quantities import work_of_steps
from notchflex.robot import Robot
from notchflex.robot.numbers import (
    VariedRobots,
    apart,
    parts_of,
    places_of,
)
from notchflex.robot.value_names import parse_path
from notchflex.solver.newton import (
    DEFAULT,
    Settings,
)
from notchflex.solver.programs.assembled import AssembledRobots
from notchflex.solver.programs.compiled import (
    number_of_cores,
    on_cores,
)
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, StaticStructure

# Chains and commands of robots that differ from one by a few numbers, as rows of a batch.

# Fewer robots are assembled in Python before programs for them are compiled.
_MIN_ROBOTS = 256


@dataclass(frozen=True, eq=False)
class VariedChains:
    """Chains and commands of varied robots, as the rows of a batch.

    Attributes:
        robots: The robots.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.
        ready: The chain of the robot that is varied.
        programs: Programs that make the chains.
        numbers: All numbers of every robot.
        command: Layout of one load.
    """

    robots: VariedRobots
    load: LoadPath
    refinement: int
    ready: PreparedChain
    programs: AssembledRobots
    numbers: Float[np.ndarray, "robots numbers"]
    command: PytreeLayout

    @property
    def structure(self) -> StaticStructure:
        """Layout of the chains for programs."""
        return self.programs.joined.structure

    def rows(self, index: slice) -> tuple[np.ndarray, np.ndarray, Int[np.ndarray, " m"]]:
        """Return chains and commands of some robots, packed for programs.

        Returns:
            Chains, commands (robots and then steps as leading axes), and which of the robots have
            a chain of another form: theirs are wrong.
        """
        chains, alike = self.programs.chains(self.numbers[index])
        commands = make_commands(self.load, self.robots.robot, self._bodies(chains))
        if commands.applied is None:
            packed = self.command.pack(commands, leading=1)[None].repeat(len(chains), axis=0)
        else:
            shape = (len(chains), *np.shape(commands.target))
            targets: list[Any] = [
                None if values is None else np.broadcast_to(values, shape)
                for values in (commands.target, commands.by_stroke)
            ]
            commands = Command(targets[0], targets[1], commands.applied)
            packed = self.command.pack(commands, leading=2)
        return chains, packed, np.flatnonzero(~alike)

    def _bodies(self, chains: Float[np.ndarray, "k chain"]) -> Chain:
        """Return the chain with the masses and lengths of the bodies of every robot."""
        form = self.structure.form
        indices: Chain = jax.tree.unflatten(form.structure, form.indices)
        names = ("body_length", "body_mass", "body_centre")
        values: dict[str, Any] = {
            name: chains[:, self.structure.indices_of(getattr(indices, name))] for name in names
        }
        return dataclasses.replace(self.ready.chain, **values)


def varied_chains(robots: VariedRobots, load: LoadPath, refinement: int) -> VariedChains | None:
    """Return chains of varied robots under one path of loads.

    Args:
        robots: The robots.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The chains; None where each robot is assembled by itself.
    """
    if len(robots) < _MIN_ROBOTS or not robots.valid().all():
        return None
    # Values of all notches come before those of one, as in a robot file.
    names = sorted(robots.names, key=lambda name: parse_path(name).number is not None)
    robot, programs, ready = _programs(robots.robot, (*names,), load, refinement)
    if programs is None:
        return None
    form = programs.form
    numbers = np.tile(form.numbers_of(parts_of(robot)), (len(robots), 1))
    for name in names:
        places = places_of(robot, name)
        if not set(places) <= set(form.places):  # a direction, or no finite number
            return None
        for place in places:
            numbers[:, form.places.index(place)] = robots.values[name]
    if programs.joined.structure.form is not ready.chain_layout:
        return None
    commands = make_commands(load, robot, ready.chain)
    command = ready.command_layout(commands)
    return VariedChains(robots, load, refinement, ready, programs, numbers, command)


@lru_cache(maxsize=8)
def _programs(
    robot: Robot, names: tuple[str, ...], load: LoadPath, refinement: int
) -> tuple[Robot, AssembledRobots | None, PreparedChain]:
    """Return the robot with a notch of its own for every name of one, and programs for others."""
    robot = apart(robot, names)
    ready = prepare_for(robot, load, None, refinement)
    varied = [place for name in names for place in places_of(robot, name)]
    return robot, AssembledRobots.tried(robot, ready.chain, varied), ready


# Largest number of rows of a piece, by the number of rows.
_PIECE_SIZES = {0: 64, 512: 256, 8192: 2048}


@dataclass(frozen=True)
class BatchRobots:
    """The robots of a batch.

    Attributes:
        every: One for all rows, or one per row.
        varied: The same as one robot with varied numbers, where the robots need not be built.
    """

    every: Sequence[Robot]
    varied: VariedRobots | None = None

    @classmethod
    def of(cls, robots: Any) -> BatchRobots:
        """Convert the robots that a caller gives."""
        if isinstance(robots, VariedRobots):
            return cls(robots, robots)
        message = "a batch needs a notchflex.Robot, or some of them"
        every = one_or_several(robots, Robot, message)
        if not every or not all(isinstance(robot, Robot) for robot in every):
            raise InputError.WRONG_TYPE(f"{message}; got {short_repr(robots)}")
        return cls(every)

    @property
    def max_tendons(self) -> int:
        """Largest number of tendons of a robot."""
        unlike = self.every if self.varied is None else [self.varied.robot]
        return max(robot.number_of_tendons for robot in unlike)


@dataclass(frozen=True)
class BatchRows:
    """Rows of a batch whose robots run through one program.

    Attributes:
        rows: Indices of these rows in the batch.
        chains: A row per robot, or one for all.
        commands: A row per path, or one for all, then the steps.
        layouts: Layouts of the chains and of one command, and names of the outputs.
        turn: Rotation from the base to the world; None for the identity.
    """

    rows: np.ndarray
    chains: Float[np.ndarray, "k chain"]
    commands: Float[np.ndarray, "k s command"]
    layouts: tuple[StaticStructure, PytreeLayout, tuple[str, ...]]
    turn: Float[np.ndarray, "3 3"] | None

    def pieces(self, cores: int) -> Iterator[slice]:
        """Return the rows of each call of the program: equal pieces, balanced over the cores."""
        rows = len(self.rows)
        max_size = max(size for limit, size in _PIECE_SIZES.items() if rows >= limit)
        each = -(-rows // (max_size * cores))
        size = -(-rows // (each * cores * WIDTH)) * WIDTH
        return (slice(start, min(start + size, rows)) for start in range(0, rows, size))

    def packed(self, index: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return chains of a piece of the rows (one if shared), commands, and which are wrong."""
        commands = self.commands[index]
        if len(self.commands) == 1:
            commands = np.repeat(self.commands, index.stop - index.start, axis=0)
        chains = self.chains[0] if len(self.chains) == 1 else self.chains[index]
        return chains, commands, np.zeros(0, int)

    def run(self, index: slice, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve a piece of the rows: quantities in the world, NaN where they are not known."""
        chains, commands, wrong = self.packed(index)
        by_row = (chains.ndim == 2, True, False)
        robot, command, names = self.layouts
        solved = tuple(dict.fromkeys(one for name in names for one in WORKS.get(name, (name,))))
        found = follow_row.rows(by_row, chains, commands, numbers, robot, command, solved)
        outputs = found | {name: _work(found, name) for name in names if name in WORKS}
        outputs = {name: outputs[name] for name in sorted(names)}
        failed = ~outputs["converged"]
        for name, values in outputs.items():
            if name in REGISTERED and values.dtype.kind == "f":
                outputs[name] = REGISTERED[name].turned(values, self.turn)
                if failed.any():
                    outputs[name][failed] = np.nan
        if len(wrong):
            for name, values in self.separately(wrong + index.start, numbers).items():
                outputs[name][wrong] = values
        return outputs

    def separately(self, rows: np.ndarray, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve rows whose chains are not of the form of the others."""
        raise NotImplementedError


def _work(found: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    """Return the work since rest, where force and length are 0, rows and steps as leading axes."""
    force, length = (
        (np.concatenate([np.zeros_like(after[:, :1]), after[:, :-1]], axis=1), after)
        for after in (found[one] for one in WORKS[name])
    )
    return np.cumsum(work_of_steps(force, length), axis=1)


@dataclass(frozen=True)
class VariedRows(BatchRows):
    """Rows whose robots differ by a few numbers: chains are computed piece by piece."""

    varied: VariedChains

    def packed(self, index: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return chains, commands and wrong ones of a piece of the rows."""
        return self.varied.rows(index)

    def separately(self, rows: np.ndarray, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve robots one by one."""
        robots, load = BatchRobots(self.varied.robots.take(rows)), self.varied.load
        tables = tables_of(robots, load, 1, len(rows), self.layouts[2], self.varied.refinement)
        return _solved(tables, len(rows), numbers, 1, None)


def missing_value(values: np.ndarray) -> float:
    """Return the value for missing entries: NaN, or 0 for integers and flags."""
    return np.nan if values.dtype.kind == "f" else 0


def tables_of(
    robots: BatchRobots,
    joined: LoadPath,
    paths: int,
    count: int,
    outputs: tuple[str, ...],
    refinement: int,
) -> Sequence[BatchRows]:
    """Return rows of a batch by the structure of their robots."""
    steps = len(joined) // paths
    if robots.varied is not None and paths == 1:
        varied = varied_chains(robots.varied, joined, refinement)
        if varied is not None:
            layouts, nothing = (varied.structure, varied.command, outputs), np.zeros((0, 0))
            form = np.arange(count), nothing, nothing, layouts, joined.base_to_world
            return [VariedRows(*form, varied)]
    groups: dict[Any, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {}
    for kind, rows, robot, part in _parts(robots.every, joined, paths):
        ready = prepare_for(robot, part, None, refinement)
        commands = make_commands(part, robot, ready.chain)
        layout = ready.command_layout(commands)
        packed = layout.pack(commands, leading=1).reshape(-1, steps, layout.size)
        group = groups.setdefault((ready.static_structure, layout, kind), [])
        group.append((rows, ready.dynamic_vector, packed))
    tables = []
    for (structure, layout, _), entries in groups.items():
        numbers, chains, commands = zip(*entries, strict=True)
        packed = np.stack(chains), np.concatenate(commands)
        layouts = structure, layout, outputs
        tables.append(BatchRows(np.concatenate(numbers), *packed, layouts, joined.base_to_world))
    return tables


def _parts(
    robots: Sequence[Robot], joined: LoadPath, paths: int
) -> Iterator[tuple[int, np.ndarray, Robot, LoadPath]]:
    """Return rows that are prepared together: what acts, their numbers, robot and loads.

    Rows of one robot are apart where other kinds of loads act: none changes another's modes.
    """
    steps = np.arange(len(joined)).reshape(paths, -1)
    if len(robots) > 1:
        for row, robot in enumerate(robots):
            yield 0, np.array([row]), robot, joined if paths == 1 else joined[steps[row]]
        return
    if len(joined.different) == 1 and not joined.draws:  # the usual case, of many rows
        yield 0, np.arange(paths), robots[0], joined
        return
    kinds = np.bitwise_or.reduce(_kinds(robots[0], joined).reshape(paths, -1), axis=1)
    for kind in np.unique(kinds).tolist():
        rows = np.flatnonzero(kinds == kind)
        part = joined if len(rows) == paths else joined[steps[rows].ravel()]
        yield kind, rows, robots[0], part


def _kinds(robot: Robot, load: LoadPath) -> Int[np.ndarray, " s"]:
    """Return what acts in each step, as bits: loads, across the plane, following, strokes."""
    alone = [replace(load[:1], external=(external,)) for external in load.different]
    acting = np.array(
        [
            (not is_unloaded(one)) + 2 * (not is_planar(one, robot)) + 4 * follows(one)
            for one in alone
        ]
    )
    return acting[load.which] + 8 * ~np.isnan(load.stroke).all(axis=1)


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
        cores: Number of cores to use; all where not given.
        progress: Called with the rows done and the rows of the whole batch.

    Returns:
        Arrays by name, rows as leading axis, in the world, and `converged` always. A row that did
        not converge holds NaN.

    Raises:
        InputError: Robots and loads that are not one or equally many, no such output, or no core.

    Example:
        >>> from notchflex import load_robot, pull
        >>> batch = solve_batch(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=100))
        >>> batch["total_angle"].shape
        (100,)
    """
    every = BatchRobots.of(robots)
    path = load_path(loads, every.max_tendons)
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
    """Simulate many paths of loads, each with its own friction history.

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
    every = BatchRobots.of(robots)
    tendons = every.max_tendons
    message = "simulate_batch needs a notchflex.LoadPath, or some in order"
    paths = [load_path(one, tendons) for one in one_or_several(loads, LoadPath, message)]
    if not paths or len({len(path) for path in paths}) > 1:
        raise InputError.WRONG_SHAPE("a batch needs one path or more, all of equally many steps")
    joined = paths[0] if len(paths) == 1 else join_paths(paths)
    common = (outputs, settings, refinement, cores, progress)
    return Batch(_simulate(every, joined, len(paths), *common))


def _simulate(
    robots: BatchRobots,
    joined: LoadPath,
    paths: int,
    outputs: Sequence[str],
    settings: Settings | None,
    refinement: int,
    cores: int | None,
    progress: Callable[[int, int], None] | None,
) -> dict[str, np.ndarray]:
    """Simulate paths, joined to one, each from rest."""
    names = with_converged(outputs)
    threads = number_of_threads(cores)
    given = len(robots.every)
    count = max(given, paths)
    if given not in (1, count) or paths not in (1, count):
        raise InputError.WRONG_SHAPE(
            "a batch needs as many robots as loads, or one of either; "
            f"got {given} robots and {paths} loads"
        )
    tables = tables_of(robots, joined, paths, count, names, refinement)
    return _solved(tables, count, np.array((settings or DEFAULT).numbers), threads, progress)


def number_of_threads(cores: int | None) -> int:
    """Return how many threads work, of the cores that a caller gives."""
    threads = number_of_cores() if cores is None else check_integer(cores, "cores")
    if threads < 1:
        raise InputError.OUT_OF_RANGE(f"cores must be 1 or more, or None for all; got {threads}")
    return threads


def _solved(
    tables: Sequence[BatchRows],
    count: int,
    numbers: Float[np.ndarray, " settings"],
    threads: int,
    progress: Callable[[int, int], None] | None,
) -> dict[str, np.ndarray]:
    """Solve all rows of tables, on several cores."""
    arrays: dict[str, np.ndarray] = {}
    done = 0
    work = [(table, index) for table in tables for index in table.pieces(threads)]
    solving = on_cores(lambda one: one[0].run(one[1], numbers), work, threads)
    with closing(solving) as pieces:
        for (table, index), piece in zip(work, pieces, strict=True):
            rows = table.rows[index]
            for name, values in piece.items():
                _store(arrays, name, rows, values, count)
            done += len(rows)
            if progress is not None:
                progress(done, count)
    return arrays


def with_converged(outputs: Sequence[str]) -> tuple[str, ...]:
    """Return the names of outputs, checked; `converged` is always among them."""
    return tuple(dict.fromkeys([*check_outputs(outputs, (*OUTPUTS, *WORKS)), "converged"]))


def _store(
    arrays: dict[str, np.ndarray], name: str, rows: np.ndarray, values: np.ndarray, count: int
) -> None:
    """Store the values of some rows; NaN where robots have fewer notches than others."""
    array = arrays.get(name, np.empty((count, *values.shape[1:]), values.dtype))
    shape = tuple(np.maximum(array.shape[1:], values.shape[1:]))
    if shape != array.shape[1:]:
        wider = [(0, 0), *((0, b - a) for a, b in zip(array.shape[1:], shape, strict=True))]
        array = np.pad(array, wider, constant_values=missing_value(values))
    first, last = int(rows[0]), int(rows[-1]) + 1
    where = rows if last - first > len(rows) else slice(first, last)
    if shape != values.shape[1:]:
        array[where] = missing_value(values)
    array[(where, *(slice(size) for size in values.shape[1:]))] = values
    arrays[name] = array
