"""How the states of a solved path change with the numbers they were found from.

One compiled program follows one direction of change along the path, through the memory of the
contacts (forward derivatives by the implicit function theorem, `solver/sensitivity.py`). Jacobians
are such directions one after the other; so the program is compiled once, however many there are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import report_quantities
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.solver.derived.reported import unpad_quantity
from notchflex.solver.programs.capacity import pad_rows
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.sensitivity import SubstepHistory, attach_derivatives


class StepLayouts(NamedTuple):
    """How a program takes chain, load and state as vectors, and what it reports.

    Attributes:
        chain: Structure and layout of the chain.
        command: Layout of one load.
        state: Layout of a state.
        outputs: Names of the quantities.
        chain_varies: Whether a change of the chain is followed.
    """

    chain: StaticStructure
    command: PytreeLayout
    state: PytreeLayout
    outputs: tuple[str, ...]
    chain_varies: bool = False


@dataclass(frozen=True, eq=False)
class Change:
    """Change of what a path is computed from, per unit of a number.

    Attributes:
        loads: Of the loads, packed for the long chain, steps as leading axis; None for none.
        chain: Of the long chain, packed whole; None for none.
    """

    loads: Float[np.ndarray, "s command"] | None
    chain: Float[np.ndarray, " chain"] | None

    def entries(
        self, structure: StaticStructure
    ) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return where the chain changes, as packed for programs, and by how much."""
        if structure not in self._entries:
            chain = np.zeros(0) if self.chain is None else self.chain
            indices = np.flatnonzero(chain)
            self._entries[structure] = structure.indices_of(indices), chain[indices]
        return self._entries[structure]

    @cached_property
    def _entries(self) -> dict[StaticStructure, tuple[np.ndarray, np.ndarray]]:
        return {}


@dataclass(frozen=True, eq=False)
class PathTangents:
    """Directional derivatives of a solved path.

    Attributes:
        path: The path, as solved.
        outputs: Names of what is differentiated: quantities of `EquilibriumPath` that the solver
            reports as floats.
        remembers: Whether changes pass from state to state through the memory of the contacts.
    """

    path: EquilibriumPath
    outputs: tuple[str, ...]
    remembers: bool = True

    def along(self, direction: Change) -> dict[str, np.ndarray]:
        """Differentiate along one direction.

        Returns:
            Change of every output by name, in the world, steps as leading axis. NaN from a step on
            that did not converge, or was so hard that its derivatives are not known.
        """
        loads, chain = direction.loads, direction.chain
        long = self.path.prepared.long
        layouts = self.layouts._replace(chain_varies=chain is not None)
        change = np.zeros(1) if chain is None else layouts.chain.pack(chain)
        constant = (np.zeros(long.state.size), long.dynamic_vector, change)
        load_change = np.zeros_like(self.loads) if loads is None else loads
        steps = (*self.steps, self.loads, load_change)
        by_row = (*(False,) * len(constant), *(True,) * len(steps))
        changes = _tangent.along(by_row, *constant, *steps, layouts)
        turn = self.path.base_to_world
        for name, values in changes.items():
            values = unpad_quantity(self.path.chain, name, values)
            changes[name] = values if turn is None else REGISTERED[name].turned(values, turn)
        return changes

    @cached_property
    def layouts(self) -> StepLayouts:
        """How programs take chain, load and state, for the long chain."""
        long = self.path.prepared.long
        return StepLayouts(long.static_structure, self._commands[1], long.state, self.outputs)

    @property
    def loads(self) -> Float[np.ndarray, "s command"]:
        """The loads, packed for the long chain."""
        return self._commands[0]

    @cached_property
    def _commands(self) -> tuple[np.ndarray, PytreeLayout]:
        return self.path.prepared.padded_commands(self.path.commands)

    @cached_property
    def steps(self) -> tuple[np.ndarray, ...]:
        """What programs take of every step beside its load, for the long chain.

        The states before and at the load and between, and how it was found: parts of the substeps,
        whether it converged, and whether a change of the state before passes on.
        """
        ready, run = self.path.prepared, self.path.run
        assert isinstance(run, SolverRun)
        states = (
            pad_rows(one, ready.state, ready.long.state)
            for one in (run.states_before, run.states, run.between)
        )
        remembers = self.remembers & ~run.from_start
        how = np.stack([run.fraction_before, run.substeps, self.path.converged, remembers], axis=1)
        return (*states, how.astype(float))


def step_function(
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 4"],
    layouts: StepLayouts,
) -> Callable[[Chain, Array, Array], tuple[Array, dict[str, Array]]]:
    """Return a solved step as a function that can be differentiated.

    Args:
        state: The solved state, packed.
        between: The state before its last part, packed.
        how: How it was found, as `PathTangents.steps` has it.
        layouts: How things are packed, and what is reported.

    Returns:
        A function of a chain, a packed load and the packed state before; it returns the packed
        state and the outputs.
    """
    solved, halfway = layouts.state.unpack(state), layouts.state.unpack(between)
    history = SubstepHistory(halfway, how[0], how[1].astype(int), how[2] > 0.0)

    def step(chain: Chain, load: Array, before: Array) -> tuple[Array, dict[str, Array]]:
        command, last = layouts.command.unpack(load), layouts.state.unpack(before)
        result = attach_derivatives(chain, command, last, solved, history)
        return layouts.state.pack(result), report_quantities(chain, result, layouts.outputs)

    return step


def lanes_of(layouts: StepLayouts) -> tuple[int, int]:
    """Return the sizes of the axes that run along the chain."""
    chain: Any = layouts.chain
    return lane_sizes(chain)


@native(9, lanes_of)
def _tangent(
    last_change: Float[Array, " state"],
    chain: Float[Array, " chain"],
    chain_change: Float[Array, " chain"],
    before: Float[Array, " state"],
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 4"],
    load: Float[Array, " command"],
    load_change: Float[Array, " command"],
    layouts: StepLayouts,
) -> tuple[Float[Array, " state"], dict[str, Array]]:
    """Compute the change of a solved state, carried to the next, and of its reported quantities.

    The program for loads alone, where the chain does not vary, is a fifth shorter.
    """
    step = step_function(state, between, how, layouts)

    def packed(load: Array, before: Array, varied: Array = chain) -> tuple[Array, dict[str, Array]]:
        return step(layouts.chain.unpack(varied), load, before)

    at = (load, before)
    changes = (load_change, jnp.where(how[3] > 0.0, last_change, 0.0))
    if layouts.chain_varies:
        at, changes = (*at, chain), (*changes, chain_change)
    return jax.jvp(packed, at, changes)[1]
