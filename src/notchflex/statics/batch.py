"""Many robots, or many loads, at once: tables in, tables out, in pieces that fit the cache.

Robots of one form (as many notches, tendons and modes, the same laws) run through one program, a
row of numbers each. A batch is cut into pieces; the cores take one after the other, so that memory
is bounded whatever the batch.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jit, jnp
from notchflex.chain import Chain
from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.statics.given import shown
from notchflex.statics.load import Load, LoadPath, joined_paths, load_path
from notchflex.statics.newton import Settings
from notchflex.statics.packing import Form
from notchflex.statics.path import MODES_FAIL, command
from notchflex.statics.prepare import Prepared
from notchflex.statics.quantities import Quantities, Shape, quantities, shape, total_angle
from notchflex.statics.solve import prepared_for
from notchflex.statics.stepping import Solved, advance, at_rest

DEFAULT_OUTPUTS = ("total_angle", "tip_position", "tip_rotation", "converged")
OUTPUTS = (
    *DEFAULT_OUTPUTS,
    "residual",
    "iterations",
    *(name for name in Shape._fields if name not in ("tip_position", "friction_holds")),
    *Quantities._fields,
)
"""What can be asked of a batch."""

# Rows of a piece, and rows of it that are solved side by side.
_PIECE, _SIDE_BY_SIDE = 1024, 64
_SMALL = 64


class Batch(Mapping[str, np.ndarray]):
    """What a batch returned: arrays by name, the rows of the batch as leading axis.

    Example:
        >>> from notchflex import load_robot, pull
        >>> found = solve_batch(load_robot("pacheco2021-a"), pull(0.0, 2.0, steps=3))
        >>> found["tip_position"].shape, bool(found["converged"].all())
        ((3, 3), True)
    """

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        """Hold arrays by name."""
        self._arrays = arrays

    def __getitem__(self, name: str) -> np.ndarray:
        """One of the arrays."""
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._arrays)

    def __len__(self) -> int:
        """How many arrays there are."""
        return len(self._arrays)

    def __repr__(self) -> str:
        """Names and shapes."""
        shapes = ", ".join(f"{name}: {array.shape}" for name, array in self._arrays.items())
        return f"Batch({shapes})"


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
        outputs: What to return, by names of `Path`; fewer names are less memory.
        settings: How hard the solver tries.
        refinement: More strain modes, as for `solve`.
        cores: How many cores to use; all where not given.
        progress: Called with the rows done and the rows of the whole batch.

    Returns:
        Arrays by name, rows as leading axis. A row that did not converge says so in `converged`
        and holds the last good state.

    Raises:
        InputError: Robots and loads that are not one or equally many, or no such output.

    Example:
        >>> from notchflex import load_robot, pull
        >>> found = solve_batch(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=100))
        >>> found["total_angle"].shape
        (100,)
    """
    every = _robots(robots)
    path = load_path(loads, max(robot.number_of_tendons for robot in every))
    found = _simulate(every, path, len(path), outputs, settings, refinement, cores, progress)
    return Batch({name: array[:, 0] for name, array in found.items()})


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
    """Follow many paths of loads, each with a memory of its own.

    Args:
        robots: One robot, or one per row.
        loads: One path, or one per row, of equally many steps.
        outputs: What to return, by names of `Path`; fewer names are less memory.
        settings: How hard the solver tries.
        refinement: More strain modes, as for `simulate`.
        cores: How many cores to use; all where not given.
        progress: Called with the rows done and the rows of the whole batch.

    Returns:
        Arrays by name, rows and then steps as leading axes.

    Raises:
        InputError: Robots and paths that are not one or equally many, paths of unlike lengths, or
            no such output.

    Example:
        >>> from notchflex import load_robot, pull
        >>> paths = [pull(0.0, top, steps=4).release() for top in (1.0, 2.0)]
        >>> simulate_batch(load_robot("pacheco2021-a"), paths)["total_angle"].shape
        (2, 8)
    """
    every = _robots(robots)
    tendons = max(robot.number_of_tendons for robot in every)
    given = [loads] if isinstance(loads, LoadPath) else list(loads)
    paths = [load_path(one, tendons) for one in given]
    if not paths or len({len(path) for path in paths}) > 1:
        raise InputError("a batch needs one path or more, all of equally many steps")
    joined = paths[0] if len(paths) == 1 else joined_paths(paths)
    rows = len(paths)
    return Batch(_simulate(every, joined, rows, outputs, settings, refinement, cores, progress))


def _robots(robots: Any) -> list[Robot]:
    every = [robots] if isinstance(robots, Robot) else list(robots)
    if not every or not all(isinstance(robot, Robot) for robot in every):
        raise InputError(f"a batch needs a notchflex.Robot, or some of them; got {shown(robots)}")
    return every


def _simulate(
    robots: list[Robot],
    joined: LoadPath,
    paths: int,
    outputs: Sequence[str],
    settings: Settings | None,
    refinement: int,
    cores: int | None,
    progress: Callable[[int, int], None] | None,
) -> dict[str, np.ndarray]:
    """Follow paths, given one after the other as a long one, each from rest."""
    wrong = [name for name in outputs if name not in OUTPUTS]
    if wrong:
        raise InputError(f"a batch has no output {wrong[0]!r}; there are {', '.join(OUTPUTS)}")
    count = max(len(robots), paths)
    if len(robots) not in (1, count) or paths not in (1, count):
        raise InputError(
            "a batch needs as many robots as loads, or one of either; "
            f"got {len(robots)} robots and {paths} loads"
        )
    numbers = np.array([*(settings or Settings()).numbers])
    found: dict[str, np.ndarray] = {}
    done = 0
    with ThreadPoolExecutor(cores or os.cpu_count() or 1) as pool:
        work = [
            (table.rows[start : start + _PIECE], pool.submit(table.run, start, numbers))
            for table in _tables(robots, joined, paths, count, tuple(outputs), refinement)
            for start in range(0, len(table.rows), _PIECE)
        ]
        for rows, piece in work:
            for name, values in piece.result().items():
                _put(found, name, rows, values, count)
            done += len(rows)
            if progress is not None:
                progress(done, count)
    return found


def _put(
    found: dict[str, np.ndarray], name: str, rows: np.ndarray, values: np.ndarray, count: int
) -> None:
    """Put the values of some rows where they belong; robots with fewer notches leave NaN."""
    if name not in found:
        found[name] = np.zeros((count, *values.shape[1:]), values.dtype)
        if values.dtype == float:
            found[name].fill(np.nan)
    shape = tuple(np.maximum(found[name].shape[1:], values.shape[1:]))
    if shape != found[name].shape[1:]:
        wider = [(0, 0), *((0, b - a) for a, b in zip(found[name].shape[1:], shape, strict=True))]
        found[name] = np.pad(found[name], wider, constant_values=np.nan)
    found[name][(rows, *(slice(size) for size in values.shape[1:]))] = values


@dataclass(frozen=True)
class _Table:
    """Rows of a batch whose robots have one form.

    Attributes:
        ready: One of the robots.
        rows: Which rows of the batch these are.
        chains: A row per robot, or one for all.
        commands: A row per path, or one for all, then the steps.
        outputs: What is asked.
    """

    ready: Prepared
    rows: np.ndarray
    chains: Float[np.ndarray, "k chain"]
    commands: Float[np.ndarray, "k s command"]
    outputs: tuple[str, ...]

    def run(self, start: int, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Solve a piece of the rows."""
        size = _PIECE if len(self.rows) > _SMALL else _SMALL
        count = min(size, len(self.rows) - start)
        index = start + np.minimum(np.arange(size), count - 1)
        commands = self.commands[index if len(self.commands) > 1 else np.zeros_like(index)]
        one_robot = len(self.chains) == 1
        chains = self.ready.vector if one_robot else self.chains[index]
        forms = (self.ready.chain_form, self.ready.command, self.ready.state, self.outputs)
        came = _follow_all(chains, commands, numbers, *forms, one_robot)
        return {name: np.asarray(values)[:count] for name, values in came.items()}


def _tables(
    robots: list[Robot],
    joined: LoadPath,
    paths: int,
    count: int,
    outputs: tuple[str, ...],
    refinement: int,
) -> list[_Table]:
    """The rows of a batch by the form of their robots."""
    steps = len(joined) // paths

    def packed(robot: Robot, ready: Prepared, path: LoadPath) -> np.ndarray:
        command_of = ready.command.pack(command(path, robot, ready.chain), leading=1)
        return command_of.reshape(-1, steps, ready.command.size)

    if len(robots) == 1:
        ready = prepared_for(robots[0], joined, None, refinement)
        commands = packed(robots[0], ready, joined)
        chains = np.asarray(ready.vector)[None]
        return [_Table(ready, np.arange(count), chains, commands, outputs)]
    by_form: dict[Form, tuple[Prepared, list[int], list[np.ndarray], list[np.ndarray]]] = {}
    for row, robot in enumerate(robots):
        # The modes that any of the loads asks for, so that rows share a program.
        ready = prepared_for(robot, joined, None, refinement)
        own = joined if paths == 1 else joined.part(row * steps, steps)
        _, rows, chains, commands = by_form.setdefault(ready.chain_form, (ready, [], [], []))
        rows.append(row)
        chains.append(np.asarray(ready.vector))
        commands.append(packed(robot, ready, own)[0])
    return [
        _Table(ready, np.array(rows), np.stack(chains), np.stack(commands), outputs)
        for ready, rows, chains, commands in by_form.values()
    ]


@partial(jit, static_argnums=(3, 4, 5, 6, 7))
def _follow_all(
    chains: Float[Array, "*b chain"],
    commands: Float[Array, "b s command"],
    numbers: Float[Array, " settings"],
    chain_form: Form,
    command_form: Form,
    state_form: Form,
    outputs: tuple[str, ...],
    one_robot: bool,
) -> dict[str, Array]:
    """Follow the paths of all rows, some rows side by side."""
    settings = Settings.of(numbers)

    def follow(chain_vector: Array, path: Array) -> dict[str, Array]:
        chain: Chain = chain_form.unpack(chain_vector)
        rest = at_rest(chain)

        def step(state: tuple[Solved, Array], packed: Array) -> tuple[Any, dict[str, Array]]:
            last, alive = state
            came = advance(chain, command_form.unpack(packed), last, settings)
            solved = jax.tree.map(lambda new, old: jnp.where(alive, new, old), came.solved, last)
            reached = alive & came.converged
            told = _told(chain, solved, outputs)
            converged = reached & told.pop("_holds")
            own = {"residual": came.residual, "iterations": came.iterations, "converged": converged}
            told |= {name: value for name, value in own.items() if name in outputs}
            return (solved, reached), told

        return jax.lax.scan(step, (rest, jnp.array(True)), path)[1]

    each = partial(follow, chains) if one_robot else follow
    tables = [
        values.reshape(-1, _SIDE_BY_SIDE, *values.shape[1:])
        for values in ((commands,) if one_robot else (chains, commands))
    ]
    found = jax.lax.map(lambda some: jax.vmap(each)(*some), tables)
    return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), found)


def _told(chain: Chain, solved: Solved, outputs: tuple[str, ...]) -> dict[str, Array]:
    """What is asked of a state, and whether it may be believed."""
    own = shape(chain, solved)
    last = own.body_rotation[-1]
    total = total_angle(chain.notch_frame, own.notch_angle, last)
    known = {**own._asdict(), "tip_rotation": last, "total_angle": total}
    if any(name in Quantities._fields for name in outputs):
        known |= quantities(chain, solved)._asdict()
    told = {name: known[name] for name in outputs if name in known}
    return told | {"_holds": own.friction_holds & (own.moment_error < MODES_FAIL)}


__all__ = ["DEFAULT_OUTPUTS", "OUTPUTS", "Batch", "simulate_batch", "solve_batch"]
