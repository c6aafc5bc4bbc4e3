"""The compiled programs: a path of loads with history, or many loads each from rest.

A program is compiled once for a form (kinds of flexures, modes, tendons and laws); a new load or a
new robot of the same form runs the same program. The number of loads is an argument, and chains are
padded to one of few numbers of flexures (`static_structure.py`). Another program computes derived
quantities of the states on demand.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from lanewise import FixedVector
from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import LoadStepResult, solve_load_step
from notchflex.solver.held_stiffness import stability, stable
from notchflex.solver.newton import Settings
from notchflex.solver.programs.compiled import Native, Packed, runs_uncompiled, vectors_of
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import (
    PytreeLayout,
    pad_rows,
    padded_indices,
)
from notchflex.solver.quantities import Shape, quantities, shape, snapped_notches, unpad_quantity
from notchflex.solver.residual import SolverState, evaluate
from notchflex.solver.solved_state import notch_contact

# Columns behind the two states and the shape, see `_status`.
_STATUS = 8


def _column(number: int, kind: type = float) -> Any:
    """Make a property that returns a column of the status of every load."""

    def values(run: SolverRun) -> np.ndarray:
        return run.table[:, number - _STATUS].astype(kind, copy=False)

    return cached_property(values)


class SolverRun:
    """States of s loads, loads as leading axis, and how each was reached.

    Attributes:
        first: The state before the first load, packed.
        table: What the program returned, for the padded chain.
        from_start: 1 for loads that began at the state before the first, (s, 1).
        residual: Largest scaled residual of the last attempt.
        iterations: Newton iterations.
        converged: Whether the load was reached.
        tried: Whether it was tried at all; after a failure the rest of a path is not.
        reached: Fraction of the load step that was reached.
        substeps: Number of substeps that converged.
        fraction_before: Fraction of the load step at which the last of them began.
        overdrawn: Sum of 2**k over the tendons k, from 0, whose strokes no shape allows.
    """

    residual: Float[np.ndarray, " s"] = _column(0)
    iterations: Int[np.ndarray, " s"] = _column(1, int)
    converged: Bool[np.ndarray, " s"] = _column(2, bool)
    tried: Bool[np.ndarray, " s"] = _column(3, bool)
    reached: Float[np.ndarray, " s"] = _column(4)
    substeps: Int[np.ndarray, " s"] = _column(5, int)
    fraction_before: Float[np.ndarray, " s"] = _column(6)
    overdrawn: Int[np.ndarray, " s"] = _column(7, int)

    def __init__(
        self,
        prepared: PreparedChain,
        first: np.ndarray,
        table: np.ndarray,
        from_start: Float[np.ndarray, "s 1"],
    ) -> None:
        """Store the table that the program returned."""
        self._prepared, self.first, self.table = prepared, first, table
        self.from_start = from_start

    def rows(self, some: slice) -> SolverRun:
        """Return some of the loads, each with the state that it was solved from."""
        # Rows of loads that were not tried are empty: they repeat the last that was.
        last = np.maximum.accumulate(np.where(self.tried, np.arange(len(self.table)), 0))
        table, before = self.table[last[some]], self.states_before[some]
        table[:, -_STATUS:] = self.table[some, -_STATUS:]
        run = SolverRun(self._prepared, before[0], table, self.from_start[some])
        run.states_before = before
        return run

    @cached_property
    def states(self) -> Float[np.ndarray, "s state"]:
        """The last solved state at each load, packed: its own, or as far as it was followed."""
        return self._unpadded_state(0)

    @cached_property
    def states_before(self) -> Float[np.ndarray, "s state"]:
        """The state before each load, packed."""
        last = np.concatenate([self.first[None], self.states[:-1]])
        return np.where(self.from_start, self.first, last)

    @cached_property
    def between(self) -> Float[np.ndarray, "s state"]:
        """The state before the last substep of each load, packed."""
        return self._unpadded_state(self._prepared.long.state.size)

    def _unpadded_state(self, start: int) -> Float[np.ndarray, "s state"]:
        unpadded, long = self._prepared.state, self._prepared.long.state
        return self.table[:, start + padded_indices(unpadded, long)]

    @cached_property
    def solved(self) -> SolverState:
        """The states, unpacked."""
        return self._prepared.state.unpack(self.states)

    @cached_property
    def _derived(self) -> dict[str, np.ndarray]:
        """Derived quantities of the state before the first load and of each state, by name."""
        prepared = self._prepared
        states = prepared.packed_states(np.concatenate([self.first[None], self.states]))
        computed = _quantities.map(prepared.long.packed, states)
        return {
            name: unpad_quantity(prepared.chain, name, values) for name, values in computed.items()
        }

    def quantity(self, name: str) -> np.ndarray:
        """Return a quantity of each state, by its name in the registry."""
        if name not in Shape._fields:
            return self._derived[name][1:]
        unpadded, long, number = (
            self._prepared.shape,
            self._prepared.long,
            Shape._fields.index(name),
        )
        # Flexures that only fill the chain up come last in every quantity.
        shift = 2 * long.state.size + long.shape.ends[number] - unpadded.ends[number]
        return unpadded.leaf(self.table[:, shift:], number)

    def before(self, name: str) -> np.ndarray:
        """Return a quantity of the state before the first load: all but the shape of a solve."""
        start: SolverState = self._prepared.state.unpack(self.first)
        known = {
            "tension": start.tension,
            "stroke": start.stroke,
            "wire_stroke": start.wire_stroke,
            "material": start.memory.material,
        }
        return np.asarray(known[name]) if name in known else self._derived[name][0]

    @cached_property
    def snapped(self) -> Float[np.ndarray, "s n"]:
        """Notches that snapped shut (1) or open (-1) on the way to each state; 0 for the others."""
        prepared = self._prepared
        if prepared.chain.rods.section.ends is None:
            return np.zeros((len(self.table), prepared.chain.flexures))
        states = map(prepared.packed_states, (self.states_before, self.states))
        return _snapped.map(prepared.long.packed, *states)[:, : prepared.chain.flexures]

    def stability(self, commands: Command) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest real part of the eigenvalues, and the determinant's sign."""
        return stability(self._prepared, commands, self.solved)

    def stable(self, commands: Command) -> Bool[np.ndarray, " s"]:
        """Return whether each state is stable, at less cost than `stability`."""
        return stable(self._prepared, commands, self.solved)


def run(
    prepared: PreparedChain,
    commands: Command,
    start: SolverState | None,
    settings: Settings,
    *,
    each_from_start: bool | Bool[np.ndarray, " s"],
) -> SolverRun:
    """Solve loads from `start` or rest, each from the state before or each from `start`."""
    long = prepared.long
    loads = prepared.packed_commands(commands)
    first, start_row, carried = prepared.rest_vector, long.rest_vector, long.rest_carried
    if start is not None:
        first = np.asarray(prepared.state.pack(start))
        start_row = pad_rows(first, prepared.state, long.state)
        carried = np.append(start_row, 1.0)
    from_start = np.zeros((len(loads.numbers), 1))
    from_start[:, 0] = each_from_start
    arguments = (carried, long.packed, loads, Packed(from_start, None, True), start_row)
    arguments = (*arguments, _numbers(settings), long.state)
    compiled_for = loads.layout, runs_uncompiled()
    if compiled_for not in long.programs:
        long.programs[compiled_for] = _follow.bound("scan", *arguments)
    table = long.programs[compiled_for](vectors_of(arguments))
    return SolverRun(prepared, first, table, from_start)


@lru_cache(maxsize=64)
def _numbers(settings: Settings) -> FixedVector:
    """Return the settings as a vector."""
    return FixedVector(settings.numbers)


@Native
def _follow(
    carried: Float[Array, " state+1"],
    chain: Chain,
    command: Command,
    from_start: Float[Array, " 1"],
    start: Float[Array, " state"],
    numbers: Float[Array, " settings"],
    state_layout: PytreeLayout,
) -> tuple[Float[Array, " state+1"], Float[Array, " row"]]:
    """Solve one load; return both its states, their reported shape and the solver's status."""
    # The last solved state is carried from load to load, with a flag that all loads since the start
    # converged.
    settings = Settings.of(numbers)
    alive = (carried[-1] > 0.0) | (from_start[0] > 0.0)
    before = jnp.where(from_start[0] > 0.0, start, carried[:-1])

    def solve() -> tuple[Array, Array, Array]:
        result = solve_load_step(chain, command, state_layout.unpack(before), settings)
        form = shape(chain, result.solved)
        parts = [state_layout.pack(result.between), PytreeLayout.of(form).pack(form)]
        row = jnp.concatenate([*parts, _status(result)])
        return state_layout.pack(result.solved), row, result.converged

    def skip() -> tuple[Array, Array, Array]:
        rest = jnp.zeros(Shape.form(chain.flexures, chain.tendons).size + _STATUS)
        return before, jnp.concatenate([before, rest.at[-_STATUS].set(jnp.nan)]), alive

    solved, row, converged = jax.lax.cond(alive, solve, skip)
    goes_on = jnp.where(alive & converged, 1.0, 0.0)
    return jnp.append(solved, goes_on), jnp.concatenate([solved, row])


def _status(result: LoadStepResult) -> Float[Array, " status"]:
    """Return the solver's status, in the order of the columns of `SolverRun`."""
    status = [result.residual, result.iterations, result.converged, True, result.reached]
    powers = 2 ** jnp.arange(len(result.overdrawn))
    status += [result.substeps, result.fraction_before, jnp.sum(result.overdrawn * powers)]
    return jnp.stack([jnp.asarray(value, float) for value in status])


_quantities, _snapped = Native(quantities), Native(snapped_notches)


def solve_contacts(
    prepared: PreparedChain, commands: Command, start: SolverState, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find contact forces (N) and gaps (mm) of all notches, each load from the same state."""
    # A small program beside `run`, for searches that ask only whether the notches are closed.
    command, row = prepared.packed_commands(commands), prepared.state.pack(start)
    last = prepared.packed_states(np.asarray(row))._replace(by_row=False)
    force, gap, converged = _solve_contacts.map(
        prepared.long.packed, command, last, _numbers(settings)
    )
    flexures = prepared.chain.flexures
    return force[:, :flexures], gap[:, :flexures], converged


@Native
def _solve_contacts(
    chain: Chain, command: Command, last: SolverState, numbers: Float[Array, " settings"]
) -> tuple[Array, Array, Array]:
    """Compute contact forces and gaps of one load, and whether it converged."""
    result = solve_load_step(chain, command, last, Settings.of(numbers))
    point, memory, _, applied = result.solved
    evaluation = evaluate(chain, point, memory, applied)
    return (*notch_contact(chain, point.unknowns, evaluation), result.converged)
