"""Linearisation of every flexure's residual, as rows over all that it depends on.

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
from notchflex.loads.command import BodyLoads
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import geometric_stiffness, material_tangent
from notchflex.solver.element import (
    AUGMENTATION,
    Memory,
    Unknowns,
    is_active,
    notch_heights,
    trial_log_ratio,
)
from notchflex.solver.linear_step.rows import (
    RowLayout,
    StateJacobians,
    state_jacobians,
    wrench_rows,
)
from notchflex.solver.residual import Evaluation
from notchflex.solver.tendon_spans import slip_mask


class LinearisedRows(NamedTuple):
    """Rows of all flexures, each over (own unknowns, carried, from beyond).

    Attributes:
        residual: Of the residual.
        to_next: Of what is passed to the next flexure.
        to_previous: Of what is passed to the previous flexure.
    """

    residual: Float[Array, "n u z"]
    to_next: Float[Array, "n c z"]
    to_previous: Float[Array, "n b z"]


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
    jacobians = state_jacobians(chain, unknowns, memory, applied, at, unit)
    motion, tendons = jacobians.motion, jacobians.tendons
    balance, to_previous = _balance_rows(jacobians)
    residual = [balance / chain.stiffness[..., None], *_contact_rows(jacobians)]
    residual += [_friction_rows(jacobians, k) for k in range(len(tendons))]
    to_next = [-unit.spread(motion.relative[number]) for number in range(form.older)]
    to_next += [] if motion.turn is None else [motion.turn]
    to_next += [tendon.carried for tendon in tendons]
    to_previous += [tendon.released_length for tendon in tendons]
    to_previous += [one.tension_length for one in tendons if one.tension_length is not None]
    return LinearisedRows(*(_stack(chain, rows, form) for rows in (residual, to_next, to_previous)))


def _stack(chain: Chain, rows: list[Array], form: RowLayout) -> Float[Array, "n k z"]:
    """Stack rows; of an empty list, return none."""
    if not rows:
        return jnp.zeros((chain.flexures, 0, form.unknowns + form.carried + form.beyond))
    return jnp.concatenate(rows, axis=1)


def _balance_rows(jacobians: StateJacobians) -> tuple[Float[Array, "n m z"], list[Array]]:
    """Compute the rows of equilibrium of the modes, and of the wrenches to the previous body."""
    chain, at, unit = jacobians.chain, jacobians.at, jacobians.unit
    elastic = chain.elastic
    if elastic is None:
        elastic = jax.vmap(material_tangent, in_axes=(0, None, 0, 0))(
            chain.rods, chain.law, jacobians.memory.material, at.flexure
        )
        elastic = _regularise_pivots(chain, elastic)
        if jacobians.memory.damping is not None:
            elastic = elastic + jacobians.memory.damping[0] * jax.vmap(jnp.diag)(chain.stiffness)
    to_previous: list[Array] = []
    if at.wrenches is None:
        balance = unit.spread(unit.of_modes(elastic))
    else:
        assert at.flexure.configuration is not None
        elastic = elastic - jax.vmap(geometric_stiffness)(
            chain.rods, jacobians.unknowns.modes, at.flexure.configuration, at.wrenches.resultant
        )
        resultant, to_previous = wrench_rows(jacobians)
        balance = unit.spread(unit.of_modes(elastic)) - jnp.einsum(
            "nwm,nwz->nmz", at.flexure.twist, resultant
        )
    for tendon, span in zip(jacobians.tendons, at.spans, strict=True):
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("ntm,ntz->nmz", span.crossing.slope, tendon.gap_tension)
    for group, response, force in zip(
        chain.contact_pairs, at.contacts, unit.contact_pairs, strict=True
    ):
        if response.slope is not None:
            closing = group.has_contact[..., None] * response.slope
            balance = balance - jnp.einsum("nlm,lz->nmz", closing, force)
    return balance, to_previous


# Smallest slope of a mode, as a fraction of its stiffness at rest: the root of the rounding error,
# so that neither the shift nor the cancelled digits matter.
_MIN_RELATIVE_SLOPE = 1e-8


def _regularise_pivots(chain: Chain, elastic: Float[Array, "n m m"]) -> Float[Array, "n m m"]:
    """Shift pivots that vanish on a plateau of the material law.

    Just beyond the strain where plastic hardening begins (exp(b / x) at x = 0) the law is flat to
    the last digit. The modes are eliminated first, so their pivots must not vanish, though friction
    makes the whole system regular. Without friction the step becomes long but finite, and the
    limits of a step apply to it.
    """
    diagonal = jnp.diagonal(elastic, axis1=1, axis2=2)
    min_slope = _MIN_RELATIVE_SLOPE * chain.stiffness
    missing = jnp.where(jnp.abs(diagonal) < min_slope, min_slope, 0.0)
    return elastic + jax.vmap(jnp.diag)(missing)


def _contact_rows(jacobians: StateJacobians) -> list[Array]:
    """Compute the rows of Signorini's condition, for every kind of contacts."""
    chain, rows = jacobians.chain, list[Array]()
    height = notch_heights(chain)[:, None, None]
    stiffness = chain.contact_stiffness[:, None, None]
    for group, response, force, unit_force, contact in zip(
        chain.contact_pairs,
        jacobians.at.contacts,
        jacobians.unknowns.contact_force,
        jacobians.unit.contact_pairs,
        jacobians.contacts,
        strict=True,
    ):
        active = is_active(chain, group, force, response.gap)[..., None]
        closing = jacobians.unit.spread(contact.gap)
        if chain.contact_flexibility is not None:
            closing = closing + chain.contact_flexibility[:, None, None] * unit_force[None]
        rows.append(jnp.where(active, closing / height, unit_force[None] / (stiffness * height)))
    return rows


def _friction_rows(jacobians: StateJacobians, k: int) -> Float[Array, "n 2t z"]:
    """Compute the rows of the friction law at both edges, for the k-th group."""
    chain, span, tendon = jacobians.chain, jacobians.at.spans[k], jacobians.tendons[k]
    log_ratio, group = jacobians.unknowns.log_ratio[k], jacobians.chain.groups[k]
    crossing, offset = span.crossing, chain.friction.offset()
    tension_before = (span.gap_tension + offset) / span.tension_ratio[..., 0] - offset
    turning, tension = (
        (crossing.exit_turning, crossing.entry_turning),
        (tension_before, span.gap_tension),
    )
    zero, one = jnp.zeros_like(tension_before), jnp.ones_like(tension_before)

    def slope(turning_change: tuple[Array, Array], tension_change: tuple[Array, Array]) -> Array:
        """Differentiate the limits by turning angles and tensions, where contacts can slide."""
        limits = partial(chain.friction.limits, log_ratio=log_ratio)
        return (
            slip_mask(group)
            * jax.jvp(limits, (*turning, tension), (*turning_change, tension_change))[1]
        )

    # Edges, then the turning angles that they depend on.
    by_turning = jnp.stack([slope(unit, (zero, zero)) for unit in ((one, zero), (zero, one))], -1)
    limit = jacobians.unit.spread(jnp.einsum("ntes,nstz->ntez", by_turning, tendon.turning))
    if chain.friction.constant_loss(*turning) is not None:
        before = jnp.broadcast_to(jacobians.unit.tension[k][None], tendon.gap_tension.shape)
        rows = jnp.stack([before, tendon.gap_tension], axis=2)
        limit = limit + slope((zero, zero), (one, one))[..., None] * rows
    height = notch_heights(chain)[:, None, None, None]
    stuck = -AUGMENTATION * (
        tendon.at_edges / height - jacobians.memory.slip_per_log_ratio * tendon.log_ratio[None]
    )
    value, bound = trial_log_ratio(chain, log_ratio, span.slid, jacobians.memory, k), span.bound
    upper, lower = (value >= bound)[..., None], (value <= -bound)[..., None]
    slides = tendon.log_ratio[None] - jnp.where(upper, limit, -limit)
    rows = jnp.where(upper | lower, slides, stuck)
    return rows.reshape(chain.flexures, -1, rows.shape[-1])
