"""Limit points between two solved states, where the resistance of a notch falls as it closes.

Beyond a limit point no equilibrium exists under a higher tension: the notch snaps to another shape.
Between the two states the holding tension of the notch has passed an extremum, which no sequence of
equilibria under a monotonic tension can do.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Iterate
from notchflex.solver.residual import evaluate
from notchflex.solver.solver_state import SolverState

# Number of shapes between the two, and the smallest relative fall of the holding tension.
_SHAPES_BETWEEN, _MIN_FALL = 33, 1e-6


def snapped_notches(chain: Chain, before: SolverState, after: SolverState) -> Float[Array, " n"]:
    """Find the notches that have passed a limit point from one state to the next.

    Every notch moves from its first shape to its last, under a constant tension. Its resistance
    over the drive of tendons and loads is its holding tension, relative to that tension, as long as
    its edges do not touch. The friction of its own edge grows with its angle; that of the notches
    before it is that of the second state.

    Args:
        chain: The chain.
        before: A solved state.
        after: The next, under other tensions.

    Returns:
        1 for every notch that snapped shut, -1 for one that snapped open, 0 for the others.
    """
    first, last = before.point.unknowns.modes, after.point.unknowns.modes
    change = last - first
    tension = jnp.maximum(before.point.base_tension, after.point.base_tension)
    free = tuple(jnp.zeros_like(force) for force in after.point.unknowns.contact_force)
    unknowns = after.point.unknowns._replace(contact_force=free)

    slid = jax.tree.map(jnp.subtract, after.memory.slid, before.memory.slid)
    offset = chain.friction.offset()

    def balance_at(part: Array) -> tuple[Array, Array, Array]:
        """Compute resistance, drive and 1 where the edges are apart, at a fraction of the way."""
        point = Iterate(unknowns._replace(modes=first + part * change), tension)
        at = evaluate(chain, point, before.memory, after.applied)
        resistance = jnp.sum(at.flexure.internal * change, axis=-1)
        missing = jnp.sum(at.residual.modes * chain.stiffness * change, axis=-1)
        # With the friction of a notch's own edge, relative to the end: a contact slides all the way
        # in the direction of its total slip, so its log ratio is its bound. Several tendons are
        # weighted with their tensions.
        left, all_tension = jnp.zeros(()), jnp.zeros(())
        for span, last, slip in zip(at.spans, unknowns.log_ratio, slid, strict=True):
            log_ratio = jnp.sign(slip[..., 0]) * span.bound[..., 0]
            raised = (span.gap_tension + offset) * jnp.exp(last[..., 0] - log_ratio)
            left = left + jnp.sum(jnp.where(span.gap_tension > 0.0, raised - offset, 0.0), axis=-1)
            all_tension = all_tension + jnp.sum(span.gap_tension, axis=-1)
        tight = all_tension > 0.0
        own_edge = jnp.where(tight, left / jnp.where(tight, all_tension, 1.0), 1.0)
        drive = own_edge * (resistance - missing)
        apart = jnp.ones(chain.flexures)
        for group, response in zip(chain.contact_pairs, at.contacts, strict=True):
            touches = (response.gap <= 0.0) & (group.has_contact > 0.0)
            apart = jnp.where(jnp.any(touches, axis=-1), 0.0, apart)
        return resistance, drive, apart

    parts = constant(0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SHAPES_BETWEEN)))
    none = jnp.zeros(())
    resistance, drive, apart = jax.lax.scan(lambda _, part: (none, balance_at(part)), none, parts)[
        1
    ]
    driven = jnp.abs(drive) > 0.0
    holding_tension = resistance / jnp.where(driven, drive, 1.0)
    counts = driven & (apart > 0.0)
    # The tendons do work on a notch that closes; one that opens does work on them.
    closes = jnp.sum(jnp.where(counts, drive, 0.0), axis=0) > 0.0
    rising = jnp.where(closes[None], holding_tension, -holding_tension)
    so_far = jax.lax.associative_scan(jnp.maximum, jnp.where(counts, rising, -jnp.inf), axis=0)
    size = jnp.max(jnp.where(counts, jnp.abs(holding_tension), 0.0), axis=0)
    falls = jnp.any(counts & (so_far - rising > _MIN_FALL * size[None]), axis=0)
    return jnp.where(falls, jnp.where(closes, 1.0, -1.0), 0.0)
