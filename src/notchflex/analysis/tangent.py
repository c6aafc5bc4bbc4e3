"""How the states of a solved path change with the numbers they were found from.

One compiled program follows one direction of change along the path, through the memory of the
contacts (forward derivatives by the implicit function theorem, `solver/sensitivity.py`). Jacobians
are such directions one after the other; so the program is compiled once, however many there are.

One compiled program runs backwards over the path, through the memory of the contacts. Its time does
not depend on the number of parameters.

A contact about to slip and a notch just closing are switches: the slopes differ on their two sides.
A contact that slid in a step has a slip
and lies on its bound; one that stuck has neither. At the switch it lies on its bound without a
slip, as after a step that changed nothing. A notch at the switch is closed without a force.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.analysis.outputs import (
    Arrays,
    report_quantities,
    reported_shapes,
    unpadded_entries,
)
from notchflex.mechanics.chain import Chain
from notchflex.results.path import EquilibriumPath
from notchflex.solver.programs.compiled import Native, Packed
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.programs.static_structure import (
    PytreeLayout,
    StaticStructure,
    pad_rows,
    padded_indices,
)
from notchflex.solver.quantities import unpad_quantity
from notchflex.solver.residual import SolverState, slip_mask
from notchflex.solver.sensitivity import attach_derivatives

State = Float[Array, " state"]
"""A packed state, or its change."""


class StepLayouts(NamedTuple):
    """How a program takes chain, load and state as vectors, and what it reports."""

    chain: StaticStructure
    command: PytreeLayout  # of one load
    state: PytreeLayout
    outputs: tuple[str, ...]
    chain_varies: bool = False  # whether its change is followed

    @property
    def lanes(self) -> tuple[int, int]:
        """Sizes of the axes that run along the chain."""
        return self.chain.lanes


@dataclass(frozen=True, eq=False)
class Change:
    """Change of what a path is computed from, per unit of a number.

    Attributes:
        loads: Of the loads, packed, steps as leading axis; None for none.
        chain: Of the chain, packed whole; None for none.
    """

    loads: Float[np.ndarray, "s command"] | None
    chain: Float[np.ndarray, " chain"] | None

    def plus(self, other: Change, size: float = 1.0) -> Change:
        """Add a multiple of another change."""
        pairs = (self.loads, other.loads), (self.chain, other.chain)
        return Change(
            *(
                present if more is None else size * more + (0.0 if present is None else present)
                for present, more in pairs
            )
        )


@dataclass(frozen=True, eq=False)
class PathTangents:
    """Directional derivatives of a solved path."""

    path: EquilibriumPath
    outputs: tuple[str, ...]  # quantities that the solver reports as floats
    remembers: bool = True  # whether changes pass on through the memory of contacts

    def along(self, directions: Sequence[Change]) -> Arrays:
        """Differentiate the outputs, in the world, along some directions, the leading axis."""
        # NaN from a step on that did not converge, or was so hard that its derivatives are not
        # known.
        ready = self.path.prepared
        varies = any(direction.chain is not None for direction in directions)
        layouts = self.layouts._replace(chain_varies=varies)
        start = np.zeros(ready.long.state.size)
        by_row = (*(False,) * 3, *(True,) * (len(self.steps) + 2))
        turn = self.path.load.base_to_world
        by_output: dict[str, list[np.ndarray]] = {name: [] for name in self.outputs}
        for direction in directions:
            change = np.zeros(layouts.chain.size if varies else 1)
            if direction.chain is not None:
                change = np.append(0.0, direction.chain)[ready.own_numbers]
            load_change = np.zeros_like(self.loads)
            if direction.loads is not None:
                load_change[:, self.unpadded_loads] = direction.loads
            vectors = (start, ready.long.dynamic_vector, change, *self.steps, self.loads)
            packed = map(Packed, (*vectors, load_change), repeat(None), by_row)
            for name, values in tangent_step.scan(*packed, layouts).items():
                unpadded = unpad_quantity(self.path.chain, name, values)
                by_output[name].append(REGISTERED[name].turned(unpadded, turn))
        return {name: np.stack(values) for name, values in by_output.items()}

    @property
    def unpadded_loads(self) -> Int[np.ndarray, " command"]:
        """Where the numbers of a load are among those of a load for the long chain."""
        ready, commands = self.path.prepared, self.path.commands
        short, long = ready.command_layout(commands), ready.long.command_layout(commands)
        return padded_indices(short, long)

    @cached_property
    def layouts(self) -> StepLayouts:
        """How programs take chain, load and state, for the long chain."""
        long = self.path.prepared.long
        return StepLayouts(long.static_structure, self._commands.layout, long.state, self.outputs)

    @property
    def loads(self) -> Float[np.ndarray, "s command"]:
        """The loads, packed for the long chain."""
        return self._commands.numbers

    @cached_property
    def _commands(self) -> Packed:
        return self.path.prepared.packed_commands(self.path.commands)

    @cached_property
    def steps(self) -> tuple[np.ndarray, ...]:
        """What programs take of every step but its load, for the long chain."""
        # The states before and at the load and between, and how it was found: parts of the
        # substeps, whether it converged, and whether a change of the state before passes on.
        ready, run = self.path.prepared, self.path.run
        assert isinstance(run, SolverRun)
        states = (
            pad_rows(state, ready.state, ready.long.state)
            for state in (run.states_before, run.states, run.between)
        )
        remembers = self.remembers & (run.from_start[:, 0] == 0.0)
        how = np.stack([run.fraction_before, run.substeps, self.path.converged, remembers], axis=1)
        return (*states, how.astype(float))


def step_function(
    state: State,
    between: State,
    how: Float[Array, " 4"],
    layouts: StepLayouts,
) -> Callable[[Chain, Array, Array], tuple[Array, dict[str, Array]]]:
    """Return a solved step as a function of chain, load and state before, for derivatives."""
    # `between` is the state before its last part, `how` that of `PathTangents.steps`.
    solved, halfway = layouts.state.unpack(state), layouts.state.unpack(between)
    history = halfway, how[0], how[1].astype(int), how[2] > 0.0

    def step(chain: Chain, load: Array, before: Array) -> tuple[Array, dict[str, Array]]:
        command, last = layouts.command.unpack(load), layouts.state.unpack(before)
        result = attach_derivatives(chain, command, last, solved, *history)
        return layouts.state.pack(result), report_quantities(chain, result, layouts.outputs)

    return step


@Native
def tangent_step(
    last_change: State,
    chain: Float[Array, " chain"],
    chain_change: Float[Array, " chain"],
    before: State,
    state: State,
    between: State,
    how: Float[Array, " 4"],
    load: Float[Array, " command"],
    load_change: Float[Array, " command"],
    layouts: StepLayouts,
) -> tuple[State, dict[str, Array]]:
    """Compute the change of a solved state, carried to the next, and of its reported quantities."""
    # The program for loads alone, where the chain does not vary, is a fifth shorter.
    step = step_function(state, between, how, layouts)

    def packed(load: Array, before: Array, varied: Array = chain) -> tuple[Array, dict[str, Array]]:
        return step(layouts.chain.unpack(varied), load, before)

    point = (load, before)
    changes = (load_change, jnp.where(how[3] > 0.0, last_change, 0.0))
    if layouts.chain_varies:
        point, changes = (*point, chain), (*changes, chain_change)
    return jax.jvp(packed, point, changes)[1]


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a number by all that a path is computed from."""

    loads: Float[np.ndarray, "s command"]
    chain: Float[np.ndarray, " chain"]  # packed, all of it

    def along(self, change: Change) -> float:
        """Return the derivative of the number along a change."""
        by_chain = 0.0 if change.chain is None else float(self.chain @ change.chain)
        if change.loads is None:
            return by_chain
        return by_chain + float(self.loads.ravel() @ change.loads.ravel())


def path_gradient(path: EquilibriumPath, weights: Mapping[str, np.ndarray]) -> Gradient:
    """Differentiate a weighted sum of quantities in the world by all loads and by the chain."""
    # NaN if a step of any weight, or one before it, did not converge, or was so hard that its
    # derivatives are not known.
    long = path.prepared.long
    tangents = PathTangents(path, tuple(weights))
    layouts = tangents.layouts
    # Weights in the frame of the base, for the outputs of the long chain.
    turn = path.load.base_to_world
    back = None if turn is None else turn.T
    shapes = reported_shapes(long.static_structure, long.state, tuple(weights))
    seeds = np.zeros((len(path), sum(int(np.prod(shape)) for shape in shapes.values()) + 1))
    for name, index in unpadded_entries(path.prepared, [*weights]).items():
        seeds[:, index] = REGISTERED[name].turned(weights[name], back)
    seeds = seeds[:, :-1]  # the last column takes what is beyond the end of a tendon
    # No step beyond the last that counts: one that failed there must not matter.
    backwards = slice(int(np.flatnonzero(seeds.any(axis=1)).max(initial=0)), None, -1)
    steps = [array[backwards] for array in (*tangents.steps, tangents.loads, seeds)]
    by_row = (False, False, *(True,) * len(steps))
    start = (np.zeros(long.state.size), long.dynamic_vector)
    packed = map(Packed, (*start, *steps), repeat(None), by_row)
    result = adjoint_step.scan(*packed, layouts)
    loads = np.zeros_like(tangents.loads)
    loads[backwards] = result["load"]
    loads = loads[:, tangents.unpadded_loads]
    by_chain, numbers = result["chain"].sum(axis=0), path.prepared.own_numbers
    size = path.prepared.chain_layout.size + 1
    return Gradient(loads, np.bincount(numbers, by_chain, size)[1:])


@Native
def adjoint_step(
    seed: State,
    chain: Float[Array, " chain"],
    before: State,
    state: State,
    between: State,
    how: Float[Array, " 4"],
    load: Float[Array, " command"],
    weights: Float[Array, " outputs"],
    layouts: StepLayouts,
) -> tuple[State, dict[str, Array]]:
    """Compute the adjoint of a state, carried to the previous one, and of its load and chain."""
    step = step_function(state, between, how, layouts)
    leaves, structure = jax.tree.flatten(layouts.chain.unpack(chain))
    varies = [jnp.issubdtype(leaf.dtype, jnp.floating) for leaf in leaves]

    def packed(load: Array, before: Array, numbers: list[Array]) -> tuple[Array, Array]:
        rest = iter(numbers)
        varied = [
            next(rest) if varying else leaf for varying, leaf in zip(varies, leaves, strict=True)
        ]
        solved, values = step(jax.tree.unflatten(structure, varied), load, before)
        return solved, jnp.concatenate([values[name].ravel() for name in layouts.outputs])

    numbers = [jnp.asarray(leaf) for varying, leaf in zip(varies, leaves, strict=True) if varying]
    pull_back = jax.vjp(packed, load, before, numbers)[1]
    by_load, by_before, by_numbers = pull_back((seed, weights))
    rest = iter(by_numbers)
    by_leaves = [
        next(rest).ravel() if varying else jnp.zeros(leaf.size)
        for varying, leaf in zip(varies, leaves, strict=True)
    ]
    by_chain = layouts.chain.pack(jnp.concatenate(by_leaves))
    return jnp.where(how[3] > 0.0, by_before, 0.0), {"load": by_load, "chain": by_chain}


@dataclass(frozen=True)
class Kink:
    """A contact or a notch at a switch, where derivatives are one-sided.

    Attributes:
        step: Step of the path, from 0.
        kind: "contact" (about to slip, or to stop) or "notch" (about to close or to open).
        index: Which contact along its tendon, from 1 at the base, or which notch, from 1.
        tendon: The tendon of a contact, from 1; None for a notch.
        distance: Distance of the state from the switch: for a contact the log ratio to its bound,
            or its slip in heights of the notch; for a notch its gap, or its contact force over its
            stiffness, in heights.
    """

    step: int
    kind: Literal["contact", "notch"]
    index: int
    tendon: int | None
    distance: float


def kinks(path: EquilibriumPath, within: float = 1e-6) -> list[Kink]:
    """List the contacts and notches of a solved path within a distance of a switch, by step."""
    if not isinstance(path.run, SolverRun):
        return []
    solved, before = path.run.solved, path.prepared.state.unpack(path.run.between)
    switches = [*_contacts(path.chain, solved, before, within), *_notches(path, within)]
    known = (kink for kink in switches if path.converged[kink.step])
    return sorted(known, key=lambda kink: kink.step)


def _contacts(chain: Chain, solved: SolverState, before: SolverState, within: float) -> list[Kink]:
    height = np.asarray(chain.rods.length).sum(-1)[:, None, None]
    edges = np.asarray(chain.contacts)
    contacts: list[Kink] = []
    for k, group in enumerate(chain.groups):
        ratio, bound = (
            np.asarray(field[k]) for field in (solved.memory.log_ratio, solved.memory.bound)
        )
        slip = np.abs(np.asarray(solved.memory.slid[k]) - np.asarray(before.memory.slid[k]))
        left = np.maximum(bound - np.abs(ratio), 0.0)
        distance = np.maximum(left, slip / height)
        can_slide = np.asarray(slip_mask(group)) > 0.0
        tension = np.asarray(solved.point.base_tension)[:, list(group.numbers)]
        loaded = (tension > 0.0)[:, None, :, None]
        at_switch = (distance < within) & can_slide & loaded & (bound > 0.0)
        for step, flexure, column, edge in np.argwhere(at_switch):
            tendon = group.numbers[column]
            index = int(np.flatnonzero(edges[tendon] == 2 * flexure + edge)[0])
            gap = float(distance[step, flexure, column, edge])
            contacts.append(Kink(int(step), "contact", index + 1, tendon + 1, gap))
    return contacts


def _notches(path: EquilibriumPath, within: float) -> list[Kink]:
    chain = path.chain
    height = np.asarray(chain.rods.length).sum(-1)
    travel = path.contact_force / np.asarray(chain.contact_stiffness)
    distance: Float[np.ndarray, "s n"] = np.maximum(np.abs(path.gap), travel) / height
    return [
        Kink(int(step), "notch", int(notch) + 1, None, float(distance[step, notch]))
        for step, notch in np.argwhere(distance < within)  # NaN where a notch has no contact
    ]
