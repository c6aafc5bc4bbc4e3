"""Jacobians of bodies, tendons and contacts: rows of the linear step at every flexure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, cast

from jaxtyping import Array, Float

from notchflex._jax import jax, jnp
from notchflex.loads.applied import BodyLoads
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import flexure_state
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import Motion, angular, skew, turned
from notchflex.mechanics.tendon import TendonGroup
from notchflex.solver.body_poses import select_anchors, select_back
from notchflex.solver.element import Memory, Unknowns
from notchflex.solver.linear_step.row_layout import UnitRows
from notchflex.solver.residual import Evaluation


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
    gap_tension = runs * (
        ratio[:, :, 0] * unit.tension[k][None] - span.gap_tension[..., None] * log_ratio[None, :, 0]
    )
    body_tension = (
        ratio[:, :, 1] * gap_tension - span.body_tension[..., None] * log_ratio[None, :, 1]
    )
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
