"""Linearisation of every flexure's residual, as rows over what changes around it.

The columns are the unknowns of the flexure, what is carried to it from the base side, and what
comes from the tip side. Motions of bodies are relative to the body before, forces act along the
body: a rotation of the whole robot changes nothing. Carried from the base side are

    the motion of bodies further back, as far as spans reach; the turn of the body against the base,
    where external loads keep their direction; the tensions

and from the tip side come

    the wrenches of spans and contacts that end beyond; those of the external loads, or their
    moments alone; the released lengths of the tendons and their tension times length.

JAX differentiates only the geometry of a span, a contact or a rod, each on its own.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import BodyLoads
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import geometric_stiffness, material_tangent
from notchflex.solver.element import (
    RATE,
    Memory,
    Unknowns,
    is_active,
    notch_heights,
    trial_log_ratio,
)
from notchflex.solver.linear_step.row_layout import RowLayout
from notchflex.solver.linear_step.tendon_jacobian import (
    StateJacobians,
    state_jacobians,
)
from notchflex.solver.linear_step.wrench_rows import wrench_rows
from notchflex.solver.residual import Evaluation
from notchflex.solver.tendon_spans import slip_mask


class LinearisedRows(NamedTuple):
    """Rows of all flexures, each over (own unknowns, carried, from beyond).

    Attributes:
        residual: Of the residual.
        onward: Of what is carried on to the next flexure.
        behind: Of what is handed back to the flexure before.
    """

    residual: Float[Array, "n u z"]
    onward: Float[Array, "n c z"]
    behind: Float[Array, "n b z"]


def linearise(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    applied: BodyLoads | None,
    at: Evaluation,
    form: RowLayout,
) -> LinearisedRows:
    """Linearise the residual of all flexures.

    Args:
        chain: The chain.
        unknowns: Its unknowns.
        memory: History of its contacts.
        applied: External loads on the bodies.
        at: Evaluation there.
        form: Layout of the rows.

    Returns:
        The rows.
    """
    unit = form.unit_rows()
    here = state_jacobians(chain, unknowns, memory, applied, at, unit)
    motion, tendons = here.motion, here.tendons
    balance, behind = _balance_rows(here)
    residual = [balance / chain.stiffness[..., None], *_contact_rows(here)]
    residual += [_friction_rows(here, k) for k in range(len(tendons))]
    onward = [-unit.spread(motion.relative[number]) for number in range(form.older)]
    onward += [] if motion.turn is None else [motion.turn]
    onward += [tendon.carried for tendon in tendons]
    behind += [tendon.released_length for tendon in tendons]
    behind += [one.tension_length for one in tendons if one.tension_length is not None]
    return LinearisedRows(*(_stack(chain, rows, form) for rows in (residual, onward, behind)))


def _stack(chain: Chain, rows: list[Array], form: RowLayout) -> Float[Array, "n k z"]:
    """Rows below each other; none where there are no rows."""
    if not rows:
        return jnp.zeros((chain.flexures, 0, form.unknowns + form.carried + form.beyond))
    return jnp.concatenate(rows, axis=1)


def _balance_rows(here: StateJacobians) -> tuple[Float[Array, "n m z"], list[Array]]:
    """Rows of the balance of modes, and of the wrenches handed back."""
    chain, at, unit = here.chain, here.at, here.unit
    elastic = chain.elastic
    if elastic is None:
        elastic = jax.vmap(material_tangent, in_axes=(0, None, 0, 0))(
            chain.rods, chain.law, here.memory.material, at.flexure
        )
        elastic = _never_singular(chain, elastic)
        if here.memory.drag is not None:
            elastic = elastic + here.memory.drag[0] * jax.vmap(jnp.diag)(chain.stiffness)
    behind: list[Array] = []
    if at.wrenches is None:
        balance = unit.spread(unit.of_modes(elastic))
    else:
        assert at.flexure.configuration is not None
        elastic = elastic - jax.vmap(geometric_stiffness)(
            chain.rods, here.unknowns.modes, at.flexure.configuration, at.wrenches.resultant
        )
        resultant, behind = wrench_rows(here)
        balance = unit.spread(unit.of_modes(elastic)) - jnp.einsum(
            "nwm,nwz->nmz", at.flexure.twist, resultant
        )
    for tendon, span in zip(here.tendons, at.spans, strict=True):
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("ntm,ntz->nmz", span.crossing.slope, tendon.gap_tension)
    for group, response, force in zip(
        chain.contact_pairs, at.contacts, unit.contact_pairs, strict=True
    ):
        if response.slope is not None:
            closing = group.has_contact[..., None] * response.slope
            balance = balance - jnp.einsum("nlm,lz->nmz", closing, force)
    return balance, behind


# A mode that resists by less than this part of its stiffness at rest is taken to resist so much:
# the root of the rounding error, so that neither the change nor what it cancels with is felt.
_LEAST_SLOPE = 1e-8


def _never_singular(chain: Chain, elastic: Float[Array, "n m m"]) -> Float[Array, "n m m"]:
    """Keep a plateau of the material law from leaving a mode without a pivot.

    Just beyond the strain where plastic hardening begins (exp(b / x) at x = 0) the law is flat to
    the last digit. The modes are eliminated first, so their pivots must not vanish there, though
    friction makes the whole system regular; without friction the step becomes long but finite, and
    the limits of a step apply to it.
    """
    diagonal = jnp.diagonal(elastic, axis1=1, axis2=2)
    least = _LEAST_SLOPE * chain.stiffness
    missing = jnp.where(jnp.abs(diagonal) < least, least, 0.0)
    return elastic + jax.vmap(jnp.diag)(missing)


def _contact_rows(here: StateJacobians) -> list[Array]:
    """Rows of Signorini's condition, for every kind of contacts."""
    chain, rows = here.chain, list[Array]()
    height = notch_heights(chain)[:, None, None]
    stiffness = chain.contact_stiffness[:, None, None]
    for group, response, force, unit_force, contact in zip(
        chain.contact_pairs,
        here.at.contacts,
        here.unknowns.contact_force,
        here.unit.contact_pairs,
        here.contacts,
        strict=True,
    ):
        active = is_active(chain.contact_stiffness, group.has_contact, force, response.gap)[
            ..., None
        ]
        closing = here.unit.spread(contact.gap)
        if chain.contact_flexibility is not None:
            closing = closing + chain.contact_flexibility[:, None, None] * unit_force[None]
        rows.append(jnp.where(active, closing / height, unit_force[None] / (stiffness * height)))
    return rows


def _friction_rows(here: StateJacobians, k: int) -> Float[Array, "n 2t z"]:
    """Rows of the friction law of both edges, of the k-th group."""
    chain, span, tendon = here.chain, here.at.spans[k], here.tendons[k]
    log_ratio, group = here.unknowns.log_ratio[k], here.chain.groups[k]
    crossing, ahead = span.crossing, span.gap_tension / span.tension_ratio[..., 0]
    turning, tension = (crossing.exit_turning, crossing.entry_turning), (ahead, span.gap_tension)
    none, one = jnp.zeros_like(ahead), jnp.ones_like(ahead)

    def slope(turns: tuple[Array, Array], pulls: tuple[Array, Array]) -> Array:
        """Differentiate the limits by turning angles and tensions, where contacts can slide."""
        limits = partial(chain.friction.limits, log_ratio=log_ratio)
        return slip_mask(group) * jax.jvp(limits, (*turning, tension), (*turns, pulls))[1]

    # Edges, then the turning angles that they depend on.
    by_turning = jnp.stack([slope(way, (none, none)) for way in ((one, none), (none, one))], -1)
    limit = here.unit.spread(jnp.einsum("ntes,nstz->ntez", by_turning, tendon.turning))
    if chain.friction.constant_loss(*turning) is not None:
        before = jnp.broadcast_to(here.unit.tension[k][None], tendon.gap_tension.shape)
        rows = jnp.stack([before, tendon.gap_tension], axis=2)
        limit = limit + slope((none, none), (one, one))[..., None] * rows
    height = notch_heights(chain)[:, None, None, None]
    stuck = -RATE * (tendon.at_edges / height - here.memory.give * tendon.log_ratio[None])
    value, bound = trial_log_ratio(chain, log_ratio, span.slid, here.memory, k), span.bound
    upper, lower = (value >= bound)[..., None], (value <= -bound)[..., None]
    slides = tendon.log_ratio[None] - jnp.where(upper, limit, -limit)
    rows = jnp.where(upper | lower, slides, stuck)
    return rows.reshape(chain.flexures, -1, rows.shape[-1])
