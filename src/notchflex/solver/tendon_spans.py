"""Spans of the tendons over all gaps: tensions, released lengths and bounds of friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import FlexureState
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.tendon import Crossing, TendonGroup
from notchflex.solver.body_poses import select_anchors


class TendonSpans(NamedTuple):
    """Tensions and lengths of a group of t tendons over all flexures, n by t (mm, N).

    Attributes:
        crossing: Its path over every gap.
        tension_ratio: Tension beyond each edge of the gap over the tension before it.
        gap_tension: Tension in the gap; 0 where the tendon has no span there.
        body_tension: Tension inside the distal body, likewise.
        released_beyond: Tendon length released by the flexures beyond the distal body.
        tension_length_beyond: Sum of tension times length beyond it, N mm.
        released_length: As `released_beyond`, with this gap.
        tension_length: As `tension_length_beyond`, with this gap and the distal body.
        slid: Tendon slid over both edges toward the base, with the stiffness of the friction law.
        bound: Largest log ratio at both edges, in the direction of the present one.
    """

    crossing: Crossing
    tension_ratio: Float[Array, "n t 2"]
    gap_tension: Float[Array, "n t"]
    body_tension: Float[Array, "n t"]
    released_beyond: Float[Array, "n t"]
    tension_length_beyond: Float[Array, "n t"]
    released_length: Float[Array, "n t"]
    tension_length: Float[Array, "n t"]
    slid: Float[Array, "n t 2"]
    bound: Float[Array, "n t 2"]


def crossings(
    group: TendonGroup, chain: Chain, flexure: FlexureState, anchors: Motion | None
) -> Crossing:
    """Return the paths of a group of tendons over all gaps."""
    selected = select_anchors(anchors, group.back) if group.acts_on_bodies else None
    return jax.vmap(type(group).cross)(group, chain.rods, flexure, selected)


def of_group(values: Float[Array, " all"], group: TendonGroup) -> Float[Array, " t"]:
    """Select the tendons of a group by slices, whose adjoint the native compiler supports."""
    return jnp.stack([values[number] for number in group.numbers])


def slip_mask(group: TendonGroup) -> Float[Array, "n t 2"]:
    """Return 1 where a tendon can slide over an edge: where it runs and is not fixed."""
    return jnp.stack([group.visits, group.visits * (1.0 - group.ends)], axis=-1)


def in_tendon_order(chain: Chain, grouped: tuple[Float[Array, "*shape t"], ...]) -> Array:
    """Order values per group of tendons as the robot's tendons, along the last axis."""
    if not grouped:
        return jnp.zeros(0)
    together = jnp.concatenate(grouped, axis=-1)
    return jnp.stack([together[..., column] for column in np.argsort(chain.tendon_order)], axis=-1)
