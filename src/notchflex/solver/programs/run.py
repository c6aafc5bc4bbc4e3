"""The compiled programs: a path of loads with memory, or many loads each from rest.

Compiled once for a form (kinds of flexures, modes, tendons and laws); a new load or a new robot of
the same form runs the same program. The number of loads is known only when a program is called, and
chains are lengthened to one of few numbers of flexures (`capacity.py`). Derived quantities of the
states are another program, run when they are asked for.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import Solved, advance
from notchflex.solver.derived.quantities import Shape, of_own, quantities, shape
from notchflex.solver.derived.solved_state import notch_lips
from notchflex.solver.newton import Settings
from notchflex.solver.programs.capacity import lengthen, places_within
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.prepare import Prepared
from notchflex.solver.programs.pytree_layout import Form, lane_sizes
from notchflex.solver.programs.static_structure import KnownForm
from notchflex.solver.residual import evaluate
from notchflex.solver.stability import stability, stable

# Beside states and shape: residual, iterations, converged, tried, reached, parts, part before.
_TOLD = 7


class Run:
    """States of many loads, loads as leading axis."""

    def __init__(
        self,
        prepared: Prepared,
        start: np.ndarray,
        table: np.ndarray,
        from_start: Bool[np.ndarray, " s"],
    ) -> None:
        """Take what the program returned for the long chain, and which loads began at the start."""
        self._prepared, self.first, self._table = prepared, start, table
        self.from_start = from_start

    def _told(self, number: int) -> np.ndarray:
        return self._table[:, number - _TOLD]

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

    @cached_property
    def states(self) -> Float[np.ndarray, "s state"]:
        """The last solved state at each load, packed: its own, or as far as it was followed."""
        return self._own_state(0)

    @cached_property
    def states_before(self) -> Float[np.ndarray, "s state"]:
        """The state before each load, packed."""
        last = np.concatenate([self.first[None], self.states[:-1]])
        return np.where(self.from_start[:, None], self.first, last)

    @cached_property
    def between(self) -> Float[np.ndarray, "s state"]:
        """The state before the last part of the way to each load, packed."""
        return self._own_state(self._prepared.long.state.size)

    def _own_state(self, start: int) -> Float[np.ndarray, "s state"]:
        own, long = self._prepared.state, self._prepared.long.state
        return self._table[:, start + places_within(own, long)]

    @cached_property
    def solved(self) -> Solved:
        """The same, unpacked."""
        return self._prepared.state.unpack(self.states)

    @cached_property
    def _more(self) -> dict[str, np.ndarray]:
        """What is reported of the state before the first load and of each state, by name."""
        own, long = self._prepared, self._prepared.long
        rows = lengthen(np.concatenate([self.first[None], self.states]), own.state, long.state)
        given = (np.zeros(1), long.known_vector, rows, long.known_form, long.state)
        every = _quantities.along((False, False, True), *given)
        return {name: of_own(own.chain, name, values) for name, values in every.items()}

    def quantity(self, name: str) -> np.ndarray:
        """What is reported of each state, by its name in the registry."""
        if name not in Shape._fields:
            return self._more[name][1:]
        long = self._prepared.long
        packed = self._table[:, 2 * long.state.size : -_TOLD]
        values = long.shape.leaf(packed, Shape._fields.index(name))
        return of_own(self._prepared.chain, name, values)

    def before(self, name: str) -> np.ndarray:
        """A quantity of the state before the first load; of the shape only tension and stroke."""
        if name not in ("tension", "stroke"):
            return self._more[name][0]
        start: Solved = self._prepared.state.unpack(self.first)
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
    each_from_start: bool | Bool[np.ndarray, " s"],
) -> Run:
    """Follow loads, each from the state before or each from the same one.

    Args:
        prepared: The robot.
        commands: The loads, as leading axis.
        start: The state before the first; rest where None.
        settings: How hard to try.
        each_from_start: Whether every load starts from `start`, or which loads do.

    Returns:
        One entry per load.
    """
    long = prepared.long
    packed, form = prepared.long_commands(commands)
    forms = (long.known_form, form, long.state)
    first, start_row, carried = prepared.rest_vector, long.rest_vector, long.rest_carried
    if start is not None:
        first = np.asarray(prepared.state.pack(start))
        start_row = lengthen(first, prepared.state, long.state)
        carried = np.append(start_row, 1.0)
    from_start = np.broadcast_to(each_from_start, len(packed))
    rows = (False, False, True, True, False, False)
    given = (carried, long.known_vector, packed, from_start[:, None].astype(float), start_row)
    table = _follow.along(rows, *given, _numbers(settings), *forms)
    return Run(prepared, first, table, from_start)


def lips(
    prepared: Prepared, commands: Command, start: Solved, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact forces (N) and gaps (mm) of all notches, each load from the same state.

    A small program beside `run`, for questions that are asked again and again: only whether the
    notches are closed, and no other quantity.

    Returns:
        Contact forces and gaps, loads by notches, and which loads converged.
    """
    long = prepared.long
    packed, form = prepared.long_commands(commands)
    forms = (long.known_form, form, long.state)
    before = lengthen(np.asarray(prepared.state.pack(start)), prepared.state, long.state)
    given = (np.zeros(1), long.known_vector, packed, before, np.array(settings.numbers))
    force, gap, converged = _lips.along((False, False, True, False, False), *given, *forms)
    own = prepared.chain.flexures
    return force[:, :own], gap[:, :own], converged


@native(5, lane_sizes)
def _lips(
    carried: Float[Array, " one"],
    vector: Float[Array, " chain"],
    load: Float[Array, " command"],
    start: Float[Array, " state"],
    numbers: Float[Array, " settings"],
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Contact forces and gaps of one load, and whether it converged; nothing is carried on."""
    chain, settings = chain_form.unpack(vector), Settings.of(numbers)
    came = advance(chain, command_form.unpack(load), state_form.unpack(start), settings)
    point = came.solved.point
    at = evaluate(
        chain, point.unknowns, came.solved.memory, point.base_tension, came.solved.applied
    )
    return carried, (*notch_lips(chain, point.unknowns, at), came.converged)


@lru_cache(maxsize=64)
def _numbers(settings: Settings) -> Float[np.ndarray, " settings"]:
    """The settings as an array, kept for the next time."""
    return np.array(settings.numbers)


@native(6, lane_sizes)
def _follow(
    carried: Float[Array, " state+1"],
    vector: Float[Array, " chain"],
    load: Float[Array, " command"],
    from_start: Float[Array, " 1"],
    start: Float[Array, " state"],
    numbers: Float[Array, " settings"],
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
) -> tuple[Float[Array, " state+1"], Float[Array, " told"]]:
    """The two states of a load, their shape, and how it went.

    Carried from load to load is the last solved state, and whether all loads since the start
    converged.
    """
    chain: Chain = chain_form.unpack(vector)
    settings = Settings.of(numbers)
    alive = (carried[-1] > 0.0) | (from_start[0] > 0.0)
    before = jnp.where(from_start[0] > 0.0, start, carried[:-1])

    def try_it() -> tuple[Array, Array, Array]:
        came = advance(chain, command_form.unpack(load), state_form.unpack(before), settings)
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

    solved, told, converged = jax.lax.cond(alive, try_it, skip)
    goes_on = jnp.where(alive & converged, 1.0, 0.0)
    return jnp.append(solved, goes_on), jnp.concatenate([solved, told])


@native(3, lane_sizes)
def _quantities(
    carried: Float[Array, " one"],
    vector: Float[Array, " chain"],
    state: Float[Array, " state"],
    chain_form: KnownForm,
    state_form: Form,
) -> tuple[Array, dict[str, Array]]:
    """What is reported of a state beyond its shape, by name; nothing is carried on."""
    return carried, quantities(chain_form.unpack(vector), state_form.unpack(state))
