"""Newton's linear step: rows of every element, eliminated along the chain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import (
    constant,
    jax,
    jnp,
)
from notchflex.loads.command import (
    BodyLoads,
    body_wrench,
)
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import flexure_state, geometric_stiffness, material_tangent
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import Motion, angular, skew, turned, wrench_turn
from notchflex.mechanics.tendon import TendonGroup
from notchflex.solver.residual import (
    AUGMENTATION,
    Evaluation,
    Memory,
    Unknowns,
    is_active,
    notch_heights,
    select_anchors,
    select_back,
    slip_mask,
    span_mask,
    trial_log_ratio,
)

# Rows of the linear step at every flexure: their layout, Jacobians of tendons, wrenches.


class UnitRows(NamedTuple):
    """Unit rows of all columns, in order.

    Motions of bodies depend on few columns: their rows are short, over the modes and the motions of
    earlier bodies only, until `spread` inserts the others.
    """

    modes: Array
    contact_pairs: list[Array]
    log_ratio: list[Array]
    older: list[Array]
    turn: Array
    tension: list[Array]
    transmitted: list[Array]
    external: Array
    released_length: list[Array]
    tension_length: list[Array]

    @property
    def motions(self) -> list[Array]:
        """Short unit rows of the motions of bodies further back."""
        modes, count = len(self.modes), sum(len(rows) for rows in self.older)
        units = np.eye(modes + count)[modes:]
        return [constant(rows) for rows in np.split(units, max(len(self.older), 1)) if len(rows)]

    def of_modes(self, rows: Array) -> Array:
        """Return the rows over the modes as short rows."""
        return _pad(rows, sum(len(motion) for motion in self.older))

    def spread(self, rows: Array) -> Array:
        """Return short rows as rows over all columns."""
        modes, columns = self.modes.shape
        between = sum(len(rows) for rows in (*self.contact_pairs, *self.log_ratio))
        beyond = columns - rows.shape[-1] - between
        return jnp.concatenate(
            [_pad(rows[..., :modes], between), _pad(rows[..., modes:], beyond)], axis=-1
        )


def _pad(rows: Array, columns: int) -> Array:
    return jnp.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, columns)])


@dataclass(frozen=True)
class RowLayout:
    """Sizes of the parts of a row: own unknowns, then carried from the base, then from the tip.

    A tendon passes its released length and its tension times length from the tip. Slip over a
    contact depends only on a sum of the two, which suffices where no stroke is commanded.
    """

    modes: int
    contact_pairs: tuple[int, ...]
    tendons: tuple[int, ...]
    older: int
    wrench: int
    turn: int
    follows: bool
    by_stroke: bool

    @property
    def unknowns(self) -> int:
        """Number of unknowns of a flexure."""
        return self.modes + sum(self.contact_pairs) + 2 * sum(self.tendons)

    @property
    def carried(self) -> int:
        """Number of columns carried from the base: motions, turn, tensions last."""
        return self.older * self.wrench + self.turn + sum(self.tendons)

    @property
    def beyond(self) -> int:
        """Number of columns that come from the tip: wrenches, loads, tendon lengths last."""
        lengths = (1 + self.by_stroke) * sum(self.tendons)
        return self.older * self.wrench + self.external + lengths

    @property
    def external(self) -> int:
        """Number of columns of the external loads beyond.

        Dead forces change with the rotation of the body in whose frame they are given; only their
        moment comes from the tip.
        """
        return self.wrench if self.turn and self.follows else self.turn

    def unit_rows(self) -> UnitRows:
        """Return the unit rows of all columns, in order."""
        wrenches = [self.wrench] * self.older
        edges = [2 * count for count in self.tendons]
        lengths = self.tendons if self.by_stroke else ()
        own = [[self.modes], self.contact_pairs, edges]
        carried = [wrenches, [self.turn], self.tendons]
        groups = [*own, *carried, wrenches, [self.external], self.tendons, lengths]
        ends = np.cumsum([size for group in groups for size in group])
        rows = map(constant, np.split(np.eye(ends[-1]), ends[:-1]))
        parts = [[next(rows) for _ in group] for group in groups]
        single = {0, 4, 7}  # modes, turn and external loads
        return UnitRows(*(part[0] if i in single else part for i, part in enumerate(parts)))  # pyright: ignore[reportArgumentType]


def row_layout(chain: Chain, *, by_stroke: bool) -> RowLayout:
    """Return the layout for a chain whose tendons are given by tension alone, or some by stroke."""
    wrench = chain.rods.basis.shape[-2] if chain.forces_on_bodies else 0
    return RowLayout(
        modes=chain.stiffness.shape[-1],
        contact_pairs=tuple(group.has_contact.shape[-1] for group in chain.contact_pairs),
        tendons=tuple(len(group.numbers) for group in chain.groups),
        older=chain.window - 1 if wrench else 0,
        wrench=wrench,
        turn=(3 if wrench == 6 else 1) if chain.loaded else 0,
        follows=chain.follows,
        by_stroke=by_stroke,
    )


class RelativeMotionJacobian(NamedTuple):
    """Motion of the bodies.

    Attributes:
        relative: Of the distal body relative to each of those before, in its own frame; short rows.
        turn: Turn of the distal body against the base; None without external loads.
    """

    relative: list[Float[Array, "n w short"]]
    turn: Float[Array, "n a z"] | None


class TendonJacobian(NamedTuple):
    """Rows of a group of tendons.

    Attributes:
        turning: Of the turning angles at both edges; short rows.
        wrench: Of the wrench on the distal body per tension, short rows; None where it does not
            act on bodies.
        log_ratio: Of its log ratios.
        gap_tension: Of the tension in the gap.
        carried: Of the tension beyond the distal body.
        at_edges: Of the tendon slid over both edges.
        released_length: Of the released length, this gap included; where no stroke is commanded,
            of its sum with the stretch by the stiffness of the friction law.
        tension_length: Of tension times length, this gap included; None where no stroke is
            commanded.
    """

    turning: Float[Array, "n 2 t short"]
    wrench: Float[Array, "n t w short"] | None
    log_ratio: Float[Array, "t 2 z"]
    gap_tension: Float[Array, "n t z"]
    carried: Float[Array, "n t z"]
    at_edges: Float[Array, "n t 2 z"]
    released_length: Float[Array, "n t z"]
    tension_length: Float[Array, "n t z"] | None


class ContactJacobian(NamedTuple):
    """Rows of a kind of contacts.

    Attributes:
        gap: Of the gap; short rows.
        wrench: Of the wrench on the distal body per force, short rows; None where it does not act
            on bodies.
    """

    gap: Float[Array, "n l short"]
    wrench: Float[Array, "n l w short"] | None


def relative_motion_jacobian(
    chain: Chain, at: Evaluation, unit: UnitRows
) -> RelativeMotionJacobian:
    """Linearise the motion of the bodies."""
    pose, twist = at.flexure.pose, at.flexure.twist
    if pose is None or twist is None:
        return RelativeMotionJacobian([], None)
    modes = unit.of_modes(twist)
    inside = jax.vmap(Motion.twist_inside, (0, None))
    relative = [modes, *(modes - inside(pose, older) for older in unit.motions)]
    axes = len(unit.turn)
    if not axes:
        return RelativeMotionJacobian(relative, None)
    before = jax.vmap(lambda rotation: turned(rotation.T, unit.turn))(pose.rotation)
    return RelativeMotionJacobian(relative, unit.spread(modes[:, :axes]) + before)


def _by_relative_motion(
    chain: Chain, at: Evaluation, group: TendonGroup | ContactGroup, response: Callable[..., Any]
) -> Any:
    """Differentiate a crossing or contact by the motion relative to the anchor (last axis)."""
    size = chain.rods.basis.shape[-2]
    anchors = select_anchors(at.anchors, group.back)
    assert anchors is not None  # acts_on_bodies asks for them

    def slopes(one: Any, rod: Rod, flexure: Any, anchor: Motion) -> Any:
        def moved(twist: Array) -> Any:
            axes = angular(twist)
            step = Motion(jnp.eye(3 if axes == 3 else 2) + skew(twist[:axes]), twist[axes:])
            return response(one, rod, flexure, jax.vmap(Motion.then, (0, None))(anchor, step))

        return jax.jacfwd(moved)(jnp.zeros(size))

    return jax.vmap(slopes)(group, chain.rods, at.flexure, anchors)


def _by_modes(chain: Chain, at: Evaluation, group: TendonGroup, modes: Array) -> Any:
    """Differentiate a crossing by the modes of the flexure, anchor fixed (last axis)."""
    with_pose = at.anchors is not None and group.acts_on_bodies
    anchors = select_anchors(at.anchors, group.back) if with_pose else None

    def slopes(one: Any, rod: Rod, memory: Any, anchor: Motion | None, at_modes: Array) -> Any:
        def moved(varied: Array) -> Any:
            state = flexure_state(rod, chain.law, memory, varied, with_pose=with_pose)
            return one.cross(rod, state, anchor)

        return jax.jacfwd(moved)(at_modes)

    return jax.vmap(slopes)(group, chain.rods, at.flexure.memory, anchors, modes)


def tendon_jacobian(
    chain: Chain,
    k: int,
    unknowns: Unknowns,
    at: Evaluation,
    unit: UnitRows,
    motion: RelativeMotionJacobian,
) -> TendonJacobian:
    """Linearise the k-th group of tendons."""
    group, span = chain.groups[k], at.spans[k]
    length, turning, wrench = _crossing_rows(chain, k, unknowns, at, unit, motion)
    log_ratio = unit.log_ratio[k].reshape(-1, 2, unit.modes.shape[-1])
    runs = group.runs[..., None]
    ratio = span.tension_ratio[..., None]
    in_gap, in_body = (
        (tension + chain.friction.offset())[..., None]
        for tension in (span.gap_tension, span.body_tension)
    )
    gap_tension = runs * (ratio[:, :, 0] * unit.tension[k][None] - in_gap * log_ratio[None, :, 0])
    body_tension = runs * (ratio[:, :, 1] * gap_tension - in_body * log_ratio[None, :, 1])
    in_body = body_tension * group.body_length[..., None]
    stiffness = chain.memory_stiffness[jnp.array(group.numbers)][None, :, None]
    own_tension_length = gap_tension * group.natural_gap[..., None] + in_body
    beyond = unit.released_length[k][None]
    released_length = beyond - runs * unit.spread(length)
    if not unit.tension_length:
        tension_length = None
        at_exit = released_length = released_length + own_tension_length / stiffness
        at_entry = beyond + in_body / stiffness
    else:
        tension_length = unit.tension_length[k][None] + own_tension_length
        at_exit = released_length + tension_length / stiffness
        at_entry = beyond + (unit.tension_length[k][None] + in_body) / stiffness
    return TendonJacobian(
        turning=turning,
        wrench=wrench,
        log_ratio=log_ratio,
        gap_tension=gap_tension,
        carried=jnp.where(runs > 0.0, body_tension, unit.tension[k][None]),
        at_edges=jnp.stack([at_exit, at_entry], axis=2),
        released_length=released_length,
        tension_length=tension_length,
    )


def _crossing_rows(
    chain: Chain,
    k: int,
    unknowns: Unknowns,
    at: Evaluation,
    unit: UnitRows,
    motion: RelativeMotionJacobian,
) -> tuple[Array, Array, Array | None]:
    """Compute short rows of span length, turning angles and wrench of the k-th group."""
    group, crossing = chain.groups[k], at.spans[k].crossing
    length, turning, wrench = [], [], None
    if group.acts_on_bodies:
        slopes = _by_relative_motion(chain, at, group, type(group).cross)
        relative = select_back(motion.relative, group.back)
        length.append(jnp.einsum("ntw,ntwz->ntz", slopes.length, relative))
        both = jnp.stack([slopes.exit_turning, slopes.entry_turning], axis=1)
        turning.append(jnp.einsum("nstw,ntwz->nstz", both, relative))
        wrench = jnp.einsum("ntvw,ntwz->ntvz", slopes.wrench, relative)
    if group.by_modes:
        slopes = _by_modes(chain, at, group, unknowns.modes)
        if crossing.slope is not None:
            length.append(unit.of_modes(crossing.slope))
        both = jnp.stack([slopes.exit_turning, slopes.entry_turning], axis=1)
        turning.append(unit.of_modes(both))
    return cast("Array", sum(length)), cast("Array", sum(turning)), wrench


def contact_jacobian(
    chain: Chain, k: int, at: Evaluation, unit: UnitRows, motion: RelativeMotionJacobian
) -> ContactJacobian:
    """Linearise the k-th kind of contacts."""
    group, response = chain.contact_pairs[k], at.contacts[k]
    if response.slope is not None:
        return ContactJacobian(unit.of_modes(response.slope), None)
    slopes = _by_relative_motion(chain, at, group, type(group).gap_response)
    relative = select_back(motion.relative, group.back)
    return ContactJacobian(
        jnp.einsum("nlw,nlwz->nlz", slopes.gap, relative),
        jnp.einsum("nlvw,nlwz->nlvz", slopes.wrench, relative),
    )


class StateJacobians(NamedTuple):
    """A state, and the jacobians of its bodies, tendons and contacts."""

    chain: Chain
    unknowns: Unknowns
    memory: Memory
    applied: BodyLoads | None
    at: Evaluation
    unit: UnitRows
    motion: RelativeMotionJacobian
    tendons: list[TendonJacobian]
    contacts: list[ContactJacobian]


def state_jacobians(
    chain: Chain,
    unknowns: Unknowns,
    memory: Memory,
    applied: BodyLoads | None,
    at: Evaluation,
    unit: UnitRows,
) -> StateJacobians:
    """Differentiate the motions of all bodies, tendons and contacts at a state."""
    motion = relative_motion_jacobian(chain, at, unit)
    tendons = [
        tendon_jacobian(chain, k, unknowns, at, unit, motion) for k in range(len(chain.groups))
    ]
    contacts = [
        contact_jacobian(chain, k, at, unit, motion) for k in range(len(chain.contact_pairs))
    ]
    return StateJacobians(chain, unknowns, memory, applied, at, unit, motion, tendons, contacts)


def wrench_rows(jacobians: StateJacobians) -> tuple[Float[Array, "n w z"], list[Array]]:
    """Compute the rows of the resultant on the distal body and beyond, and of its reactions."""
    chain, unit, wrenches = jacobians.chain, jacobians.unit, jacobians.at.wrenches
    assert wrenches is not None
    terminating = _terminating_rows(jacobians)
    resultant = terminating[:, 0]
    if unit.transmitted:
        resultant = resultant + unit.transmitted[0][None]
    to_previous = []
    for number in range(1, chain.window):
        rows = terminating[:, number]
        if number < len(unit.transmitted):
            rows = rows + unit.transmitted[number][None]
        beyond = wrenches.terminating[:, number] + wrenches.transmitted[:, number]
        to_previous.append(_hand_back(jacobians, rows, beyond))
    if jacobians.applied is not None and jacobians.motion.turn is not None:
        external = _external_rows(jacobians, jacobians.motion.turn)
        resultant = resultant + external
        back = _hand_back(jacobians, external, cast("Array", wrenches.external))
        to_previous.append(back if chain.follows else back[:, : jacobians.motion.turn.shape[1]])
    return resultant, to_previous


def _terminating_rows(jacobians: StateJacobians) -> Float[Array, "n window w z"]:
    """Compute the rows of wrenches of spans and contacts that end at the distal body."""
    chain, at, unit = jacobians.chain, jacobians.at, jacobians.unit
    assert at.wrenches is not None
    terminating = jnp.zeros((*at.wrenches.terminating.shape, unit.modes.shape[-1]))
    for group, span, tendon in zip(chain.groups, at.spans, jacobians.tendons, strict=True):
        if tendon.wrench is not None and span.crossing.wrench is not None:
            along = tendon.gap_tension[:, :, None] * span.crossing.wrench[..., None]
            pull = along + unit.spread(span.gap_tension[..., None, None] * tendon.wrench)
            reach = span_mask(chain, group.back)
            terminating = terminating - jnp.einsum("ntwz,ntk->nkwz", pull, reach)
    for group, response, force, unit_force, contact in zip(
        chain.contact_pairs,
        at.contacts,
        jacobians.unknowns.contact_force,
        unit.contact_pairs,
        jacobians.contacts,
        strict=True,
    ):
        if contact.wrench is not None and response.wrench is not None:
            along = unit_force[None, :, None] * response.wrench[..., None]
            along = along + unit.spread(force[..., None, None] * contact.wrench)
            push = group.has_contact[..., None, None] * along
            reach = span_mask(chain, group.back)
            terminating = terminating + jnp.einsum("nlwz,nlk->nkwz", push, reach)
    return terminating


def _hand_back(
    jacobians: StateJacobians, rows: Float[Array, "n w z"], wrench: Float[Array, "n w"]
) -> Float[Array, "n w z"]:
    """Transform rows of a wrench that moves with the distal body to the previous frame."""
    turning = jax.vmap(wrench_turn)(wrench)
    turned = jnp.einsum("nvw,nwz->nvz", turning, jacobians.motion.relative[0])
    pose = cast("Motion", jacobians.at.flexure.pose)
    return jax.vmap(Motion.wrench)(pose, rows + jacobians.unit.spread(turned))


def _external_rows(jacobians: StateJacobians, turn: Float[Array, "n a z"]) -> Float[Array, "n w z"]:
    """Compute the rows of the external loads on the distal body and beyond."""
    chain, at, unit = jacobians.chain, jacobians.at, jacobians.unit
    assert at.wrenches is not None
    assert at.wrenches.external is not None
    assert at.rotation is not None
    on_bodies = jax.tree.map(lambda leaf: leaf[1:], jacobians.applied)
    on_body = jnp.einsum("nwa,naz->nwz", jax.vmap(_by_turn)(at.rotation, on_bodies), turn)
    if chain.follows:
        return unit.external[None] + on_body
    # Dead forces keep their direction: they rotate relative to the body.
    axes = turn.shape[1]
    against = -jax.vmap(wrench_turn)(at.wrenches.external)[:, axes:, :axes]
    forces = jnp.einsum("nwa,naz->nwz", against, turn)
    return jnp.concatenate([unit.external[None] + on_body[:, :axes], forces], axis=1)


def _by_turn(rotation: Array, load: BodyLoads) -> Float[Array, "w a"]:
    """Differentiate a body's loads by its rotation about its own axes."""
    axes = 3 if len(rotation) == 3 else 1

    def at_turn(turn: Array) -> Array:
        return body_wrench(rotation @ (jnp.eye(len(rotation)) + skew(turn)), load)

    return jax.jacfwd(at_turn)(jnp.zeros(axes))


# Linearisation of every flexure's residual, as rows over all that it depends on.
#
# The columns are the unknowns of the flexure, what is carried to it from the base side, and what
# comes from the tip side. Motions of bodies are relative to the body before, forces act along the
# body: a rotation of the whole robot changes nothing. Carried from the base side are
#
#     the motion of bodies further back, as far as spans reach; the turn of the body against the
#     base, where external loads keep their direction; the tensions
#
# and from the tip side come
#
#     the wrenches of spans and contacts that end beyond; those of the external loads, or their
#     moments alone; the released lengths of the tendons and their tension times length.
#
# JAX differentiates only the geometry of a span, a contact or a rod, each on its own.


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
