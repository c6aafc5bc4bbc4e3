"""The compiled programs: a path of loads with memory, or many loads each from rest.

Compiled once for a form (number of flexures, modes and tendons, and which laws); a new load or a
new robot of the same form runs the same program. The number of loads is rounded up to one of few
sizes, so that it hardly ever asks for a new program; loads added so are skipped. What is asked of
the states beyond their shape is another program, run when it is asked for.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex._native import native
from notchflex.chain import Chain
from notchflex.statics.actuation import Command
from notchflex.statics.known import KnownForm
from notchflex.statics.newton import Settings
from notchflex.statics.packing import Form, lane_sizes
from notchflex.statics.prepare import Prepared
from notchflex.statics.quantities import Quantities, Shape, notch_lips, quantities, shape
from notchflex.statics.sizes import padded, size
from notchflex.statics.stability import stability, stable
from notchflex.statics.stepping import Solved, advance
from notchflex.statics.walk import evaluate

# Beside states and shape: residual, iterations, converged, tried, reached, parts, part before.
_TOLD = 7


class Run:
    """States of many loads, loads as leading axis."""

    def __init__(
        self, prepared: Prepared, start: np.ndarray, table: np.ndarray, count: int
    ) -> None:
        """Take what the program returned, of which the first rows count."""
        self._prepared, self._first, self._table, self._count = prepared, start, table, count

    def _told(self, number: int) -> np.ndarray:
        return self._table[: self._count, number - _TOLD]

    @cached_property
    def residual(self) -> Float[np.ndarray, " s"]:
        """Largest scaled imbalance of the last attempt."""
        return self._told(0)

    @cached_property
    def iterations(self) -> Int[np.ndarray, " s"]:
        """Newton iterations."""
        return self._told(1).astype(int)

    @cached_property
    def converged(self) -> Bool[np.ndarray, " s"]:
        """Whether the load was reached."""
        return self._told(2) != 0.0

    @cached_property
    def tried(self) -> Bool[np.ndarray, " s"]:
        """Whether it was tried at all; after a failure the rest of a path is not."""
        return self._told(3) != 0.0

    @cached_property
    def reached(self) -> Float[np.ndarray, " s"]:
        """Part of the way from the load before that was reached."""
        return self._told(4)

    @cached_property
    def parts(self) -> Int[np.ndarray, " s"]:
        """How many parts of that way were solved one after the other."""
        return self._told(5).astype(int)

    @cached_property
    def part_before(self) -> Float[np.ndarray, " s"]:
        """Part of the way at which the last of them began."""
        return self._told(6)

    @property
    def states(self) -> Float[np.ndarray, "s state"]:
        """The last solved state at each load, packed: its own, or as far as it was followed."""
        return self._table[: self._count, : self._prepared.state.size]

    @property
    def between(self) -> Float[np.ndarray, "s state"]:
        """The state before the last part of the way to each load, packed."""
        size = self._prepared.state.size
        return self._table[: self._count, size : 2 * size]

    @cached_property
    def solved(self) -> Solved:
        """The same, unpacked."""
        return self._prepared.state.unpack(self.states)

    @cached_property
    def _more(self) -> tuple[Quantities, Quantities]:
        """What is reported of each state, and of the one before the first."""
        states = self._table[:, : self._prepared.state.size]
        rows = np.concatenate([self._first[None], states])
        every = _quantities(
            self._prepared.known_vector,
            rows,
            np.array(1.0 + self._count),
            self._prepared.known_form,
            self._prepared.state,
        )
        return (
            jax.tree.map(lambda leaf: leaf[1 : 1 + self._count], every),
            jax.tree.map(lambda leaf: leaf[0], every),
        )

    def quantity(self, name: str) -> np.ndarray:
        """What is reported of each state, by its name in `Shape` or `Quantities`."""
        if name not in Shape._fields:
            return getattr(self._more[0], name)
        packed = self._table[: self._count, 2 * self._prepared.state.size : -_TOLD]
        return self._prepared.shape.leaf(packed, Shape._fields.index(name))

    def before(self, name: str) -> np.ndarray:
        """A quantity of the state before the first load; of the shape only tension and stroke."""
        if name not in ("tension", "stroke"):
            return np.asarray(getattr(self._more[1], name))
        start: Solved = self._prepared.state.unpack(self._first)
        return np.asarray(start.point.base_tension if name == "tension" else start.stroke)

    def stability(self, commands: Command) -> tuple[np.ndarray, np.ndarray]:
        """Smallest real part of the stiffness's eigenvalues and sign of the determinant."""
        return stability(self._prepared, commands, self.solved)

    def stable(self, commands: Command) -> Bool[np.ndarray, " s"]:
        """Whether each state is stable: what the two say, found at less cost."""
        return stable(self._prepared, commands, self.solved)


def run(
    prepared: Prepared,
    commands: Command,
    start: Solved | None,
    settings: Settings,
    *,
    each_from_start: bool,
) -> Run:
    """Follow loads, each from the state before or each from the same one.

    Args:
        prepared: The robot.
        commands: The loads, as leading axis.
        start: The state before the first; rest where None.
        settings: How hard to try.
        each_from_start: Whether every load starts from `start`.

    Returns:
        One entry per load.
    """
    count = len(commands.value)
    form = prepared.command_form(commands)
    packed = form.pack(commands, leading=1)
    if count != size(count):
        packed = packed[padded(count)]
    options = _options(settings, each_from_start, count)
    forms = (prepared.known_form, form, prepared.state)
    first = prepared.rest_vector if start is None else np.asarray(prepared.state.pack(start))
    table = _follow(prepared.known_vector, packed, first, options, *forms)
    return Run(prepared, first, table, count)


def lips(
    prepared: Prepared, commands: Command, start: Solved, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact forces (N) and gaps (mm) of all notches, each load from the same state.

    A small program beside `run`, for questions that are asked again and again: only whether the
    notches are closed, and no other quantity.

    Returns:
        Contact forces and gaps, loads by notches, and which loads converged.
    """
    form = prepared.command_form(commands)
    given = (form.pack(commands, leading=1), np.asarray(prepared.state.pack(start)))
    forms = (prepared.known_form, form, prepared.state)
    return _lips(prepared.known_vector, *given, np.array(settings.numbers), *forms)


@native(4, lane_sizes)
def _lips(
    vector: Float[Array, " chain"],
    commands: Float[Array, "s command"],
    start: Float[Array, " state"],
    numbers: Float[Array, " settings"],
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
) -> tuple[Array, Array, Array]:
    chain, settings = chain_form.unpack(vector), Settings.of(numbers)
    before = state_form.unpack(start)

    def at_lips(packed: Array) -> tuple[Array, Array, Array]:
        came = advance(chain, command_form.unpack(packed), before, settings)
        point = came.solved.point
        at = evaluate(
            chain, point.unknowns, came.solved.memory, point.base_tension, came.solved.applied
        )
        force, gap = notch_lips(chain, point.unknowns, at)
        return force, gap, came.converged

    return jax.lax.map(at_lips, commands)


@lru_cache(maxsize=64)
def _options(
    settings: Settings, each_from_start: bool, count: int
) -> Float[np.ndarray, " options"]:
    """What is told to `_follow` beside robot, loads and start, kept for the next time."""
    return np.array([*settings.numbers, float(each_from_start), float(count)])


@native(4, lane_sizes)
def _follow(
    vector: Float[Array, " chain"],
    commands: Float[Array, "s command"],
    start: Float[Array, " state"],
    options: Float[Array, " options"],
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
) -> Float[Array, "s told"]:
    """The two states of every load, their shape, and how it went, a row per load."""
    chain: Chain = chain_form.unpack(vector)
    settings = Settings.of(options[:-2])
    each_from_start, count = options[-2] > 0.0, options[-1]

    def follow(state: tuple[Array, Array], item: tuple[Array, Array]) -> tuple[Any, Array]:
        last, alive = state
        packed, number = item
        before = jnp.where(each_from_start, start, last)
        tried = (number < count) & (alive | each_from_start)

        def try_it() -> tuple[Array, Array, Array]:
            came = advance(chain, command_form.unpack(packed), state_form.unpack(before), settings)
            told = [came.residual, came.iterations, came.converged, True, came.reached]
            told += [came.parts, came.part_before]
            found = shape(chain, came.solved)
            told = jnp.concatenate(
                [
                    state_form.pack(came.between),
                    Form.of(found).pack(found),
                    jnp.stack([jnp.asarray(x, float) for x in told]),
                ]
            )
            return state_form.pack(came.solved), told, came.converged

        def skip() -> tuple[Array, Array, Array]:
            told = jnp.zeros(Shape.form(chain.flexures, chain.tendons).size + _TOLD)
            return before, jnp.concatenate([before, told.at[-_TOLD].set(jnp.nan)]), alive

        solved, told, converged = jax.lax.cond(tried, try_it, skip)
        return (solved, alive & converged), jnp.concatenate([solved, told])

    numbers = jnp.arange(len(commands), dtype=float)
    return jax.lax.scan(follow, (start, jnp.array(True)), (commands, numbers))[1]


@native(3, lane_sizes)
def _quantities(
    vector: Float[Array, " chain"],
    states: Float[Array, "s state"],
    count: Float[Array, ""],
    chain_form: KnownForm,
    state_form: Form,
) -> Quantities:
    """What is reported of states beyond their shape; 0 for those that only fill up."""
    chain = chain_form.unpack(vector)

    def of_row(item: tuple[Array, Array]) -> Quantities:
        packed, number = item

        def told() -> Quantities:
            return quantities(chain, state_form.unpack(packed))

        nothing = jax.tree.map(jnp.zeros_like, jax.eval_shape(told))
        return jax.lax.cond(number < count, told, lambda: nothing)

    return jax.lax.map(of_row, (states, jnp.arange(len(states), dtype=float)))
