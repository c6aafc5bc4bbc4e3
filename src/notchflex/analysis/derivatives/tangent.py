"""How the states of a solved path change with the numbers they were found from.

One compiled program follows one direction of change along the path, through the memory of the
contacts (forward derivatives by the implicit function theorem, `solver/sensitivity.py`). Jacobians
are such directions one after the other; so the program is compiled once, however many there are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import report_quantities
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.solver.derived.quantities import unpad_quantity
from notchflex.solver.programs.capacity import pad_rows
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.sensitivity import SubstepHistory, attach_derivatives


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
        self, form: StaticStructure
    ) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return where the chain changes, as packed for programs, and by how much."""
        if form not in self._entries:
            chain = np.zeros(0) if self.chain is None else self.chain
            places = np.flatnonzero(chain)
            self._entries[form] = form.indices_of(places), chain[places]
        return self._entries[form]

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
        form = long.static_structure
        varies = chain is not None
        change = form.pack(chain) if varies else np.zeros(1)
        packed, command_layout, states = self.steps
        moved = np.zeros_like(packed) if loads is None else loads
        given = (np.zeros(long.state.size), long.dynamic_vector, change)
        steps = (*states, packed, moved)
        rows = (*(False,) * len(given), *(True,) * len(steps))
        others = (form, command_layout, long.state, self.outputs, varies)
        found = _tangent.along(rows, *given, *steps, *others)
        return {name: self._own(name, values) for name, values in found.items()}

    @cached_property
    def steps(self) -> tuple[np.ndarray, PytreeLayout, tuple[np.ndarray, ...]]:
        """What programs take of every load, for the long chain.

        Returns:
            The loads, the form of one of them; and whether a change of the state before passes on,
            the states before and at the load and between, and how it was found.
        """
        ready, came = self.path.prepared, self.path.run
        assert isinstance(came, SolverRun)
        packed, form = ready.padded_commands(self.path.commands)
        own = (came.states_before, came.states, came.between)
        every = (pad_rows(one, ready.state, ready.long.state) for one in own)
        how = np.stack([came.part_before, came.parts, self.path.converged], axis=1)
        remembers = (self.remembers & ~came.from_start)[:, None].astype(float)
        return packed, form, (remembers, *every, how)

    def _own(self, name: str, values: np.ndarray) -> np.ndarray:
        own = unpad_quantity(self.path.chain, name, values)
        turn = self.path.base_to_world
        return own if turn is None else REGISTERED[name].turned(own, turn)


def answer_of(
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 3"],
    layouts: tuple[PytreeLayout, PytreeLayout],
    outputs: tuple[str, ...],
) -> Callable[[Chain, Array, Array], tuple[Array, dict[str, Array]]]:
    """Return a solved step as a function that can be differentiated.

    Args:
        state: The solved state, packed.
        between: The state before its last part, packed.
        how: How it was found, as `PathTangents.steps` has it.
        layouts: Of a load and of a state.
        outputs: Names of what is reported.

    Returns:
        A function of a chain, a packed load and the packed state before; it returns the packed
        state and the outputs.
    """
    command_layout, state_layout = layouts
    solved, halfway = state_layout.unpack(state), state_layout.unpack(between)
    history = SubstepHistory(halfway, how[0], how[1].astype(int), how[2] > 0.0)

    def answer(chain: Chain, load: Array, before: Array) -> tuple[Array, dict[str, Array]]:
        command, last = command_layout.unpack(load), state_layout.unpack(before)
        result = attach_derivatives(chain, command, last, solved, history)
        return state_layout.pack(result), report_quantities(chain, result, outputs)

    return answer


@native(10, lane_sizes)
def _tangent(
    last_change: Float[Array, " state"],
    chain: Float[Array, " chain"],
    chain_change: Float[Array, " chain"],
    remembers: Float[Array, " 1"],
    before: Float[Array, " state"],
    state: Float[Array, " state"],
    between: Float[Array, " state"],
    how: Float[Array, " 3"],
    load: Float[Array, " command"],
    load_change: Float[Array, " command"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
    outputs: tuple[str, ...],
    varies: bool,
) -> tuple[Float[Array, " state"], dict[str, Array]]:
    """Change of a solved state, which is carried to the next, and of what is reported of it.

    The program for loads alone, where the chain does not vary, is a fifth shorter.
    """
    answer = answer_of(state, between, how, (command_layout, state_layout), outputs)

    def step(load: Array, before: Array, varied: Array = chain) -> tuple[Array, dict[str, Array]]:
        return answer(chain_layout.unpack(varied), load, before)

    at = (load, before)
    changes = (load_change, jnp.where(remembers[0] > 0.0, last_change, 0.0))
    if varies:
        at, changes = (*at, chain), (*changes, chain_change)
    return jax.jvp(step, at, changes)[1]
