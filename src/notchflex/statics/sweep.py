"""Newton's linear step by elimination along the chain: O(n), never a dense matrix.

Linearised, an element couples only to its neighbours:

    residual + A du + B dcarried + C dbeyond = 0
    dcarried_out = Yu du + Yc dcarried,   dbehind = Zu du + Zc dcarried + Zb dbeyond

All elements eliminate their own unknowns at once. What each then says is

    dcarried_out = y + Y1 dcarried + Y2 dbeyond,   dbehind = z + Z1 dcarried + Z2 dbeyond

and two neighbours together say the same of their ends (Redheffer's star product), what passes
between them being eliminated. So all neighbours are joined at once, then all pairs of them, until
few are left: a few wide operations instead of many narrow ones. These few are joined from the tip
on, beyond which is nothing, until at the base only the tensions are left to find. On the way back
every pair learns what passes between its two. It is the elimination of a block-tridiagonal matrix
by nested dissection.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.chain import Chain
from notchflex.statics.actuation import Command, command_residual
from notchflex.statics.element import Memory, Unknowns
from notchflex.statics.layout import Layout, layout
from notchflex.statics.linear import blocks
from notchflex.statics.walk import Evaluation

_HELD, _TIED = 1e-9, 1e-7
# So many parts of the chain are joined one by one, where a vector holds what is done to several.
ONE_BY_ONE = 4


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
    one_by_one: int = ONE_BY_ONE,
) -> Step:
    """Solve the linearised balance for the step that would meet it.

    Args:
        chain: The chain.
        command: What is demanded of the tendons.
        unknowns: Where the chain is.
        memory: What its contacts remember.
        base_tension: Its base tensions, N.
        at: Its evaluation there.
        one_by_one: How many parts of the chain are joined one after the other and not side by side:
            that is less to do, but nothing can be done at once.

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

    ports = Ports(answered(rows.onward), answered(rows.behind))
    levels: list[Ports] = []
    while len(ports.onward) > one_by_one:
        between, ports = _joined(ports, form.carried)
        levels.append(between)
    leave = _leaving(chain, form)
    passed, back = _from_tip(ports, leave)
    tension_step = command.value - base_tension
    if command.by_stroke is not None:
        tension_step = _drawn(chain, command, base_tension, at, back)
    known = _from_base(passed, tension_step, leave, form.beyond)
    for between in reversed(levels):
        known = _parted(between, known, form.carried)
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
    drawn, stretch = jnp.zeros_like(back).at[:, order].set(back)
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


class Ports(NamedTuple):
    """What parts of the chain, base to tip, say of their ends: over (1, carried, from beyond).

    Attributes:
        onward: What is carried out of each part; between two parts, from the one to the other.
        behind: What is handed back by each; between two parts, from the other to the one.
    """

    onward: Float[Array, "parts c z"]
    behind: Float[Array, "parts b z"]


def _joined(ports: Ports, carried: int) -> tuple[Ports, Ports]:
    """Join neighbours: what passes between the two of each pair, and all parts that are left."""
    whole = len(ports.onward) // 2 * 2
    (first, first_back), (second, second_back) = (
        (ports.onward[start:whole:2], ports.behind[start:whole:2]) for start in (0, 1)
    )
    own = 1 + carried
    # What is carried to the second part, put in terms of what comes back to it from beyond.
    returned = first[..., own:] @ second_back
    closed = jnp.eye(carried)[None] - returned[..., 1:own]
    right = [first[..., :1] + returned[..., :1], first[..., 1:own], returned[..., own:]]
    between = eliminated(closed, jnp.concatenate(right, axis=-1))
    back = _without(second_back, own) + second_back[..., 1:own] @ between
    onward = _without(second, own) + second[..., 1:own] @ between
    own_back = jnp.pad(first_back[..., :own], ((0, 0), (0, 0), (0, back.shape[1])))
    behind = own_back + first_back[..., own:] @ back
    left = Ports(
        jnp.concatenate([onward, ports.onward[whole:]]),
        jnp.concatenate([behind, ports.behind[whole:]]),
    )
    return Ports(between, back), left


def _from_tip(
    ports: Ports, leave: Float[np.ndarray, "c t"]
) -> tuple[list[tuple[Array, Array]], Float[Array, "b 1+t"]]:
    """Join the parts that are left one after the other, from the tip on, beyond which is nothing.

    Returns:
        For each part but the last, what it carries on and what comes back to it, as rows over 1 and
        what is carried to it; to the first, the base tensions. And what the first hands back.
    """
    own, last = 1 + len(leave), len(ports.onward) - 1

    def split(rows: Array, number: int) -> tuple[Array, Array]:
        to_it = rows[:, :own]
        if number == 0:
            to_it = jnp.concatenate([rows[:, :1], rows[:, 1:own] @ leave], axis=1)
        return to_it, rows[:, own:]

    passed: list[tuple[Array, Array]] = []
    back, _ = split(ports.behind[last], last)
    for number in reversed(range(last)):
        onward, by_back = split(ports.onward[number], number)
        closed = jnp.eye(len(leave)) - by_back @ back[:, 1:]
        onward = eliminated(closed, _more(onward, by_back @ back[:, 0]))
        returned = _more(back[:, 1:] @ onward, back[:, 0])
        passed.insert(0, (onward, returned))
        back, by_back = split(ports.behind[number], number)
        back = back + by_back @ returned
    return passed, back


def _more(rows: Float[Array, "k z"], by: Float[Array, " k"]) -> Float[Array, "k z"]:
    """Rows with something added to their first column, that of 1."""
    return jnp.concatenate([rows[:, :1] + by[:, None], rows[:, 1:]], axis=1)


def _from_base(
    passed: list[tuple[Array, Array]],
    tension_step: Float[Array, " t"],
    leave: Float[np.ndarray, "c t"],
    beyond: int,
) -> Float[Array, "parts z"]:
    """(1, carried, from beyond) of the parts that were joined one after the other."""
    one, known = jnp.ones(1), []
    to_it, carried = tension_step, leave @ tension_step
    for onward, returned in passed:
        given = jnp.concatenate([one, to_it])
        known.append(jnp.concatenate([one, carried, returned @ given]))
        to_it = carried = onward @ given
    return jnp.stack([*known, jnp.concatenate([one, carried, jnp.zeros(beyond)])])


def _without(rows: Float[Array, "parts k z"], own: int) -> Float[Array, "parts k z"]:
    """Rows without what they say of what is carried."""
    return jnp.concatenate(
        [rows[..., :1], jnp.zeros_like(rows[..., 1:own]), rows[..., own:]], axis=-1
    )


def _parted(between: Ports, known: Float[Array, "parts z"], carried: int) -> Float[Array, "more z"]:
    """From (1, carried, from beyond) of joined parts to those of the parts they were made of."""
    pairs = len(between.onward)
    outer, own = known[:pairs], 1 + carried
    carried_on = jnp.einsum("pcz,pz->pc", between.onward, outer)
    back = jnp.einsum("pbz,pz->pb", between.behind, outer)
    first = jnp.concatenate([outer[:, :own], back], axis=1)
    second = jnp.concatenate([outer[:, :1], carried_on, outer[:, own:]], axis=1)
    both = jnp.stack([first, second], axis=1).reshape(2 * pairs, -1)
    return jnp.concatenate([both, known[pairs:]])


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
