"""How the states of a solved path change with the numbers they were found from.

One compiled program follows one direction of change along the path, through the memory of the
contacts (forward derivatives by the implicit function theorem, `sensitivity.py`). Jacobians are
such directions one after the other; so the program is compiled once, however many there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax
from notchflex._native import native
from notchflex.statics.actuation import Command
from notchflex.statics.capacity import lengthen
from notchflex.statics.known import KnownForm
from notchflex.statics.outputs import reported
from notchflex.statics.packing import Form, lane_sizes
from notchflex.statics.path import EquilibriumPath
from notchflex.statics.quantities import of_own
from notchflex.statics.run import Run
from notchflex.statics.sensitivity import Way, answering

_VECTORS = ("tip_position", "body_position", "base_force", "base_moment")
_ROTATIONS = ("tip_rotation", "body_rotation")


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

    def along(
        self,
        loads: Float[np.ndarray, "s command"] | None,
        chain: Float[np.ndarray, " chain"] | None = None,
    ) -> dict[str, np.ndarray]:
        """Differentiate along one direction.

        Args:
            loads: Change of the loads, packed for the long chain, steps as leading axis; None for
                none.
            chain: Change of the long chain, packed whole; None for none.

        Returns:
            Change of every output by name, in the world, steps as leading axis. NaN from a step on
            that did not converge, or was so hard that its derivatives are not known.
        """
        long = self.path.prepared.long
        form = long.known_form
        varies = chain is not None
        change = form.pack(chain) if varies else np.zeros(1)
        rows = (False, False, False, *(True,) * 7)
        packed, command_form = self._packed
        given = (np.zeros(long.state.size), long.known_vector, change)
        remembers, before, states, between, how = self._states
        moved = np.zeros_like(packed) if loads is None else loads
        steps = (remembers, before, states, packed, moved, between, how)
        others = (form, command_form, long.state, self.outputs, varies)
        found = _tangent.along(rows, *given, *steps, *others)
        return {name: self._own(name, values) for name, values in found.items()}

    @cached_property
    def _packed(self) -> tuple[np.ndarray, Form]:
        """The loads packed for the long chain, and the form of one of them."""
        return self.path.prepared.long_commands(self.path.commands)

    @cached_property
    def _states(self) -> tuple[np.ndarray, ...]:
        """What the program takes for each load: which changes pass on, three states, how found."""
        ready, came = self.path.prepared, self.path.run
        assert isinstance(came, Run)
        every = (came.states_before, came.states, came.between)
        how = np.stack([came.part_before, came.parts, self.path.converged], axis=1)
        remembers = (self.remembers & ~came.from_start)[:, None].astype(float)
        return remembers, *(lengthen(one, ready.state, ready.long.state) for one in every), how

    def _own(self, name: str, values: np.ndarray) -> np.ndarray:
        own = of_own(self.path.chain, name, values)
        turn = self.path.base_to_world
        if turn is None or name not in (*_VECTORS, *_ROTATIONS):
            return own
        return own @ turn.T if name in _VECTORS else turn @ own


@native(10, lane_sizes)
def _tangent(
    last_change: Float[Array, " state"],
    chain: Float[Array, " chain"],
    chain_change: Float[Array, " chain"],
    remembers: Float[Array, " 1"],
    before: Float[Array, " state"],
    state: Float[Array, " state"],
    load: Float[Array, " command"],
    load_change: Float[Array, " command"],
    between: Float[Array, " state"],
    how: Float[Array, " 3"],
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
        command: Command = command_form.unpack(load)
        found = answering(own, command, last, solved, way)
        return state_form.pack(found), reported(own, found, outputs)

    at, changes = (load, before), (load_change, remembers[0] * last_change)
    if varies:
        at, changes = (*at, chain), (*changes, chain_change)
    return jax.jvp(told, at, changes)[1]


__all__ = ["PathTangents"]
