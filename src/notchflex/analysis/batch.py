"""Batches: many robots or many loads at once, in pieces that fit the cache.

One program solves all robots of one form (equal numbers of notches, tendons and modes, the same
laws), one row of numbers each. A batch is divided into pieces that the cores take in turn, which
bounds the memory. Where JAX has a GPU, whole pieces run there in parallel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing

import numpy as np

from notchflex.analysis.batch_rows import BatchRobots, missing_value, tables_of, varied_rows
from notchflex.analysis.outputs import (
    DEFAULT_OUTPUTS,
    Batch,
    check_outputs,
)
from notchflex.analysis.varied.varied_chains import VariedChains
from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.load_path import join_paths, load_path
from notchflex.loads.validation import check_integer, one_or_several
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.threads import number_of_cores, on_cores


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


def simulate_varied(
    chains: VariedChains, *, outputs: Sequence[str], settings: Settings | None = None
) -> Batch:
    """Simulate one path of loads with varied robots, in the calling thread.

    Args:
        chains: Chains of the robots under the path.
        outputs: As for `solve_batch`.
        settings: As for `solve_batch`.

    Returns:
        Arrays by name, rows and then steps as leading axes.
    """
    rows = varied_rows(chains, len(chains.numbers), check_outputs(outputs))
    numbers = np.array((settings or DEFAULT).numbers)
    arrays: dict[str, np.ndarray] = {}
    for index in rows.pieces(1):
        for name, values in rows.run(index, numbers).items():
            _store(arrays, name, rows.rows[index], values, len(rows.rows))
    return Batch(arrays)


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
        for table in tables_of(robots, joined, paths, count, asked, refinement)
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
        array = np.pad(array, wider, constant_values=missing_value(values))
    first, last = int(rows[0]), int(rows[-1]) + 1
    where = rows if last - first > len(rows) else slice(first, last)
    if shape != values.shape[1:]:
        array[where] = missing_value(values)
    array[(where, *(slice(size) for size in values.shape[1:]))] = values
    arrays[name] = array
