"""Newton's linear step by elimination along the chain: O(n), never a dense matrix.

Linearised, an element couples only to its neighbours:

    residual + A du + B dcarried + C dbeyond = 0
    dcarried_out = Yu du + Yc dcarried,   dbehind = Zu du + Zc dcarried + Zb dbeyond

All elements eliminate their own unknowns at once. What each then says is

    dcarried_out = y + Y1 dcarried + Y2 dbeyond,   dbehind = z + Z1 dcarried + Z2 dbeyond

From the tip on, beyond which is nothing, a loop over the elements eliminates what comes back from
beyond each, until at the base only the tensions are left to find. A second loop goes from the base
to the tip and finds what passes between neighbours. It is the elimination of a block-tridiagonal
matrix; the program holds one element's part of it, whatever the length of the chain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.actuation import command_residual
from notchflex.solver.element import Memory, Unknowns
from notchflex.solver.layout import Layout, layout
from notchflex.solver.linearisation import blocks
from notchflex.solver.residual import Evaluation

_HELD, _TIED = 1e-9, 1e-7


class Step(NamedTuple):
    """A linear step.

    Attributes:
        unknowns: Change of the unknowns.
        base_tension: Change of the base tensions, N.
    """

    unknowns: Unknowns
    base_tension: Float[Array, " t"]


def linear_step(
    chain: Chain,
    command: Command,
    unknowns: Unknowns,
    memory: Memory,
    base_tension: Float[Array, " t"],
    at: Evaluation,
) -> Step:
    """Solve the linearised balance for the step that would meet it.

    Args:
        chain: The chain.
        command: What is demanded of the tendons.
        unknowns: Where the chain is.
        memory: What its contacts remember.
        base_tension: Its base tensions, N.
        at: Its evaluation there.

    Its derivatives are those of the imbalance it meets, not those of the linear system: a step
    from a solved state then changes as the solution does (implicit function theorem).

    Returns:
        The step.
    """
    form = layout(chain, by_stroke=command.by_stroke is not None)
    here = (chain, unknowns, memory, command.applied, at)
    rows = blocks(*jax.tree.map(jax.lax.stop_gradient, here), form=form)
    imbalance = jax.vmap(lambda tree: ravel_pytree(tree)[0])(at.residual)
    own = form.unknowns
    # Own unknowns as functions of 1, what is carried, and what comes back: du = answer @ (1, c, b).
    right = jnp.concatenate([imbalance[..., None], rows.residual[..., own:]], axis=-1)
    answer = -eliminated(rows.residual[..., :own], right)

    def answered(row: Array) -> Array:
        unasked = jnp.pad(row[..., own:], ((0, 0), (0, 0), (1, 0)))
        return unasked + row[..., :own] @ answer

    leave = _leaving(chain, form)
    passed, back = _from_tip(answered(rows.onward), answered(rows.behind), form)
    tension_step = command.value - base_tension
    if command.by_stroke is not None:
        by_tension = jnp.concatenate([back[:, :1], back[:, 1:] @ leave], axis=1)
        tension_step = _drawn(chain, command, base_tension, at, by_tension)
    known = _from_base(passed, jnp.asarray(leave) @ tension_step)
    steps = jnp.einsum("nuz,nz->nu", answer, known)
    _, unknowns_of = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], unknowns))
    return Step(jax.vmap(unknowns_of)(steps), tension_step)


def _drawn(
    chain: Chain,
    command: Command,
    base_tension: Float[Array, " t"],
    at: Evaluation,
    back: Float[Array, "b 1+t"],
) -> Float[Array, " t"]:
    """Change of the base tensions that meets the strokes, from what the whole chain hands back."""
    order = chain.tendon_order
    assert command.by_stroke is not None

    def demand(tension: Array, drawn: Array, stretch: Array) -> Array:
        base = at.base._replace(drawn=drawn, stretch=stretch)
        return command_residual(chain, command, tension, base)

    here = (base_tension, at.base.drawn, at.base.stretch)
    slopes = jax.jacfwd(demand, argnums=(0, 1, 2))(*jax.tree.map(jax.lax.stop_gradient, here))
    back = back[len(back) - 2 * len(order) :].reshape(2, len(order), -1)
    # Rows in the order of the robot's tendons.
    drawn, stretch = jnp.stack([back[:, place] for place in np.argsort(order)], axis=1)
    by_base = slopes[1] @ drawn + slopes[2] @ stretch
    matrix = slopes[0] + by_base[:, 1:]
    # Where every contact counts as stuck by a tie, the stroke does not depend on the tension; a
    # small entry keeps such a step finite.
    tied = command.by_stroke & (jnp.abs(jnp.diag(matrix)) < _TIED)
    missing = demand(*here) + by_base[:, 0]
    return -eliminated(matrix + _HELD * jnp.diag(tied.astype(float)), missing[:, None])[:, 0]


def _leaving(chain: Chain, form: Layout) -> Float[np.ndarray, "c t"]:
    """What is carried to the first flexure, per unit of base tension: the tension itself."""
    order, carried = chain.tendon_order, form.carried
    leave = np.zeros((carried, chain.tendons))
    leave[carried - len(order) + np.arange(len(order)), order] = 1.0
    return leave


def _from_tip(
    onward: Float[Array, "n c z"], behind: Float[Array, "n b z"], form: Layout
) -> tuple[tuple[Float[Array, "n c 1+c"], Float[Array, "n b 1+c"]], Float[Array, "b 1+c"]]:
    """Eliminate what passes between neighbours, one after the other from the tip on.

    Beyond the tip is nothing. Written as a loop: the compiled program does not grow with the chain.

    Args:
        onward: What each element carries on, as rows over (1, carried, from beyond).
        behind: What each hands back, likewise.
        form: What the rows are over.

    Returns:
        For each element what it carries on and what comes back to it, as rows over (1, carried to
        it), and what the first hands back.
    """
    own = 1 + form.carried
    one = constant(np.eye(form.carried))

    def join(back: Array, item: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        onward, behind = item
        by_back = onward[:, own:]
        right = _more(onward[:, :own], by_back @ back[:, 0])
        carried_on = eliminated(one - by_back @ back[:, 1:], right)
        returned = _more(back[:, 1:] @ carried_on, back[:, 0])
        return behind[:, :own] + behind[:, own:] @ returned, (carried_on, returned)

    back, passed = jax.lax.scan(join, jnp.zeros((form.beyond, own)), (onward, behind), reverse=True)
    return passed, back


def _more(rows: Float[Array, "k z"], by: Float[Array, " k"]) -> Float[Array, "k z"]:
    """Rows with something added to their first column, that of 1."""
    return jnp.concatenate([rows[:, :1] + by[:, None], rows[:, 1:]], axis=1)


def _from_base(
    passed: tuple[Float[Array, "n c 1+c"], Float[Array, "n b 1+c"]],
    carried: Float[Array, " c"],
) -> Float[Array, "n z"]:
    """(1, carried, from beyond) of every element, from what is carried to the first."""

    def follow(carried: Array, item: tuple[Array, Array]) -> tuple[Array, Array]:
        onward, returned = item
        given = jnp.concatenate([jnp.ones(1), carried])
        return onward @ given, jnp.concatenate([given, returned @ given])

    return jax.lax.scan(follow, carried, passed)[1]


def eliminated(
    matrix: Float[Array, "*n u u"], right: Float[Array, "*n u r"]
) -> Float[Array, "*n u r"]:
    """Solutions of small systems, by Gauss and Jordan.

    Pivots are taken as they come: modes first, whose stiffness is there, then what they give way
    under. A step leaves out the column that it has cleared. Steps are kept apart, or the compiler
    would work out the earlier ones again for every later one; as a loop they take twice as long,
    and many small factorisations by LAPACK, one after the other, two to seven times.
    """
    size = matrix.shape[-1]
    table = jnp.concatenate([matrix, right], axis=-1)
    for number in range(size):
        own = (np.arange(size) == number)[:, None]
        row = table[..., number : number + 1, :]
        pivot = row[..., 1:] * (1.0 / row[..., :1])  # one division costs as much as ten products
        # The pivot's row is put in, not reached by a difference, which would cost its digits.
        table = jnp.where(own, pivot, table[..., 1:] - table[..., :1] * pivot)
        table = jax.lax.optimization_barrier(table)
    return table
