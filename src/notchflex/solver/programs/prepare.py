"""A robot ready to be solved again and again: its chain, as arrays and as one vector."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import constant, jax
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain, assemble, padded
from notchflex.robot import Robot
from notchflex.solver.continuation import Solved, at_rest, unloaded
from notchflex.solver.derived.quantities import Shape
from notchflex.solver.programs.capacity import capacity, lengthen
from notchflex.solver.programs.pytree_layout import Form
from notchflex.solver.programs.static_structure import KnownForm


@dataclass(frozen=True, eq=False)
class Prepared:
    """A chain, and how it and what belongs to it are packed.

    Attributes:
        chain: The chain, as plain arrays.
    """

    chain: Chain

    @cached_property
    def chain_form(self) -> Form:
        """Form of the chain."""
        return Form.of(self.chain)

    @cached_property
    def vector(self) -> Float[np.ndarray, " chain"]:
        """The chain as one vector."""
        return np.asarray(self.chain_form.pack(self.chain))

    @cached_property
    def known_form(self) -> KnownForm:
        """Form of what is not known of the chain beforehand."""
        return KnownForm.of(self.chain_form, [self.chain], self.vector[None])

    @cached_property
    def known_vector(self) -> Float[np.ndarray, " unknown"]:
        """That as one vector."""
        return self.known_form.pack(self.vector)

    @cached_property
    def long(self) -> Prepared:
        """The robot with as many flexures as programs are compiled for.

        Its tendons are taken to meet the wall at every edge of every gap; where they do is for the
        own chain to say (`run.Run`), so that it is no part of a program.
        """
        chain = self.chain
        more = padded(chain, capacity(chain.flexures), chain.contacts.shape[1])
        edges = np.tile(np.arange(2 * more.flexures), (chain.tendons, 1))
        return Prepared(dataclasses.replace(more, contacts=edges))

    def long_commands(self, commands: Command) -> tuple[Float[np.ndarray, "s command"], Form]:
        """Loads packed for the long chain, and the form of one of them."""
        own, form = self.command_form(commands), self.long.command_form(commands)
        return lengthen(own.pack(commands, leading=1), own, form), form

    def places(self, fields: Mapping[str, Any]) -> Int[np.ndarray, " m"]:
        """Where the vector of the long chain holds some fields of the chain, flattened.

        Args:
            fields: As `chain.laws` returns them.
        """
        if (key := tuple(fields)) not in self._places:
            form = self.long.chain_form
            every: Chain = jax.tree.unflatten(form.structure, form.places)
            long = {name: getattr(every, name) for name in fields}
            own = jax.tree.map(lambda at, leaf: at[tuple(map(slice, leaf.shape))], long, fields)
            self._places[key] = flat(own)
        return self._places[key]

    @cached_property
    def _places(self) -> dict[Any, Int[np.ndarray, " m"]]:
        return {}

    def with_fields(self, fields: Mapping[str, Any]) -> Prepared:
        """Return a robot of the same shape with other laws of material and friction.

        Args:
            fields: Those of the chain that change, as `chain.laws` returns them.
        """
        vector = self.long.vector.copy()
        vector[self.places(fields)] = flat(fields)
        other = Prepared(dataclasses.replace(self.chain, **fields))
        long = Prepared(self.long.chain_form.unpack(vector))
        for new, old in ((other, self), (long, self.long)):
            new.__dict__.update({name: getattr(old, name) for name in _OF_SHAPE})
        long.__dict__["vector"] = vector
        other.__dict__["long"] = long
        return other

    @cached_property
    def rest(self) -> Solved:
        """The free robot with slack tendons."""
        return at_rest(self.chain)

    @cached_property
    def rest_vector(self) -> np.ndarray:
        """The same as a vector."""
        return np.asarray(self.state.pack(self.rest))

    @cached_property
    def rest_carried(self) -> np.ndarray:
        """The same, and that nothing has failed yet: what a path begins with."""
        return np.append(self.rest_vector, 1.0)

    @cached_property
    def state(self) -> Form:
        """Form of a solved state."""
        return Form.of(self.rest)

    def command_form(self, commands: Command) -> Form:
        """Form of one of some loads: by tensions alone, or some by stroke."""
        return self._tension_form if commands.by_stroke is None else self._stroke_form

    @cached_property
    def _tension_form(self) -> Form:
        return self._form_of_commands(None)

    @cached_property
    def _stroke_form(self) -> Form:
        return self._form_of_commands(np.zeros(self.chain.tendons, bool))

    def _form_of_commands(self, by_stroke: np.ndarray | None) -> Form:
        value = constant(np.zeros(self.chain.tendons))
        return Form.of(Command(value, by_stroke, unloaded(self.chain)))  # pyright: ignore[reportArgumentType]

    @cached_property
    def shape(self) -> Form:
        """Form of what is told of the shape of every state."""
        return Shape.form(self.chain.flexures, self.chain.tendons)


# What robots of one shape share.
_OF_SHAPE = (
    *("chain_form", "rest", "rest_vector", "rest_carried", "state", "shape"),
    *("_tension_form", "_stroke_form"),
)


def flat(tree: Any) -> np.ndarray:
    """Return all numbers of a tree as one vector."""
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])


@lru_cache(maxsize=6)
def prepared(
    robot: Robot,
    level: str = "tendons",
    *,
    loaded: bool = False,
    follows: bool = True,
    refinement: int = 0,
    flat: bool = True,
) -> Prepared:
    """A robot ready to be solved; for the arguments see `notchflex.mechanics.chain.assemble`.

    The last robots asked for are remembered: a control loop solves the same one again and again.
    """
    return Prepared(
        assemble(robot, level, loaded=loaded, follows=follows, refinement=refinement, flat=flat)
    )


def lengthened(ready: Prepared, flexures: int, edges: int) -> Prepared:
    """A robot ready to be solved beside longer ones; for the arguments see `chain.padded`."""
    chain = ready.chain
    if (chain.flexures, chain.contacts.shape[1]) == (flexures, edges):
        return ready
    return Prepared(padded(chain, flexures, edges))
