"""Newton's linear step: rows of every element, eliminated along the chain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.command import BodyLoads, Command, body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import flexure_state, geometric_stiffness, material_tangent
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.material import Law
from notchflex.mechanics.motion import Motion, angular, skew, turned, wrench_at, wrench_turn
from notchflex.mechanics.tendon import TendonGroup
from notchflex.solver.residual import (
    AUGMENTATION,
    Evaluation,
    Iterate,
    Memory,
    Unknowns,
    command_residual,
    command_slopes,
    is_active,
    notch_heights,
    of_group,
    select_anchors,
    select_back,
    slip_mask,
    span_mask,
    trial_log_ratio,
)

# Rows of the linear step at every flexure: their layout, Jacobians of tendons, wrenches.


class UnitRows(NamedTuple):
    """Unit rows of all columns: unknowns of a flexure, carried from the base, from the tip."""

    # Motions of bodies depend on few columns: their rows are short, over the modes and the motions
    # of earlier bodies only, until `spread` inserts the others.

    modes: Any
    contact_pairs: Any
    log_ratio: Any
    older: Any
    turn: Any
    tension: Any
    transmitted: Any
    external: Any
    released_length: Any

    @property
    def unknowns(self) -> int:
        """Number of unknowns of a flexure."""
        return _count(self[:3])

    @property
    def carried(self) -> int:
        """Number of columns carried from the base: motions, turn, tensions last."""
        return _count(self[3:6])

    @property
    def beyond(self) -> int:
        """Number of columns that come from the tip: wrenches, loads, released lengths last."""
        return _count(self[6:])

    @property
    def motions(self) -> list[Array]:
        """Short unit rows of the motions of bodies further back."""
        end = self.unknowns + _count(self.older)
        return [rows[:, np.r_[: len(self.modes), self.unknowns : end]] for rows in self.older]

    def of_modes(self, rows: Array) -> Array:
        """Return the rows over the modes as short rows."""
        return _pad(rows, _count(self.older))

    def spread(self, rows: Array) -> Array:
        """Return short rows as rows over all columns."""
        modes, columns = self.modes.shape
        between = self.unknowns - modes
        beyond = columns - rows.shape[-1] - between
        return jnp.concatenate(
            [_pad(rows[..., :modes], between), _pad(rows[..., modes:], beyond)], axis=-1
        )


def _count(rows: Any) -> int:
    return sum(map(len, jax.tree.leaves(rows)))


def _pad(rows: Array, columns: int) -> Array:
    return jnp.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, columns)])


def unit_rows(chain: Chain) -> UnitRows:
    """Return the unit rows of a chain."""
    # Dead forces change with the rotation of the body in whose frame they are given; only their
    # moment comes from the tip.
    wrench = chain.rods.basis.shape[-2] if chain.forces_on_bodies else 0
    older = (wrench,) * (chain.window - 1 if wrench else 0)
    turn = (3 if wrench == 6 else 1) if chain.loaded else 0
    tendons = tuple(len(group.numbers) for group in chain.groups)
    sizes = UnitRows(
        modes=chain.stiffness.shape[-1],
        contact_pairs=tuple(group.has_contact.shape[-1] for group in chain.contact_pairs),
        log_ratio=tuple(2 * count for count in tendons),
        older=older,
        turn=turn,
        tension=tendons,
        transmitted=older,
        external=wrench if turn and chain.follows else turn,
        released_length=tendons,
    )
    leaves, structure = jax.tree.flatten(sizes)
    ends = np.cumsum(leaves)
    rows = np.split(np.eye(ends[-1]), ends[:-1])
    return jax.tree.unflatten(structure, map(constant, rows))


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
        released_length: Of the released length with the stretch by the stiffness of the friction
            law, this gap included: slip over a contact depends on no other sum from the tip.
        tension_length: Of tension times length, of this gap alone.
    """

    turning: Float[Array, "n t 2 short"]
    wrench: Float[Array, "n t w short"] | None
    log_ratio: Float[Array, "t 2 z"]
    gap_tension: Float[Array, "n t z"]
    carried: Float[Array, "n t z"]
    at_edges: Float[Array, "n t 2 z"]
    released_length: Float[Array, "n t z"]
    tension_length: Float[Array, "n t z"]


@dataclass
class StateJacobians:
    """A state, and the jacobians of its bodies, tendons and contacts."""

    chain: Chain
    unknowns: Unknowns
    memory: Memory
    applied: BodyLoads | None
    evaluation: Any
    unit: UnitRows

    @cached_property
    def relative(self) -> list[Float[Array, "n w short"]]:
        """Motion of the distal body relative to each of those before, in its own frame; short."""
        pose, twist = self.evaluation.flexure.pose, self.evaluation.flexure.twist
        if pose is None or twist is None:
            return []
        modes = self.unit.of_modes(twist)
        inside = jax.vmap(Motion.twist_inside, (0, None))
        return [modes, *(modes - inside(pose, older) for older in self.unit.motions)]

    @cached_property
    def turn(self) -> Float[Array, "n a z"]:
        """Turn of the distal body against the base, where there are external loads."""
        before = jax.vmap(lambda rotation: turned(rotation.T, self.unit.turn))
        axes = len(self.unit.turn)
        return self.unit.spread(self.relative[0][:, :axes]) + before(
            self.evaluation.flexure.pose.rotation
        )

    @cached_property
    def tendons(self) -> list[TendonJacobian]:
        """Rows of every group of tendons."""
        return [self._tendon(k) for k in range(len(self.chain.groups))]

    @cached_property
    def contacts(
        self,
    ) -> list[tuple[Float[Array, "n l short"], Float[Array, "n l w short"] | None]]:
        """Short rows of gap, and of wrench per force on the distal body, of every kind."""
        return [self._contact(k) for k in range(len(self.chain.contact_pairs))]

    def _by_relative_motion(
        self, group: TendonGroup | ContactGroup, response: Callable[..., Any]
    ) -> Any:
        """Differentiate a crossing or contact by the motion relative to the anchor (last axis)."""
        chain = self.chain
        size = chain.rods.basis.shape[-2]
        anchors = select_anchors(self.evaluation.anchors, group.back)

        def slopes(part: Any, rod: Rod, flexure: Any, anchor: Any) -> Any:
            def moved(twist: Array) -> Any:
                axes = angular(twist)
                step = Motion(jnp.eye(3 if axes == 3 else 2) + skew(twist[:axes]), twist[axes:])
                return response(part, rod, flexure, jax.vmap(Motion.then, (0, None))(anchor, step))

            return jax.jacfwd(moved)(jnp.zeros(size))

        return jax.vmap(slopes)(group, chain.rods, self.evaluation.flexure, anchors)

    def _by_modes(self, group: TendonGroup) -> Any:
        """Differentiate a crossing by the modes of the flexure, anchor fixed (last axis)."""
        chain, anchors = self.chain, self.evaluation.anchors
        with_pose = anchors is not None and group.acts_on_bodies
        anchors = select_anchors(anchors, group.back) if with_pose else None

        def slopes(part: Any, rod: Rod, law: Law, memory: Any, anchor: Any, modes: Array) -> Any:
            def moved(varied: Array) -> Any:
                state = flexure_state(rod, law, memory, varied, with_pose=with_pose)
                return part.cross(rod, state, anchor)

            return jax.jacfwd(moved)(modes)

        memory = self.evaluation.flexure.memory
        return jax.vmap(slopes, (0, 0, chain.law.axis, 0, 0, 0))(
            group, chain.rods, chain.law, memory, anchors, self.unknowns.modes
        )

    def _tendon(self, k: int) -> TendonJacobian:
        """Linearise the k-th group of tendons."""
        chain, unit, span = self.chain, self.unit, self.evaluation.spans[k]
        group, tension = chain.groups[k], unit.tension[k][None]
        length, turning, wrench = self._crossing(k)
        log_ratio = unit.log_ratio[k].reshape(-1, 2, unit.modes.shape[-1])
        runs = group.runs[..., None]
        ratio = span.tension_ratio[..., None]
        in_gap, in_body = (
            (tension + chain.friction.offset())[..., None]
            for tension in (span.gap_tension, span.body_tension)
        )
        gap_tension = runs * (ratio[:, :, 0] * tension - in_gap * log_ratio[None, :, 0])
        body_tension = runs * (ratio[:, :, 1] * gap_tension - in_body * log_ratio[None, :, 1])
        in_body = body_tension * group.body_length[..., None]
        stiffness = of_group(chain.memory_stiffness, group)[None, :, None]
        tension_length = gap_tension * group.natural_gap[..., None] + in_body
        beyond = unit.released_length[k][None]
        released_length = beyond - runs * unit.spread(length) + tension_length / stiffness
        return TendonJacobian(
            turning=turning,
            wrench=wrench,
            log_ratio=log_ratio,
            gap_tension=gap_tension,
            carried=jnp.where(runs > 0.0, body_tension, tension),
            at_edges=jnp.stack([released_length, beyond + in_body / stiffness], axis=2),
            released_length=released_length,
            tension_length=tension_length,
        )

    def _crossing(self, k: int) -> tuple[Any, Any, Array | None]:
        """Compute short rows of span length, turning angles and wrench of the k-th group."""
        group: Any = self.chain.groups[k]
        crossing = self.evaluation.spans[k].crossing
        length, turning, wrench = [], [], None
        if group.acts_on_bodies:
            slopes = self._by_relative_motion(group, type(group).cross)
            relative = select_back(self.relative, group.back)
            length.append(jnp.einsum("ntw,ntwz->ntz", slopes.length, relative))
            turning.append(jnp.einsum("ntsw,ntwz->ntsz", slopes.turning, relative))
            pulled = slopes.wrench[:, :, -group.enters.shape[-1] :]
            pulled = jnp.einsum("ntvw,ntwz->ntvz", pulled, relative)
            wrench = jax.vmap(jax.vmap(wrench_at))(group.enters, pulled)
        if group.by_modes:
            slopes = self._by_modes(group)
            if crossing.slope is not None:
                length.append(self.unit.of_modes(crossing.slope))
            turning.append(self.unit.of_modes(slopes.turning))
        return sum(length), sum(turning), wrench

    def _contact(self, k: int) -> tuple[Array, Array | None]:
        """Linearise the k-th kind of contacts."""
        group, response = self.chain.contact_pairs[k], self.evaluation.contacts[k]
        if response.slope is not None:
            return self.unit.of_modes(response.slope), None
        slopes = self._by_relative_motion(group, type(group).cross)
        relative = select_back(self.relative, group.back)
        return (
            jnp.einsum("nlw,nlwz->nlz", slopes.gap, relative),
            jnp.einsum("nlvw,nlwz->nlvz", slopes.wrench, relative),
        )

    def wrenches(self) -> tuple[Float[Array, "n w z"], list[Array]]:
        """Compute the rows of the resultant on the distal body and beyond, and of its reactions."""
        chain, unit, wrenches = self.chain, self.unit, self.evaluation.wrenches
        terminating = self._terminating()
        resultant = terminating[:, 0]
        if unit.transmitted:
            resultant = resultant + unit.transmitted[0][None]
        to_previous = []
        for number in range(1, chain.window):
            rows = terminating[:, number]
            if number < len(unit.transmitted):
                rows = rows + unit.transmitted[number][None]
            beyond = wrenches.terminating[:, number] + wrenches.transmitted[:, number]
            to_previous.append(self._hand_back(rows, beyond))
        if axes := len(unit.turn):
            external = self._external()
            resultant = resultant + external
            back = self._hand_back(external, wrenches.external)
            to_previous.append(back if chain.follows else back[:, :axes])
        return resultant, to_previous

    def _terminating(self) -> Float[Array, "n window w z"]:
        """Compute the rows of wrenches of spans and contacts that end at the distal body."""
        chain, evaluation, unit = self.chain, self.evaluation, self.unit
        terminating = jnp.zeros((*evaluation.wrenches.terminating.shape, unit.modes.shape[-1]))
        for group, span, tendon in zip(chain.groups, evaluation.spans, self.tendons, strict=True):
            if tendon.wrench is not None:
                along = tendon.gap_tension[:, :, None] * span.crossing.wrench[..., None]
                pull = along + unit.spread(span.gap_tension[..., None, None] * tendon.wrench)
                reach = span_mask(chain, group.back)
                terminating = terminating - jnp.einsum("ntwz,ntk->nkwz", pull, reach)
        for group, response, force, unit_force, (_, wrench) in zip(
            chain.contact_pairs,
            evaluation.contacts,
            self.unknowns.contact_force,
            unit.contact_pairs,
            self.contacts,
            strict=True,
        ):
            if wrench is not None:
                along = unit_force[None, :, None] * response.wrench[..., None]
                along = along + unit.spread(force[..., None, None] * wrench)
                push = group.has_contact[..., None, None] * along
                reach = span_mask(chain, group.back)
                terminating = terminating + jnp.einsum("nlwz,nlk->nkwz", push, reach)
        return terminating

    def _hand_back(
        self, rows: Float[Array, "n w z"], wrench: Float[Array, "n w"]
    ) -> Float[Array, "n w z"]:
        """Transform rows of a wrench that moves with the distal body to the previous frame."""
        turning = jax.vmap(wrench_turn)(wrench)
        turned = jnp.einsum("nvw,nwz->nvz", turning, self.relative[0])
        return jax.vmap(Motion.wrench)(
            self.evaluation.flexure.pose, rows + self.unit.spread(turned)
        )

    def _external(self) -> Float[Array, "n w z"]:
        """Compute the rows of the external loads on the distal body and beyond."""
        evaluation, unit, turn = self.evaluation, self.unit, self.turn
        axes = len(unit.turn)

        def slopes(rotation: Array, load: BodyLoads) -> Float[Array, "w a"]:
            """Differentiate a body's loads by its rotation about its own axes."""

            def at_turn(turn: Array) -> Array:
                return body_wrench(rotation @ (jnp.eye(len(rotation)) + skew(turn)), load)

            return jax.jacfwd(at_turn)(jnp.zeros(axes))

        on_bodies = jax.tree.map(lambda leaf: leaf[1:], self.applied)
        on_body = jnp.einsum(
            "nwa,naz->nwz", jax.vmap(slopes)(evaluation.wrenches.rotation, on_bodies), turn
        )
        if self.chain.follows:
            return unit.external[None] + on_body
        # Dead forces keep their direction: they rotate relative to the body.
        against = -jax.vmap(wrench_turn)(evaluation.wrenches.external)[:, axes:, :axes]
        forces = jnp.einsum("nwa,naz->nwz", against, turn)
        return jnp.concatenate([unit.external[None] + on_body[:, :axes], forces], axis=1)


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
#     moments alone; the released lengths of the tendons.
#
# JAX differentiates only the geometry of a span, a contact or a rod, each on its own.

# Smallest slope of a mode, as a fraction of its stiffness at rest: the root of the rounding error,
# so that neither the shift nor the cancelled digits matter.
_MIN_RELATIVE_SLOPE = 1e-8


class LinearisedRows(NamedTuple):
    """Rows of all flexures, each over (own unknowns, carried, from beyond).

    Attributes:
        residual: Of the residual.
        to_next: Of what is passed to the next flexure.
        to_previous: Of what is passed to the previous flexure.
        tension_length: Of the tension times length of every tendon; no flexure depends on its sum.
    """

    residual: Float[Array, "n u z"]
    to_next: Float[Array, "n c z"]
    to_previous: Float[Array, "n b z"]
    tension_length: Float[Array, "n t z"]


def linearise(jacobians: StateJacobians) -> LinearisedRows:
    """Linearise the residual of all flexures."""
    chain, unit = jacobians.chain, jacobians.unit
    tendons = jacobians.tendons
    balance, to_previous = _balance_rows(jacobians)
    residual = [balance * (1.0 / chain.stiffness)[..., None], *_contact_rows(jacobians)]
    residual += [_friction_rows(jacobians, k) for k in range(len(tendons))]
    to_next = [-unit.spread(motion) for motion in jacobians.relative[: len(unit.older)]]
    to_next += [jacobians.turn] if len(unit.turn) else []
    to_next += [tendon.carried for tendon in tendons]
    to_previous += [tendon.released_length for tendon in tendons]
    rows = (residual, to_next, to_previous, [tendon.tension_length for tendon in tendons])
    # Of an empty list, none.
    none = jnp.zeros((chain.flexures, 0, unit.modes.shape[-1]))
    return LinearisedRows(*(jnp.concatenate([none, *of_parts], axis=1) for of_parts in rows))


def _balance_rows(jacobians: StateJacobians) -> tuple[Float[Array, "n m z"], list[Array]]:
    """Compute the rows of equilibrium of the modes, and of the wrenches to the previous body."""
    chain, evaluation, unit = jacobians.chain, jacobians.evaluation, jacobians.unit
    elastic = chain.elastic
    if elastic is None:
        elastic = jax.vmap(material_tangent, (0, chain.law.axis, 0))(
            chain.rods, chain.law, evaluation.flexure
        )
        # Just beyond the strain where plastic hardening begins (exp(b / x) at x = 0) the law is
        # flat to the last digit. The modes are eliminated first, so their pivots must not vanish,
        # though friction makes the whole system regular. Without friction the step becomes long but
        # finite, and the limits of a step apply to it.
        slope = jnp.abs(jnp.diagonal(elastic, axis1=1, axis2=2))
        min_slope = _MIN_RELATIVE_SLOPE * chain.stiffness
        elastic = elastic + jax.vmap(jnp.diag)(jnp.where(slope < min_slope, min_slope, 0.0))
        if jacobians.memory.damping is not None:
            elastic = elastic + jacobians.memory.damping[0] * jax.vmap(jnp.diag)(chain.stiffness)
    to_previous: list[Array] = []
    if evaluation.wrenches is None:
        balance = unit.spread(unit.of_modes(elastic))
    else:
        assert evaluation.flexure.configuration is not None
        elastic = elastic - jax.vmap(geometric_stiffness)(
            chain.rods,
            jacobians.unknowns.modes,
            evaluation.flexure.configuration,
            evaluation.wrenches.resultant,
        )
        resultant, to_previous = jacobians.wrenches()
        balance = unit.spread(unit.of_modes(elastic)) - jnp.einsum(
            "nwm,nwz->nmz", evaluation.flexure.twist, resultant
        )
    for tendon, span in zip(jacobians.tendons, evaluation.spans, strict=True):
        if span.crossing.slope is not None:
            balance = balance + jnp.einsum("ntm,ntz->nmz", span.crossing.slope, tendon.gap_tension)
    for group, response, force in zip(
        chain.contact_pairs, evaluation.contacts, unit.contact_pairs, strict=True
    ):
        if response.slope is not None:
            closing = group.has_contact[..., None] * response.slope
            balance = balance - jnp.einsum("nlm,lz->nmz", closing, force)
    return balance, to_previous


def _contact_rows(jacobians: StateJacobians) -> list[Array]:
    """Compute the rows of Signorini's condition, for every kind of contacts."""
    chain, rows = jacobians.chain, list[Array]()
    height = notch_heights(chain)[:, None, None]
    stiffness = chain.contact_stiffness[:, None, None]
    for group, response, force, unit_force, (gap, _) in zip(
        chain.contact_pairs,
        jacobians.evaluation.contacts,
        jacobians.unknowns.contact_force,
        jacobians.unit.contact_pairs,
        jacobians.contacts,
        strict=True,
    ):
        active = is_active(chain, group, force, response.gap)[..., None]
        closing = jacobians.unit.spread(gap)
        if chain.contact_flexibility is not None:
            closing = closing + chain.contact_flexibility[:, None, None] * unit_force[None]
        rows.append(jnp.where(active, closing / height, unit_force[None] / (stiffness * height)))
    return rows


def _friction_rows(jacobians: StateJacobians, k: int) -> Float[Array, "n 2t z"]:
    """Compute the rows of the friction law at both edges, for the k-th group."""
    chain, span, tendon = jacobians.chain, jacobians.evaluation.spans[k], jacobians.tendons[k]
    log_ratio, group = jacobians.unknowns.log_ratio[k], chain.groups[k]
    crossing, offset = span.crossing, chain.friction.offset()
    tension_before = (span.gap_tension + offset) / span.tension_ratio[..., 0] - offset
    tension = jnp.stack([tension_before, span.gap_tension], axis=-1)
    still = jnp.zeros_like(tension)

    def slope(turning_change: Array, tension_change: Array) -> Array:
        """Differentiate the limits by turning angles and tensions, where contacts can slide."""
        limits = partial(chain.friction.limits, log_ratio=log_ratio)
        changes = turning_change, tension_change
        return slip_mask(group) * jax.jvp(limits, (crossing.turning, tension), changes)[1]

    # Edges, then the turning angles that they depend on.
    by_turning = jnp.stack([slope(still + unit[None, None], still) for unit in jnp.eye(2)], -1)
    limit = jacobians.unit.spread(jnp.einsum("ntes,ntsz->ntez", by_turning, tendon.turning))
    if chain.friction.constant_loss(crossing.turning) is not None:
        before = jnp.broadcast_to(jacobians.unit.tension[k][None], tendon.gap_tension.shape)
        rows = jnp.stack([before, tendon.gap_tension], axis=2)
        limit = limit + slope(still, still + 1.0)[..., None] * rows
    per_height = (1.0 / notch_heights(chain))[:, None, None, None]
    # A contact that sticks hands on all that its neighbours cannot hold, so that sliding would
    # advance by one contact in a step. Far from the solution it therefore yields in the slopes; as
    # it yields by the square of the imbalance, convergence stays quadratic.
    compliance = jacobians.memory.slip_per_log_ratio(chain, group, span)[..., None]
    compliance = compliance + jacobians.evaluation.friction_imbalance**2
    stuck = -AUGMENTATION * (per_height * tendon.at_edges - compliance * tendon.log_ratio[None])
    value, bound = trial_log_ratio(chain, log_ratio, span, jacobians.memory, k), span.bound
    upper = (value >= bound)[..., None]
    slides = tendon.log_ratio[None] - jnp.where(upper, limit, -limit)
    rows = jnp.where((jnp.abs(value) >= bound)[..., None], slides, stuck)
    return rows.reshape(chain.flexures, -1, rows.shape[-1])


# Elimination along the chain: O(n), never a dense matrix.
#
# Linearised, an element couples only to its neighbours:
#
#     residual + A du + B dcarried + C dbeyond = 0
#     dnext = Yu du + Yc dcarried,   dprevious = Zu du + Zc dcarried + Zb dbeyond
#
# All elements eliminate their own unknowns at once, which leaves
#
#     dnext = y + Y1 dcarried + Y2 dbeyond,   dprevious = z + Z1 dcarried + Z2 dbeyond
#
# `_condense` eliminates dbeyond of one element after the other from the tip, until only the
# tensions at the base are unknown; substitution then goes from the base to the tip. This is the
# elimination of a block-tridiagonal matrix, in two loops: the program does not grow with the chain.

# Slopes of a stroke by a tension that count as zero below the second; the first is added to their
# pivots. Both as parts of the flexibility of a notch. A tendon that is held by the stiffness of its
# memory has a slope of 2.5e-6 and is no such one.
_PIVOT_SHIFT, _ZERO_SLOPE = 5e-9, 5e-7


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
    unit = unit_rows(chain)
    state = (chain, point.unknowns, memory, command.applied, evaluation)
    rows = linearise(StateJacobians(*jax.tree.map(jax.lax.stop_gradient, state), unit=unit))
    residual = jax.vmap(lambda tree: ravel_pytree(tree)[0])(evaluation.residual)
    size = unit.unknowns
    # Own unknowns as functions of 1, carried and beyond: du = response @ (1, c, b).
    right = jnp.concatenate([residual[..., None], rows.residual[..., size:]], axis=-1)
    # The contact at the end of a gap acts on no mode: before that at its start, it changes one row.
    last = size - 2 * len(chain.tendon_order)
    columns = [*range(last), *range(last + 1, size, 2), *range(last, size, 2)]
    response = -gauss_jordan(rows.residual[..., :size], right, columns)

    def insert(row: Array) -> Array:
        rest = jnp.pad(row[..., size:], ((0, 0), (0, 0), (1, 0)))
        return rest + row[..., :size] @ response

    # (1, carried to the first flexure) by (1, base tensions): a tension is carried as it is.
    order, at_base = chain.tendon_order, np.zeros((1 + unit.carried, 1 + chain.tendons))
    at_base[0, 0] = 1.0
    at_base[len(at_base) - len(order) + np.arange(len(order)), 1 + order] = 1.0
    # Only strokes depend on the sums of tension times length.
    sums = rows.tension_length[:, : 0 if command.by_stroke is None else len(order)]
    condensed, back, total = _condense(unit, *map(insert, (rows.to_next, rows.to_previous, sums)))
    tension_step = command.target - point.base_tension
    if command.by_stroke is not None:
        slopes, count = command_slopes(chain, command, memory.sheath, evaluation.base), len(order)
        # Rows in the order of the robot's tendons, over 1 and base tensions.
        by_tendon = jnp.stack([back[len(back) - count :], total], axis=1)
        by_tendon = jnp.stack([by_tendon[row] for row in np.argsort(order)], axis=1)
        at_exit, tension_length = by_tendon @ at_base
        released = at_exit - tension_length / chain.memory_stiffness[:, None]
        by_base = slopes[1] @ released + slopes[2] @ tension_length
        matrix = slopes[0] + by_base[:, 1:]
        # Where every contact sticks, the stroke does not depend on the tension; a small pivot keeps
        # the step finite.
        flexibility = 1.0 / jnp.mean(chain.contact_stiffness)
        is_zero = jnp.abs(jnp.diag(matrix)) < _ZERO_SLOPE * flexibility
        missing = command_residual(chain, command, memory.sheath, evaluation.base) + by_base[:, 0]
        pivots = _PIVOT_SHIFT * flexibility * jnp.diag(1.0 * (command.by_stroke & is_zero))
        tension_step = -gauss_jordan(matrix + pivots, missing[:, None])[:, 0]

    def follow(carried: Array, blocks: tuple[Array, Array]) -> tuple[Array, Array]:
        to_next, returned = blocks
        homogeneous = jnp.concatenate([jnp.ones(1), carried])
        return to_next @ homogeneous, jnp.concatenate([homogeneous, returned @ homogeneous])

    # (1, carried, from beyond) of every element, from the base to the tip.
    surroundings = jax.lax.scan(follow, jnp.asarray(at_base[1:, 1:]) @ tension_step, condensed)[1]
    steps = jnp.einsum("nuz,nz->nu", response, surroundings)
    _, unknowns_of = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], point.unknowns))
    return Iterate(jax.vmap(unknowns_of)(steps), tension_step)


def _condense(
    unit: UnitRows,
    to_next: Float[Array, "n c z"],
    to_previous: Float[Array, "n b z"],
    sums: Float[Array, "n k z"],
) -> tuple[
    tuple[Float[Array, "n c 1+c"], Float[Array, "n b 1+c"]],
    Float[Array, "b 1+c"],
    Float[Array, "k 1+c"],
]:
    """Eliminate the couplings of neighbours from the tip: rows over (1, carried, from beyond)."""
    # Returns rows over (1, carried) of what every element carries to the next and receives from it,
    # of what the first hands to the base, and of sums over all elements.
    size = 1 + unit.carried
    identity = constant(np.eye(unit.carried))

    def join(
        beyond: tuple[Array, Array], item: tuple[Array, ...]
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        (back, total), (to_next, to_previous, addends) = beyond, item
        by_back = to_next[:, size:]
        right = _add_constant(to_next[:, :size], by_back @ back[:, 0])
        carried_on = gauss_jordan(identity - by_back @ back[:, 1:], right)
        returned, total = (
            _add_constant(rows[:, 1:] @ carried_on, rows[:, 0]) for rows in (back, total)
        )
        back = to_previous[:, :size] + to_previous[:, size:] @ returned
        total = total + addends[:, :size] + addends[:, size:] @ returned
        return (back, total), (carried_on, returned)

    at_tip = (jnp.zeros((unit.beyond, size)), jnp.zeros((sums.shape[1], size)))
    (back, total), condensed = jax.lax.scan(
        join, at_tip, (to_next, to_previous, sums), reverse=True
    )
    return condensed, back, total


def _add_constant(rows: Float[Array, "k z"], by: Float[Array, " k"]) -> Float[Array, "k z"]:
    """Add constants to the first column of rows, that of 1."""
    return jnp.concatenate([rows[:, :1] + by[:, None], rows[:, 1:]], axis=1)


def gauss_jordan(
    matrix: Float[Array, "*n u u"], right: Float[Array, "*n u r"], order: Sequence[int] = ()
) -> Float[Array, "*n u r"]:
    """Solve small systems by Gauss-Jordan elimination without pivoting, in order of the columns."""
    # Modes come first: their stiffness makes their pivots safe. A step drops the column that it has
    # cleared. The barrier keeps the compiler from recomputing earlier steps for every later one; a
    # loop takes twice as long, and many small factorisations by LAPACK two to seven times.
    columns = list(range(matrix.shape[-1]))
    table = jnp.concatenate([matrix, right], axis=-1)
    for number in order or tuple(columns):
        is_pivot = (np.arange(matrix.shape[-1]) == number)[:, None]
        at = columns.index(number)
        column = table[..., at : at + 1]
        table = jnp.concatenate([table[..., :at], table[..., at + 1 :]], axis=-1)
        columns.remove(number)
        # One division costs as much as ten products.
        pivot = table[..., number : number + 1, :] * (1.0 / column[..., number : number + 1, :])
        # The pivot's row is inserted, since a difference would lose its digits.
        table = jnp.where(is_pivot, pivot, table - column * pivot)
        table = jax.lax.optimization_barrier(table)
    return table
