"""What can be asked of a path inside a compiled program, by name, and following one for that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from jaxtyping import Array

from notchflex._jax import jax, jnp
from notchflex.errors import InputError
from notchflex.loads.validation import shown
from notchflex.mechanics.chain import Chain
from notchflex.solver.continuation import Solved, advance
from notchflex.solver.derived.quantities import Quantities, Shape, believable, quantities, shape
from notchflex.solver.newton import Settings

DEFAULT_OUTPUTS = ("total_angle", "tip_position", "tip_rotation", "converged")
OUTPUTS = (
    *DEFAULT_OUTPUTS,
    "residual",
    "iterations",
    *(
        name
        for name in Shape._fields
        if name not in (*DEFAULT_OUTPUTS, "friction_holds", "bend_possible")
    ),
    *Quantities._fields,
)
"""What can be asked of a batch or of a function that can be differentiated."""


def known_outputs(outputs: Sequence[str]) -> tuple[str, ...]:
    """The names of outputs, checked.

    Raises:
        InputError: There is no such output, or none is asked.
    """
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    wrong = [name for name in names if name not in OUTPUTS]
    if wrong or not names:
        said = f"there is no output {shown(wrong[0])}" if wrong else "no output is asked"
        raise InputError(f"{said}; there are {', '.join(OUTPUTS)}")
    return names


def followed(
    chain: Chain,
    commands: Any,
    start: Solved,
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

    def step(state: tuple[Solved, Array], command: Any) -> tuple[Any, dict[str, Array]]:
        last, alive = state
        came = advance(chain, command, last, settings)
        solved = jax.tree.map(lambda new, old: jnp.where(alive, new, old), came.solved, last)
        reached = alive & came.converged
        told = _told(chain, solved, outputs)
        converged = reached & told.pop("_holds")
        own = {"residual": came.residual, "iterations": came.iterations, "converged": converged}
        told |= {name: value for name, value in own.items() if name in outputs}
        return (solved, reached), told

    return jax.lax.scan(step, (start, jnp.array(True)), commands)[1]


def _told(chain: Chain, solved: Solved, outputs: tuple[str, ...]) -> dict[str, Array]:
    """What is asked of a state, and whether it may be believed."""
    own = shape(chain, solved)
    holds = believable(own.friction_holds, own.moment_error, own.bend_possible)
    return _named(chain, solved, own, outputs) | {"_holds": holds}


def reported(chain: Chain, solved: Solved, outputs: tuple[str, ...]) -> dict[str, Array]:
    """Return quantities of a solved state by name, in the frame of the base."""
    return _named(chain, solved, shape(chain, solved), outputs)


def _named(chain: Chain, solved: Solved, own: Shape, outputs: tuple[str, ...]) -> dict[str, Array]:
    known = {**own._asdict(), "tip_rotation": own.body_rotation[-1]}
    if any(name in Quantities._fields for name in outputs):
        known |= quantities(chain, solved)._asdict()
    return {name: known[name] for name in outputs if name in known}


__all__ = ["DEFAULT_OUTPUTS", "OUTPUTS", "followed", "known_outputs", "reported"]
