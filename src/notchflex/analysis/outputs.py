"""What can be asked of a path inside a compiled program, by name, and following one for that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from jaxtyping import Array

from notchflex._jax import jax, jnp
from notchflex._quantity import REGISTERED
from notchflex.errors import InputError
from notchflex.loads.validation import short_repr
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import SolverState, solve_load_step
from notchflex.solver.derived.quantities import believable
from notchflex.solver.derived.solved_state import SolvedState
from notchflex.solver.newton import Settings

_OF_STATE = [name for name, one in REGISTERED.items() if one.title and one.source != "path"]
DEFAULT_OUTPUTS = ("total_angle", "tip_position", "tip_rotation", "converged")
OUTPUTS = (*dict.fromkeys([*DEFAULT_OUTPUTS, "residual", "iterations", *_OF_STATE]),)
"""What can be asked of a batch or of a function that can be differentiated."""


def check_outputs(outputs: Sequence[str]) -> tuple[str, ...]:
    """The names of outputs, checked.

    Raises:
        InputError: There is no such output, or none is asked.
    """
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    wrong = [name for name in names if name not in OUTPUTS]
    if wrong or not names:
        said = f"there is no output {short_repr(wrong[0])}" if wrong else "no output is asked"
        raise InputError.UNKNOWN_NAME(f"{said}; there are {', '.join(OUTPUTS)}")
    return names


def follow_path(
    chain: Chain,
    commands: Any,
    start: SolverState,
    settings: Settings,
    outputs: tuple[str, ...],
) -> dict[str, Array]:
    """Follow a path of loads, and tell of every state what is asked.

    Beside `run` this is a second loop over a path, and stays one: `run` goes on or starts anew,
    skips what comes after a failure (a branch that rows side by side would both take), and packs
    all that a path may be asked for later; here nothing is kept but what is asked for.

    Args:
        chain: The chain.
        commands: The loads, as leading axis.
        start: The state before the first.
        settings: How hard to try.
        outputs: Names of what is asked.

    Returns:
        By name, loads as leading axis; after a load that failed the last good state.
    """

    def step(state: tuple[SolverState, Array], command: Any) -> tuple[Any, dict[str, Array]]:
        last, alive = state
        came = solve_load_step(chain, command, last, settings)
        solved = jax.tree.map(lambda new, old: jnp.where(alive, new, old), came.solved, last)
        reached = alive & came.converged
        told = _told(chain, solved, outputs)
        converged = reached & told.pop("_holds")
        own = {"residual": came.residual, "iterations": came.iterations, "converged": converged}
        told |= {name: value for name, value in own.items() if name in outputs}
        return (solved, reached), told

    return jax.lax.scan(step, (start, jnp.array(True)), commands)[1]


def _told(chain: Chain, solved: SolverState, outputs: tuple[str, ...]) -> dict[str, Array]:
    """What is asked of a state, and whether it may be believed."""
    state = SolvedState(chain, solved)
    told = {name: state.quantity(name) for name in outputs if name in _OF_STATE}
    return told | {"_holds": believable(state.quantity)}


def report_quantities(
    chain: Chain, solved: SolverState, outputs: tuple[str, ...]
) -> dict[str, Array]:
    """Return quantities of a solved state by name, in the frame of the base."""
    told = _told(chain, solved, outputs)
    del told["_holds"]
    return told
