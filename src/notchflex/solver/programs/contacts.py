"""A compiled program for contacts alone: each load from the same state."""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex.loads.command import Command
from notchflex.solver.continuation import solve_load_step
from notchflex.solver.derived.solved_state import notch_contact
from notchflex.solver.newton import Settings
from notchflex.solver.programs.capacity import pad_rows
from notchflex.solver.programs.compiled import native
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.pytree_layout import PytreeLayout, lane_sizes
from notchflex.solver.programs.static_structure import StaticStructure
from notchflex.solver.residual import evaluate
from notchflex.solver.solver_state import SolverState


def solve_contacts(
    prepared: PreparedChain, commands: Command, start: SolverState, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find contact forces (N) and gaps (mm) of all notches, each load from the same state.

    A small program beside `run`, for searches that ask only whether the notches are closed.

    Returns:
        Contact forces and gaps, loads by notches, and which loads converged.
    """
    long = prepared.long
    packed, form = prepared.padded_commands(commands)
    before = pad_rows(np.asarray(prepared.state.pack(start)), prepared.state, long.state)
    vectors = (np.zeros(1), long.dynamic_vector, packed, before, np.array(settings.numbers))
    force, gap, converged = _solve_contacts.along(
        (False, False, True, False, False), *vectors, long.static_structure, form, long.state
    )
    own = prepared.chain.flexures
    return force[:, :own], gap[:, :own], converged


@native(5, lane_sizes)
def _solve_contacts(
    carried: Float[Array, " one"],
    vector: Float[Array, " chain"],
    load: Float[Array, " command"],
    start: Float[Array, " state"],
    numbers: Float[Array, " settings"],
    chain_layout: StaticStructure,
    command_layout: PytreeLayout,
    state_layout: PytreeLayout,
) -> tuple[Array, tuple[Array, Array, Array]]:
    """Compute contact forces and gaps of one load, and whether it converged."""
    chain, settings = chain_layout.unpack(vector), Settings.of(numbers)
    command, last = command_layout.unpack(load), state_layout.unpack(start)
    result = solve_load_step(chain, command, last, settings)
    point, memory, _, applied = result.solved
    at = evaluate(chain, point, memory, applied)
    return carried, (*notch_contact(chain, point.unknowns, at), result.converged)
