"""The stiffness of a whole robot with its tendons held, by dense differentiation of the balance."""

from __future__ import annotations

from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.command import Command
from notchflex.mechanics.chain import Chain
from notchflex.solver.residual import (
    Iterate,
    Memory,
    SolverState,
    bound_side,
    command_residual,
    evaluate,
)

# Closed lips and tendons drawn by stroke are held by springs this much stiffer than the notches:
# they only stiffen; without it their forces would be multipliers and the stiffness not defined.
_HOLDING_STIFFNESS = 1e3
# A contact on its bound goes on sliding: it is taken as having slid by so much (mm).
_SLIP = 1e-3


def held_stiffness(
    chain: Chain, command: Command, solved: SolverState
) -> tuple[Float[Array, "modes modes"], Float[Array, ""]]:
    """Stiffness of the whole robot against its modes, and the sign of a determinant.

    Tension ratios, contact forces and base tensions are eliminated first: a contact that sticks
    holds its tendon, one that slides keeps its tension ratio at the bound, which moves with the
    shape. The stiffness is not symmetric then, so it is its eigenvalues that tell stability: its
    symmetric part has negative ones in states that nothing makes snap (a stuck contact adds the
    product of two different vectors).

    Args:
        chain: The chain.
        command: What is demanded of the tendons: by stroke a tendon is held, by tension it
            gives way.
        solved: The equilibrium.

    Returns:
        The stiffness, N mm per unit of mode squared (N mm/rad for arc notches), and the sign of
        the determinant of the whole system.
    """
    point = solved.point
    modes = point.unknowns.modes.size
    flat, point_of = ravel_pytree(point)
    here = evaluate(chain, point, solved.memory, solved.applied)
    slid = tuple(
        span.slid - _SLIP * bound_side(ratio, span.bound)
        for span, ratio in zip(here.spans, point.unknowns.log_ratio, strict=True)
    )
    memory = Memory(point.unknowns.log_ratio, slid, tuple(span.bound for span in here.spans))

    def imbalance(flat: Array) -> Array:
        varied: Iterate = point_of(flat)
        at = evaluate(chain, varied, memory, solved.applied)
        demand = command_residual(chain, command, None, at.base)
        residual = at.residual
        residual = residual._replace(modes=residual.modes * chain.stiffness)
        return ravel_pytree((residual, demand))[0]

    matrix = jax.jacfwd(imbalance)(flat)
    natural_gap = chain.rods.length.sum(-1)
    give = 1.0 / (_HOLDING_STIFFNESS * chain.contact_stiffness * natural_gap)
    softened = [jnp.zeros(modes)]
    softened += [
        jnp.broadcast_to(give[:, None], group.has_contact.shape).ravel()
        for group in chain.contact_pairs
    ]
    on_diagonal = jnp.concatenate(softened)
    rows = jnp.arange(len(on_diagonal))
    matrix = matrix.at[rows, rows].add(on_diagonal)
    drawn = len(flat) - chain.tendons + jnp.arange(chain.tendons)
    if command.by_stroke is not None:
        soft = command.by_stroke / (_HOLDING_STIFFNESS * chain.stroke_stiffness)
        matrix = matrix.at[drawn, drawn].add(soft)
    others = matrix[modes:, modes:]
    stiffness = matrix[:modes, :modes] - matrix[:modes, modes:] @ jnp.linalg.solve(
        others, matrix[modes:, :modes]
    )
    sign, _ = jnp.linalg.slogdet(matrix)
    return stiffness, sign
