"""The compiled programs: a path of loads with memory, and many loads each from rest.

Compiled once for a shape (number of flexures, modes and tendons, and which laws); a new load or
a new robot of the same shape runs the same program. The number of loads is rounded up to one of
few sizes, so that it hardly ever asks for a new program; loads added so are skipped.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jit, jnp
from notchflex.chain import Chain
from notchflex.statics.actuation import Command
from notchflex.statics.newton import Settings
from notchflex.statics.quantities import Quantities, notch_lips, quantities
from notchflex.statics.stability import held_stiffness
from notchflex.statics.stepping import Advance, Solved, advance
from notchflex.statics.walk import evaluate


class Run(NamedTuple):
    """States of many loads, loads as leading axis.

    Attributes:
        solved: The last solved state at each load: its own, or as far as it could be followed.
        before: What is reported of the state before the first load, without leading axis.
        quantities: What is reported of each state.
        residual: Largest scaled imbalance of the last attempt.
        iterations: Newton iterations.
        converged: Whether the load was reached.
        tried: Whether it was tried at all; after a failure the rest of a path is not.
        reached: Part of the way from the load before that was reached.
    """

    solved: Solved
    before: Quantities
    quantities: Quantities
    residual: Float[Array, " s"]
    iterations: Int[Array, " s"]
    converged: Bool[Array, " s"]
    tried: Bool[Array, " s"]
    reached: Float[Array, " s"]


# Numbers of loads that programs are compiled for: a solve, a usual path, and longer ones.
_SIZES = (1, 128, 4096)


def run(
    chain: Chain, commands: Command, start: Solved, settings: Settings, *, each_from_start: bool
) -> Run:
    """Follow loads, each from the state before or each from the same one.

    Args:
        chain: The chain.
        commands: The loads, as leading axis.
        start: The state before the first.
        settings: How hard to try.
        each_from_start: Whether every load starts from `start`.

    Returns:
        One entry per load.
    """
    count = len(commands.value)
    padded = _pad(commands)
    wanted = np.arange(len(padded.value)) < count
    came = _run(chain, padded, wanted, start, settings, np.asarray(each_from_start))
    before = jax.tree.map(np.asarray, came.before)
    came = came._replace(before=())
    return jax.tree.map(lambda leaf: np.asarray(leaf)[:count], came)._replace(before=before)


def stability(chain: Chain, commands: Command, solved: Solved) -> tuple[np.ndarray, np.ndarray]:
    """Smallest real part of the stiffness's eigenvalues and sign of the determinant, by state."""
    count = len(commands.value)
    padded = _pad(commands)
    wanted = np.arange(len(padded.value)) < count
    stiffness, sign = _stability(chain, padded, _pad(solved), wanted)
    held = np.asarray(stiffness)[:count]
    whole = np.isfinite(held).all(axis=(1, 2))
    eigenvalue = np.full(count, np.nan)
    eigenvalue[whole] = np.real(np.linalg.eigvals(held[whole])).min(axis=-1)
    return eigenvalue, np.asarray(sign)[:count]


def lips(
    chain: Chain, commands: Command, start: Solved, settings: Settings
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact forces (N) and gaps (mm) of all notches, each load from the same state.

    A small program beside `run`, for questions that are asked again and again: only whether the
    notches are closed, and no other quantity.

    Returns:
        Contact forces and gaps, loads by notches, and which loads converged.
    """
    force, gap, converged = _lips(chain, commands, start, settings)
    return np.asarray(force), np.asarray(gap), np.asarray(converged)


@jit
def _lips(
    chain: Chain, commands: Command, start: Solved, settings: Settings
) -> tuple[Array, Array, Array]:
    def at_lips(command: Command) -> tuple[Array, Array, Array]:
        came = advance(chain, command, start, settings)
        point = came.solved.point
        at = evaluate(
            chain, point.unknowns, came.solved.memory, point.base_tension, came.solved.applied
        )
        force, gap = notch_lips(chain, point.unknowns, at)
        return force, gap, came.converged

    return jax.lax.map(at_lips, commands)


def _pad(tree: Any) -> Any:
    """Repeat the last entry until the leading axis has one of the sizes."""
    count = len(jax.tree.leaves(tree)[0])
    size = next((size for size in _SIZES if size >= count), -(-count // _SIZES[-1]) * _SIZES[-1])
    index = np.minimum(np.arange(size), count - 1)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], tree)


@jit
def _run(
    chain: Chain,
    commands: Command,
    wanted: Bool[Array, " s"],
    start: Solved,
    settings: Settings,
    each_from_start: Bool[Array, ""],
) -> Run:
    def follow(
        state: tuple[Solved, Array], item: tuple[Command, Array]
    ) -> tuple[tuple[Solved, Array], tuple[Advance, Array]]:
        last, alive = state
        command, own = item
        before = jax.tree.map(
            lambda first, current: jnp.where(each_from_start, first, current), start, last
        )
        tried = own & (alive | each_from_start)
        came = jax.lax.cond(
            tried,
            lambda: advance(chain, command, before, settings),
            lambda: _not_tried(before),
        )
        return (came.solved, alive & came.converged), (came, tried)

    _, (came, tried) = jax.lax.scan(follow, (start, jnp.array(True)), (commands, wanted))
    with_start = jax.tree.map(
        lambda leaf, first: jnp.concatenate([leaf, jnp.asarray(first)[None]]), came.solved, start
    )
    every = jax.lax.map(lambda solved: quantities(chain, solved), with_start)
    return Run(
        solved=came.solved,
        before=jax.tree.map(lambda leaf: leaf[-1], every),
        quantities=jax.tree.map(lambda leaf: leaf[:-1], every),
        residual=came.residual,
        iterations=came.iterations,
        converged=came.converged,
        tried=tried,
        reached=came.reached,
    )


@jit
def _stability(
    chain: Chain, commands: Command, solved: Solved, wanted: Bool[Array, " s"]
) -> tuple[Array, Array]:
    modes = chain.stiffness.size

    def one(item: tuple[Command, Solved, Array]) -> tuple[Array, Array]:
        command, state, own = item
        nothing = (jnp.full((modes, modes), jnp.nan), jnp.array(jnp.nan))
        return jax.lax.cond(own, lambda: held_stiffness(chain, command, state), lambda: nothing)

    return jax.lax.map(one, (commands, solved, wanted))


def _not_tried(last: Solved) -> Advance:
    return Advance(
        solved=last,
        residual=jnp.array(jnp.nan),
        iterations=jnp.zeros((), int),
        converged=jnp.array(False),
        reached=jnp.zeros(()),
    )
