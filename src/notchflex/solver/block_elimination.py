"""Newton's linear step by elimination along the chain: O(n), never a dense matrix.

Linearised, an element couples only to its neighbours:

    residual + A du + B dcarried + C dbeyond = 0
    dnext = Yu du + Yc dcarried,   dprevious = Zu du + Zc dcarried + Zb dbeyond

All elements eliminate their own unknowns at once, which leaves

    dnext = y + Y1 dcarried + Y2 dbeyond,   dprevious = z + Z1 dcarried + Z2 dbeyond

`_condense` eliminates dbeyond of one element after the other from the tip, until only the tensions
at the base are unknown; substitution then goes from the base to the tip. This is the
elimination of a block-tridiagonal matrix, in two loops: the program does not grow with the chain.
"""

from __future__ import annotations

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.linear_step import UnitRows, linearise, unit_rows
from notchflex.solver.residual import Evaluation, Iterate, Memory, command_residual, command_slopes

# Slopes of a stroke below the second count as zero; the first is added to their pivots.
_PIVOT_SHIFT, _ZERO_SLOPE = 1e-9, 1e-7


def linear_step(
    chain: Chain,
    command: Command,
    point: Iterate,
    memory: Memory,
    evaluation: Evaluation,
) -> Iterate:
    """Solve the linearised balance at a point for the step to equilibrium."""
    # Derivatives of the step are those of the residual, not those of the linear system: a step from
    # a solved state then changes as the solution does (implicit function theorem).
    unit = unit_rows(chain, by_stroke=command.by_stroke is not None)
    unknowns = point.unknowns
    state = (chain, unknowns, memory, command.applied, evaluation)
    rows = linearise(*jax.tree.map(jax.lax.stop_gradient, state), unit=unit)
    residual = jax.vmap(lambda tree: ravel_pytree(tree)[0])(evaluation.residual)
    size = unit.unknowns
    # Own unknowns as functions of 1, carried and beyond: du = response @ (1, c, b).
    right = jnp.concatenate([residual[..., None], rows.residual[..., size:]], axis=-1)
    response = -gauss_jordan(rows.residual[..., :size], right)

    def insert(row: Array) -> Array:
        rest = jnp.pad(row[..., size:], ((0, 0), (0, 0), (1, 0)))
        return rest + row[..., :size] @ response

    # What is carried to the first flexure per unit of base tension: the tension itself.
    order, at_base = chain.tendon_order, np.zeros((unit.carried, chain.tendons))
    at_base[unit.carried - len(order) + np.arange(len(order)), order] = 1.0
    condensed, back = _condense(insert(rows.to_next), insert(rows.to_previous), unit)
    tension_step = command.target - point.base_tension
    if command.by_stroke is not None:
        slopes, count = command_slopes(chain, command, evaluation.base), len(order)
        by_tension = jnp.concatenate([back[:, :1], back[:, 1:] @ at_base], axis=1)
        lengths = by_tension[len(back) - 2 * count :].reshape(2, count, -1)
        # Rows in the order of the robot's tendons.
        released, stretched = jnp.stack([lengths[:, row] for row in np.argsort(order)], axis=1)
        by_base = slopes[1] @ released + slopes[2] @ stretched
        matrix = slopes[0] + by_base[:, 1:]
        # Where every contact sticks, the stroke does not depend on the tension; a small pivot keeps
        # the step finite.
        undetermined = command.by_stroke & (jnp.abs(jnp.diag(matrix)) < _ZERO_SLOPE)
        missing = command_residual(chain, command, evaluation.base) + by_base[:, 0]
        pivots = _PIVOT_SHIFT * jnp.diag(undetermined.astype(float))
        tension_step = -gauss_jordan(matrix + pivots, missing[:, None])[:, 0]

    def follow(carried: Array, blocks: tuple[Array, Array]) -> tuple[Array, Array]:
        to_next, returned = blocks
        homogeneous = jnp.concatenate([jnp.ones(1), carried])
        return to_next @ homogeneous, jnp.concatenate([homogeneous, returned @ homogeneous])

    # (1, carried, from beyond) of every element, from the base to the tip.
    surroundings = jax.lax.scan(follow, jnp.asarray(at_base) @ tension_step, condensed)[1]
    steps = jnp.einsum("nuz,nz->nu", response, surroundings)
    _, unknowns_of = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], unknowns))
    return Iterate(jax.vmap(unknowns_of)(steps), tension_step)


def _condense(
    to_next: Float[Array, "n c z"], to_previous: Float[Array, "n b z"], unit: UnitRows
) -> tuple[tuple[Float[Array, "n c 1+c"], Float[Array, "n b 1+c"]], Float[Array, "b 1+c"]]:
    """Eliminate the couplings of neighbours from the tip: rows over (1, carried, from beyond)."""
    # Returns rows over (1, carried) of what every element carries to the next and receives from it,
    # and of what the first hands to the base.
    size = 1 + unit.carried
    identity = constant(np.eye(unit.carried))

    def join(back: Array, item: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
        to_next, to_previous = item
        by_back = to_next[:, size:]
        right = _add_constant(to_next[:, :size], by_back @ back[:, 0])
        carried_on = gauss_jordan(identity - by_back @ back[:, 1:], right)
        returned = _add_constant(back[:, 1:] @ carried_on, back[:, 0])
        return to_previous[:, :size] + to_previous[:, size:] @ returned, (carried_on, returned)

    at_tip = jnp.zeros((unit.beyond, size))
    back, condensed = jax.lax.scan(join, at_tip, (to_next, to_previous), reverse=True)
    return condensed, back


def _add_constant(rows: Float[Array, "k z"], by: Float[Array, " k"]) -> Float[Array, "k z"]:
    """Add constants to the first column of rows, that of 1."""
    return jnp.concatenate([rows[:, :1] + by[:, None], rows[:, 1:]], axis=1)


def gauss_jordan(
    matrix: Float[Array, "*n u u"], right: Float[Array, "*n u r"]
) -> Float[Array, "*n u r"]:
    """Solve small systems by Gauss-Jordan elimination without pivoting."""
    # Modes come first: their stiffness makes their pivots safe. A step drops the column that it has
    # cleared. The barrier keeps the compiler from recomputing earlier steps for every later one; a
    # loop takes twice as long, and many small factorisations by LAPACK two to seven times.
    size = matrix.shape[-1]
    table = jnp.concatenate([matrix, right], axis=-1)
    for number in range(size):
        is_pivot = (np.arange(size) == number)[:, None]
        row = table[..., number : number + 1, :]
        pivot = row[..., 1:] * (1.0 / row[..., :1])  # one division costs as much as ten products
        # The pivot's row is inserted, since a difference would lose its digits.
        table = jnp.where(is_pivot, pivot, table[..., 1:] - table[..., :1] * pivot)
        table = jax.lax.optimization_barrier(table)
    return table
