"""Limit points that lie between two solved states: where a notch resists less, the more it closes.

A tension that pulls a notch to its limit point and on cannot hold it: the notch snaps, to another
shape under about the same tension. Between the two states the tension that would hold the notch has
passed an extremum, which no sequence of equilibria under a tension that rises or falls can do.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.solver.element import Unknowns
from notchflex.solver.residual import Evaluation, evaluate
from notchflex.solver.solver_state import SolverState

# Shapes between the two, and the part of the holding tension by which it must fall.
_SHAPES, _FALLS = 33, 1e-6


def snapped_notches(chain: Chain, before: SolverState, after: SolverState) -> Float[Array, " n"]:
    """Find the notches that have passed a limit point from one state to the next.

    Every notch is led from its first shape to its last. What it resists with, over what the
    tendons and loads drive it with under a constant tension, is the tension that holds it, as a
    part of that; as long as its lips do not touch. The friction of its own edge grows with its
    angle; that of the notches before it stays as it is after.

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

    def hold(part: Array) -> tuple[Array, Array, Array]:
        """Resistance, drive and whether the lips are apart, for a part of the way."""
        shape = unknowns._replace(modes=first + part * change)
        at = evaluate(chain, shape, before.memory, tension, after.applied)
        resists = jnp.sum(at.flexure.internal * change, axis=-1)
        missing = jnp.sum(at.residual.modes * chain.stiffness * change, axis=-1)
        drives = _own_friction(at, unknowns, slid) * (resists - missing)
        apart = jnp.ones(chain.flexures)
        for group, response in zip(chain.contact_pairs, at.contacts, strict=True):
            touches = (response.gap <= 0.0) & (group.has_contact > 0.0)
            apart = jnp.where(jnp.any(touches, axis=-1), 0.0, apart)
        return resists, drives, apart

    parts = constant(0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SHAPES)))
    none = jnp.zeros(())
    resists, drives, apart = jax.lax.scan(lambda _, part: (none, hold(part)), none, parts)[1]
    driven = jnp.abs(drives) > 0.0
    held = resists / jnp.where(driven, drives, 1.0)
    shown = driven & (apart > 0.0)
    # Of the work that a closing notch takes, the tendons do it; an opening one gives it back.
    closes = jnp.sum(jnp.where(shown, drives, 0.0), axis=0) > 0.0
    rising = jnp.where(closes[None], held, -held)
    so_far = jax.lax.associative_scan(jnp.maximum, jnp.where(shown, rising, -jnp.inf), axis=0)
    size = jnp.max(jnp.where(shown, jnp.abs(held), 0.0), axis=0)
    falls = jnp.any(shown & (so_far - rising > _FALLS * size[None]), axis=0)
    return jnp.where(falls, jnp.where(closes, 1.0, -1.0), 0.0)


def _own_friction(
    at: Evaluation, unknowns: Unknowns, slid: tuple[Float[Array, "n t 2"], ...]
) -> Float[Array, " n"]:
    """Return what the friction of each notch's own edge leaves of its drive, against the end.

    A contact slides all the way as it has slid in the whole: its log ratio goes with its bound. Of
    several tendons each counts by its tension.
    """
    left, all_tension = jnp.zeros(()), jnp.zeros(())
    for span, last, way in zip(at.spans, unknowns.log_ratio, slid, strict=True):
        log_ratio = jnp.sign(way[..., 0]) * span.bound[..., 0]
        left = left + jnp.sum(span.gap_tension * jnp.exp(last[..., 0] - log_ratio), axis=-1)
        all_tension = all_tension + jnp.sum(span.gap_tension, axis=-1)
    return jnp.where(all_tension > 0.0, left / jnp.where(all_tension > 0.0, all_tension, 1.0), 1.0)
