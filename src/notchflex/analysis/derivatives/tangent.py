"""How the states of a solved path change with the numbers they were found from.

One compiled program follows one direction of change along the path, through the memory of the
contacts (forward derivatives by the implicit function theorem, `solver/sensitivity.py`). Jacobians
are such directions one after the other; so the program is compiled once, however many there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex.analysis.outputs import reported
from notchflex.results.path import EquilibriumPath
from notchflex.solver.derived.quantities import of_own
from notchflex.solver.programs.capacity import lengthen
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.pytree_layout import Form, lane_sizes
from notchflex.solver.programs.run import Run
from notchflex.solver.programs.static_structure import KnownForm
from notchflex.solver.sensitivity import Way, answering

VECTORS = ("tip_position", "body_position", "base_force", "base_moment")
ROTATIONS = ("tip_rotation", "body_rotation")


@dataclass(frozen=True, eq=False)
class Change:
    """Change of what a path is computed from, per unit of a number.

    Attributes:
        loads: Of the loads, packed for the long chain, steps as leading axis; None for none.
        chain: Of the long chain, packed whole; None for none.
    """

    loads: Float[np.ndarray, "s command"] | None
    chain: Float[np.ndarray, " chain"] | None

    def entries(self, form: KnownForm) -> tuple[Int[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return where the chain changes, as packed for programs, and by how much."""
        if form not in self._entries:
            chain = np.zeros(0) if self.chain is None else self.chain
            places = np.flatnonzero(chain)
            self._entries[form] = form.places_of(places), chain[places]
        return self._entries[form]

    @cached_property
    def _entries(self) -> dict[KnownForm, tuple[np.ndarray, np.ndarray]]:
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
        form = long.known_form
        varies = chain is not None
        change = form.pack(chain) if varies else np.zeros(1)
        packed, command_form, states = self.steps
        moved = np.zeros_like(packed) if loads is None else loads
        given = (np.zeros(long.state.size), long.known_vector, change)
        steps = (*states, packed, moved)
        rows = (*(False,) * len(given), *(True,) * len(steps))
        others = (form, command_form, long.state, self.outputs, varies)
        found = _tangent.along(rows, *given, *steps, *others)
        return {name: self._own(name, values) for name, values in found.items()}

    @cached_property
    def steps(self) -> tuple[np.ndarray, Form, tuple[np.ndarray, ...]]:
        """What programs take of every load, for the long chain.

        Returns:
            The loads, the form of one of them; and whether a change of the state before passes on,
            the states before and at the load and between, and how it was found.
        """
        ready, came = self.path.prepared, self.path.run
        assert isinstance(came, Run)
        packed, form = ready.long_commands(self.path.commands)
        own = (came.states_before, came.states, came.between)
        every = (lengthen(one, ready.state, ready.long.state) for one in own)
        how = np.stack([came.part_before, came.parts, self.path.converged], axis=1)
        remembers = (self.remembers & ~came.from_start)[:, None].astype(float)
        return packed, form, (remembers, *every, how)

    def _own(self, name: str, values: np.ndarray) -> np.ndarray:
        own = of_own(self.path.chain, name, values)
        turn = self.path.base_to_world
        if turn is None or name not in (*VECTORS, *ROTATIONS):
            return own
        return own @ turn.T if name in VECTORS else turn @ own


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
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
    outputs: tuple[str, ...],
    varies: bool,
) -> tuple[Float[Array, " state"], dict[str, Array]]:
    """Change of a solved state, which is carried to the next, and of what is reported of it.

    The program for loads alone, where the chain does not vary, is a fifth shorter.
    """
    solved, halfway = state_form.unpack(state), state_form.unpack(between)
    way = Way(halfway, how[0], how[1].astype(int), how[2] > 0.0)

    def told(load: Array, before: Array, varied: Array = chain) -> tuple[Array, dict[str, Array]]:
        own, last = chain_form.unpack(varied), state_form.unpack(before)
        command = command_form.unpack(load)
        found = answering(own, command, last, solved, way)
        return state_form.pack(found), reported(own, found, outputs)

    at, changes = (
        (load, before),
        (
            load_change,
            jnp.where(remembers[0] > 0.0, last_change, 0.0),
        ),
    )
    if varies:
        at, changes = (*at, chain), (*changes, chain_change)
    return jax.jvp(told, at, changes)[1]


__all__ = ["ROTATIONS", "VECTORS", "Change", "PathTangents"]
