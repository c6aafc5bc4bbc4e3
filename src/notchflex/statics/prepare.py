"""A robot ready to be solved again and again: its chain, as arrays and as one vector."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax
from notchflex.chain import Chain, assemble
from notchflex.robot import Robot
from notchflex.statics.actuation import Command
from notchflex.statics.packing import Form
from notchflex.statics.quantities import Shape
from notchflex.statics.stepping import Solved, at_rest, unloaded


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
    def vector(self) -> Float[Array, " chain"]:
        """The chain, kept where compiled programs take it from without copying."""
        return jax.device_put(self.chain_form.pack(self.chain))

    @cached_property
    def rest(self) -> Solved:
        """The free robot with slack tendons."""
        return at_rest(self.chain)

    @cached_property
    def rest_vector(self) -> np.ndarray:
        """The same as a vector."""
        return np.asarray(self.state.pack(self.rest))

    @cached_property
    def state(self) -> Form:
        """Form of a solved state."""
        return Form.of(self.rest)

    @cached_property
    def command(self) -> Form:
        """Form of a load."""
        none = np.zeros(self.chain.tendons)
        return Form.of(Command(constant(none), none.astype(bool), unloaded(self.chain)))  # pyright: ignore[reportArgumentType]

    @cached_property
    def shape(self) -> Form:
        """Form of what is told of the shape of every state."""
        return Shape.form(self.chain.flexures, self.chain.tendons)


@lru_cache(maxsize=64)
def prepared(
    robot: Robot,
    level: str = "tendons",
    *,
    loaded: bool = False,
    refinement: int = 0,
    flat: bool = True,
) -> Prepared:
    """A robot ready to be solved; for the arguments see `notchflex.chain.assemble`.

    The last robots asked for are remembered: a control loop solves the same one again and again.
    """
    return Prepared(assemble(robot, level, loaded=loaded, refinement=refinement, flat=flat))
