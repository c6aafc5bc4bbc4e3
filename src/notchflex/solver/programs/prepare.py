"""A robot prepared for repeated solves: its chain, as arrays and as one vector."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from lanewise import FixedVector
from notchflex.loads.command import Command, usual_loads
from notchflex.mechanics.chain import Chain, assemble, padded
from notchflex.robot import Robot
from notchflex.solver.programs.compiled import Packed
from notchflex.solver.programs.static_structure import (
    PytreeLayout,
    StaticStructure,
    capacity,
    pad_rows,
)
from notchflex.solver.quantities import Shape
from notchflex.solver.residual import SolverState, at_rest, unloaded


@dataclass(frozen=True, eq=False)
class PreparedChain:
    """A chain, with the layouts of chain, states and commands.

    Attributes:
        chain: The chain, as plain arrays.
    """

    chain: Chain

    @cached_property
    def chain_layout(self) -> PytreeLayout:
        """Layout of the chain."""
        return PytreeLayout.of(self.chain)

    @cached_property
    def vector(self) -> Float[np.ndarray, " chain"]:
        """The chain as one vector."""
        return np.asarray(self.chain_layout.pack(self.chain))

    @cached_property
    def static_structure(self) -> StaticStructure:
        """Numbers of the chain that are compiled in, and the layout of the others."""
        return StaticStructure.of(self.chain_layout, self.chain, self.vector)

    @cached_property
    def dynamic_vector(self) -> Float[np.ndarray, " dynamic"]:
        """Numbers of the chain that are not compiled in, as one vector."""
        return self.static_structure.pack(self.vector)

    @cached_property
    def long(self) -> PreparedChain:
        """The robot padded to the number of flexures that programs are compiled for."""
        # Its tendons have contacts at every edge of every gap; those of the chain itself are
        # selected afterwards (`run.SolverRun`), so that a program does not depend on them.
        chain = self.chain
        more = padded(chain, capacity(chain.flexures), chain.contacts.shape[1])
        edges = np.tile(np.arange(2 * more.flexures), (chain.tendons, 1))
        return PreparedChain(dataclasses.replace(more, contacts=edges))

    @cached_property
    def own_numbers(self) -> Int[np.ndarray, " dynamic"]:
        """Which number of the chain each dynamic number of the long chain is, from 1; or 0."""
        numbers = _own_numbers(self.chain_layout, self.long.chain_layout)
        return self.long.static_structure.pack(numbers).astype(int)

    def with_numbers(self, numbers: Float[np.ndarray, " chain"]) -> PreparedChain:
        """Return a chain of the same form, with the same constants."""
        which = _own_numbers(self.chain_layout, self.long.chain_layout)
        long_numbers = np.where(which > 0, numbers[which - 1], self.long.vector)
        pairs = (self, numbers), (self.long, long_numbers)
        unpadded, long = (PreparedChain(like.chain_layout.unpack(vector)) for like, vector in pairs)
        for new, (like, vector) in zip((unpadded, long), pairs, strict=True):
            new.__dict__.update({name: getattr(like, name) for name in _OF_FORM}, vector=vector)
        unpadded.__dict__["long"] = long
        return unpadded

    @cached_property
    def rest(self) -> SolverState:
        """The free robot with slack tendons."""
        return at_rest(self.chain)

    @cached_property
    def state(self) -> PytreeLayout:
        """Layout of a solved state."""
        return PytreeLayout.of(self.rest)

    @cached_property
    def rest_vector(self) -> np.ndarray:
        """The free robot as a vector."""
        return np.asarray(self.state.pack(self.rest))

    @cached_property
    def rest_carried(self) -> FixedVector:
        """The free robot as a vector, with the flag that no load has failed: start of a path."""
        return FixedVector(np.append(self.rest_vector, 1.0))

    @cached_property
    def packed(self) -> Packed:
        """The chain, as programs take it."""
        return Packed(FixedVector(self.dynamic_vector), self.static_structure)

    def packed_states(self, states: Float[np.ndarray, "s state"]) -> Packed:
        """Return states, as programs of the long chain take them."""
        return Packed(pad_rows(states, self.state, self.long.state), self.long.state, True)

    @cached_property
    def programs(self) -> dict[Any, Callable[[Sequence[Any]], np.ndarray]]:
        """The programs that solve loads of this robot, by what they are compiled for."""
        return {}

    @cached_property
    def shape(self) -> PytreeLayout:
        """Layout of the shape of a state."""
        return Shape.form(self.chain.flexures, self.chain.tendons)

    @cached_property
    def usual_loads(self) -> dict[str, tuple[float, str]]:
        """The largest usual size of each kind of load, and its unit."""
        return usual_loads(self.chain)

    def command_layout(self, commands: Command) -> PytreeLayout:
        """Return the layout of one load: tensions alone, or some strokes."""
        return self._command_layouts[commands.by_stroke is not None]

    @cached_property
    def _command_layouts(self) -> dict[bool, PytreeLayout]:
        target: Any = np.zeros(self.chain.tendons)
        bend = None if self.chain.sheath is None else target[0]
        return {
            by_stroke is not None: PytreeLayout.of(
                Command(target, by_stroke, unloaded(self.chain), bend)
            )
            for by_stroke in (None, target > 0.0)
        }

    def packed_commands(self, commands: Command) -> Packed:
        """Return loads, as programs of the long chain take them."""
        unpadded, long = self.command_layout(commands), self.long.command_layout(commands)
        return Packed(pad_rows(commands.packed(), unpadded, long), long, True)


@lru_cache(maxsize=64)
def _own_numbers(unpadded: PytreeLayout, long: PytreeLayout) -> Int[np.ndarray, " long"]:
    """Return which number of a chain each number of its long chain is, from 1; 0 for others."""
    long_chain: Chain = long.unpack(np.zeros(long.size))

    def packed(numbers: Float[np.ndarray, " chain"]) -> Float[np.ndarray, " long"]:
        chain = unpadded.unpack(numbers)
        wide = padded(chain, long_chain.flexures, chain.contacts.shape[1])
        return np.array(long.pack(dataclasses.replace(wide, contacts=long_chain.contacts)))

    # What is padded is constant.
    which = packed(np.arange(1.0, unpadded.size + 1.0)) - packed(np.zeros(unpadded.size))
    for indices, kind in zip(long.indices, long.kinds, strict=True):
        which[indices] *= kind == "f"
    return which.astype(int)


# Cached properties that chains of one form share.
_OF_FORM = (
    "chain_layout",
    "static_structure",
    "rest",
    "rest_vector",
    "rest_carried",
    "state",
    "shape",
    "_command_layouts",
)


@lru_cache(maxsize=6)
def prepare(
    robot: Robot,
    level: str = "tendons",
    loaded: bool = False,
    follows: bool = True,
    refinement: int = 0,
    flat: bool = True,
) -> PreparedChain:
    """Prepare a robot as `assemble` takes it; control loops solve the same, which is cached."""
    return PreparedChain(
        assemble(robot, level, loaded=loaded, follows=follows, refinement=refinement, flat=flat)
    )
