"""From a solved state to what a person wants to know of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import jax, jnp
from notchflex.loads.applied import Applied, body_wrench
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import FlexureState, in_space, relative_pose, turn_doubt
from notchflex.mechanics.motion import IN_PLANE, Motion, wrench_at
from notchflex.solver.continuation import Solved
from notchflex.solver.derived.moments import moment_error
from notchflex.solver.element import Unknowns, at_bound
from notchflex.solver.newton import Point
from notchflex.solver.programs.pytree_layout import Form
from notchflex.solver.residual import Evaluation, body_poses, evaluate, per_tendon

# A state whose moments are off by this part of the largest is none.
MODES_FAIL = 0.35
# A state whose turns are known worse is none, rad.
_DOUBT = 2e-6


class Shape(NamedTuple):
    """The shape of one state and whether it may be believed, or with a leading axis of many.

    Units mm, N, rad; t tendons, n flexures; poses in the frame of the base.
    """

    tension: Float[Array, "*s t"]
    stroke: Float[Array, "*s t"]
    notch_angle: Float[Array, "*s n"]
    total_angle: Float[Array, "*s"]
    body_position: Float[Array, "*s bodies 3"]
    body_rotation: Float[Array, "*s bodies 3 3"]
    tip_position: Float[Array, "*s 3"]
    friction_holds: Bool[Array, "*s"]
    moment_error: Float[Array, "*s"]
    bend_possible: Bool[Array, "*s"]

    @staticmethod
    def form(flexures: int, tendons: int) -> Form:
        """How it is packed for a robot of so many flexures and tendons."""
        bodies = flexures + 1
        shapes = ((tendons,), (tendons,), (flexures,), (), (bodies, 3), (bodies, 3, 3), (3,), ())
        numbers = [np.zeros(shape) for shape in shapes]
        no = np.zeros((), bool)
        return Form.of(Shape(*numbers[:7], no, numbers[7], no))  # pyright: ignore


def believable(friction_holds: Any, moment_error: Any, bend_possible: Any) -> Any:
    """Whether solved states lie within what friction law, modes and geometry are for."""
    return friction_holds & (moment_error < MODES_FAIL) & bend_possible


def shape(chain: Chain, solved: Solved) -> Shape:
    """The shape of a solved state."""
    point = solved.point
    at = evaluate(chain, point.unknowns, solved.memory, point.base_tension, solved.applied)
    relative = at.flexure.pose  # None where the balance did not ask for it
    if relative is None:
        relative = jax.vmap(relative_pose)(chain.rods, point.unknowns.modes)
    bodies = _in_space(chain, body_poses(relative))
    last = jax.tree.map(lambda leaf: leaf[-1], bodies)
    turning = _turning(chain, at)
    angles = notch_angles(chain, relative.rotation)
    return Shape(
        tension=point.base_tension,
        stroke=solved.stroke,
        notch_angle=angles,
        total_angle=total_angle(chain.notch_frame, angles, bodies.rotation[-1]),
        body_position=bodies.translation,
        body_rotation=bodies.rotation,
        tip_position=last.point(jnp.array([0.0, 0.0, 1.0]) * chain.body_length[-1]),
        friction_holds=jnp.all(chain.friction.valid(turning[0], turning[1])),
        moment_error=moment_error(chain, point.unknowns, at),
        bend_possible=_bend_possible(chain, point.unknowns.modes, at.flexure),
    )


def _bend_possible(
    chain: Chain, modes: Float[Array, "n modes"], flexure: FlexureState
) -> Bool[Array, ""]:
    """Whether every flexure is bent as it can be, and as its pose can be computed.

    By less than half a turn, with no fibre shortened to nothing, and not so far about several axes
    that the order of its turns is not known well.
    """
    turn = jnp.sum(flexure.bend**2, axis=-1) < np.pi**2
    known = jax.vmap(turn_doubt)(chain.rods, modes) < _DOUBT
    return jnp.all(turn & known) & jnp.all(_fibre_strain(chain, flexure) < 1.0)


def _fibre_strain(chain: Chain, flexure: FlexureState) -> Float[Array, "n nodes"]:
    """Strain of the fibre farthest from the neutral axis at every node, its magnitude."""
    section = chain.rods.section
    farthest = jnp.maximum(section.edge_spine, section.edge_near)
    return jnp.abs(in_space(flexure.strain)[..., 1]) * farthest


def total_angle(
    notch_frame: Float[Array, "n 3 3"],
    notch_angle: Float[Array, "*s n"],
    tip_rotation: Float[Array, "*s 3 3"],
) -> Float[Array, "*s"]:
    """Bending angle of a whole robot, rad.

    Where all notches bend in one plane, the sum of their angles, toward the first one's bend
    positive; otherwise the angle between the axes of base and tip.
    """
    along = notch_frame[:, :, 0] @ notch_frame[0, :, 0]
    in_plane = jnp.all(jnp.abs(jnp.abs(along) - 1.0) <= _IN_PLANE)
    across = tip_rotation[..., 0, 2] ** 2 + tip_rotation[..., 1, 2] ** 2
    straight = across == 0.0  # where the angle has a kink, and no derivative
    sine = jnp.where(straight, 0.0, jnp.sqrt(jnp.where(straight, 1.0, across)))
    between = jnp.arctan2(sine, tip_rotation[..., 2, 2])
    return jnp.where(in_plane, notch_angle @ jnp.sign(along), between)


# Of the cosine between the directions of two notches, less than 0.3 degrees.
_IN_PLANE = 1e-5


class Quantities(NamedTuple):
    """What else is told of one state, or with a leading axis of many.

    Units mm, N, N mm, rad; t tendons, n flexures. Spans of a tendon are in the order proximal,
    gap 1, body 1, gap 2, ... of the gaps and bodies that it runs through, contacts in the order of
    the edges between them; NaN beyond its end.
    """

    chord_angle: Float[Array, "*s n"]
    span_tension: Float[Array, "*s t spans"]
    notch_moment: Float[Array, "*s n"]
    outer_strain: Float[Array, "*s n"]
    peak_strain: Float[Array, "*s n"]
    gap: Float[Array, "*s n"]
    contact_force: Float[Array, "*s n"]
    contact_log_ratio: Float[Array, "*s t contacts"]
    contact_slid: Float[Array, "*s t contacts"]
    contact_bound: Float[Array, "*s t contacts"]
    contact_turning: Float[Array, "*s t contacts"]
    contact_state: Int[Array, "*s t contacts"]
    base_force: Float[Array, "*s 3"]
    base_moment: Float[Array, "*s 3"]
    stored_energy: Float[Array, "*s"]


BY_FLEXURE = (
    "notch_angle",
    "chord_angle",
    "notch_moment",
    "outer_strain",
    "peak_strain",
    "gap",
    "contact_force",
)
# With so many axes behind that of the bodies.
BY_BODY = {"body_position": 1, "body_rotation": 2}
_BY_CONTACT = (
    "span_tension",
    "contact_log_ratio",
    "contact_slid",
    "contact_bound",
    "contact_turning",
    "contact_state",
)


def _turning(chain: Chain, at: Evaluation) -> tuple[Array, Array]:
    """Turning angles at both edges of all gaps; 0 where a tendon has no contact."""
    visited = per_tendon(chain, tuple(group.visits for group in chain.groups)) > 0.0
    angles = [(s.crossing.exit_turning, s.crossing.entry_turning) for s in at.spans]
    first, second = _each(chain, angles)
    return jnp.where(visited, first, 0.0), jnp.where(visited, second, 0.0)


def quantities(chain: Chain, solved: Solved) -> Quantities:
    """Everything else that is reported of a solved state, in the frame of the base.

    Slid lengths, stroke and energy use the robot file's axial stiffness of the tendon; the
    finite one of the memory only decides what sticks.
    """
    point = solved.point
    at = evaluate(chain, point.unknowns, solved.memory, point.base_tension, solved.applied)
    flexure = at.flexure
    gap_tension, body_tension = _each(chain, [(s.gap_tension, s.body_tension) for s in at.spans])
    turning = _turning(chain, at)
    body_length = per_tendon(chain, tuple(group.body_length for group in chain.groups))
    compliance = jnp.broadcast_to(1.0 / chain.axial_stiffness, gap_tension.shape)
    drawn, stretch = _each(chain, [(s.drawn, s.stretch) for s in at.spans])
    drawn_behind, stretch_behind = _each(
        chain, [(s.drawn_behind, s.stretch_behind) for s in at.spans]
    )
    at_entry = drawn + (stretch + body_tension * body_length) * compliance
    at_exit = drawn_behind + stretch_behind * compliance
    log_ratio = _each(chain, [(own[..., 0], own[..., 1]) for own in point.unknowns.log_ratio])
    bound = _each(chain, [(s.bound[..., 0], s.bound[..., 1]) for s in at.spans])
    contact = along_contacts(chain, log_ratio[0], log_ratio[1])
    limit = along_contacts(chain, bound[0], bound[1])
    spans = _along(chain, gap_tension, body_tension)[:, :-1]
    curvature = in_space(flexure.strain)[..., 1]
    section = chain.rods.section
    contact_force, gap = notch_lips(chain, point.unknowns, at)
    base = base_wrench(chain, point.base_tension, at, solved.applied)
    return Quantities(
        chord_angle=_chords(chain, flexure),
        span_tension=jnp.concatenate([point.base_tension[:, None], spans], axis=1),
        notch_moment=largest_moment(flexure),
        outer_strain=jnp.max(curvature * section.edge_spine, axis=-1),
        peak_strain=jnp.max(_fibre_strain(chain, flexure), axis=-1),
        gap=gap,
        contact_force=contact_force,
        contact_log_ratio=contact,
        contact_slid=along_contacts(chain, at_exit, at_entry),
        contact_bound=limit,
        contact_turning=along_contacts(chain, turning[0], turning[1]),
        contact_state=at_bound(contact, limit),
        base_force=base[3:],
        base_moment=base[:3],
        stored_energy=_stored_energy(chain, point, at, gap_tension, body_tension),
    )


def notch_lips(
    chain: Chain, unknowns: Unknowns, at: Evaluation
) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
    """Contact force and what is left of the narrowest opening of every notch (N, mm)."""
    force = jnp.zeros(chain.flexures)
    gap = jnp.full(chain.flexures, jnp.inf)
    for group, own, touch in zip(chain.lips, unknowns.lip_force, at.touches, strict=True):
        force = force + jnp.sum(own * group.closes, axis=-1)
        gap = jnp.minimum(gap, jnp.min(jnp.where(group.closes > 0.0, touch.gap, jnp.inf), axis=-1))
    return force, jnp.where(jnp.isinf(gap), jnp.nan, gap)


def largest_moment(flexure: FlexureState) -> Float[Array, " n"]:
    """Bending moment in the plane of each notch, the largest along it, with its sign."""
    moment = in_space(flexure.resultants)[..., 1]
    where = jnp.argmax(jnp.abs(moment), axis=-1)
    return jnp.take_along_axis(moment, where[:, None], axis=-1)[:, 0]


def base_wrench(
    chain: Chain, base_tension: Float[Array, " t"], at: Evaluation, applied: Applied | None
) -> Float[Array, " 6"]:
    """What the holder does to the tube: moment about the base's origin, and force.

    It balances the loads, and the drives' pull on the tendons where they enter the base.
    """
    acting = jnp.zeros(6)
    if applied is not None and at.base.load is not None:
        on_base = jax.tree.map(lambda leaf: leaf[0], applied)
        acting = in_space(
            at.base.load + body_wrench(jnp.eye(on_base.dead_force.shape[-1]), on_base)
        )
        if chain.frame is not None:
            acting = (chain.frame @ acting.reshape(2, 3, 1)).reshape(6)
    # What the drives pull on the tendons with.
    pulled = base_tension[:, None] * jnp.array([[0.0, 0.0, -1.0]])
    return -acting - jnp.sum(jax.vmap(wrench_at)(chain.tendon_place, pulled), axis=0)


def notch_angles(chain: Chain, relative: Float[Array, "n d d"]) -> Float[Array, " n"]:
    """Rotation of every body against the one before, about the axis of bending of its notch.

    The axis is y of the notch's frame, turned by the notch's direction about the tube; angles of
    up to half a turn are told apart.
    """
    across = chain.notch_frame[..., IN_PLANE]
    if chain.frame is not None:
        across = chain.frame[:, IN_PLANE].T @ across
    turned = jnp.einsum("nba,nbc,ncd->nad", across, relative, across)
    return jnp.atan2(turned[:, 0, 1] - turned[:, 1, 0], turned[:, 0, 0] + turned[:, 1, 1])


def _chords(chain: Chain, flexure: FlexureState) -> Float[Array, " n"]:
    """Angle of the chords; NaN where a flexure has none."""
    if flexure.chord_angle is None or chain.rods.chord is None:
        return jnp.full(chain.flexures, jnp.nan)
    return jnp.where(chain.rods.chord > 0.0, flexure.chord_angle, jnp.nan)


def _stored_energy(
    chain: Chain,
    point: Point,
    at: Evaluation,
    gap_tension: Float[Array, "n t"],
    body_tension: Float[Array, "n t"],
) -> Float[Array, ""]:
    """Energy of the flexures and of stretched tendons, N mm."""
    flexure = at.flexure
    density = jax.vmap(jax.vmap(chain.law.energy))(
        in_space(flexure.strain), chain.rods.section, chain.memory
    )
    natural_gap = per_tendon(chain, tuple(group.natural_gap for group in chain.groups))
    body_length = per_tendon(chain, tuple(group.body_length for group in chain.groups))
    visits = per_tendon(chain, tuple(group.visits for group in chain.groups))
    compliance = jnp.broadcast_to(1.0 / chain.axial_stiffness, gap_tension.shape)
    in_tendons = gap_tension**2 * natural_gap + body_tension**2 * body_length
    return (
        jnp.sum(chain.rods.length * density)
        + 0.5 * jnp.sum(in_tendons * visits * compliance)
        + 0.5 * jnp.sum(point.base_tension**2 * chain.free_length / chain.axial_stiffness)
    )


def _each(chain: Chain, pairs: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Pairs of values per group, each of the two in the order of the robot's tendons."""
    first, second = zip(*pairs, strict=True)
    return per_tendon(chain, first), per_tendon(chain, second)


def of_own(chain: Chain, name: str, values: np.ndarray) -> np.ndarray:
    """Return a quantity of a chain whose contacts are all edges of all gaps as that of its own.

    Args:
        chain: The own chain.
        name: Name of the quantity, one of `Shape` or `Quantities`.
        values: Its values with any leading axes, of a chain that may have more flexures.
    """
    if name in BY_FLEXURE:
        return values[..., : chain.flexures]
    if name in BY_BODY:
        return values[(..., slice(chain.flexures + 1), *(slice(None),) * BY_BODY[name])]
    if name not in _BY_CONTACT:
        return values
    met = np.asarray(chain.contacts)
    first = int(name == "span_tension")  # the proximal span comes before the first edge
    tendons = np.arange(len(met))[:, None]
    beyond = 0 if name == "contact_state" else np.nan
    found = np.where(met[:, 1:] >= 0, values[..., tendons, met[:, :-1] + first], beyond)
    return np.concatenate([values[..., :first], found], axis=-1)


def _in_space(chain: Chain, poses: Motion) -> Motion:
    """Poses in the frame of the base, of a chain that may be flat."""
    if chain.frame is None:
        return poses
    frame = chain.frame
    plane = frame[:, IN_PLANE]
    about = frame[:, 1:2]
    rotation = plane @ poses.rotation @ plane.T + (about @ about.T)[None]
    return Motion(rotation, poses.translation @ plane.T)


def _along(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t edges"]:
    """Values at the edges that each tendon meets, base to tip; NaN beyond its end."""
    pairs = jnp.stack([exit_value, entry_value], axis=1)
    flat = pairs.reshape(-1, pairs.shape[-1]).T
    met = jnp.take_along_axis(flat, jnp.maximum(chain.contacts, 0), axis=1)
    beyond = jnp.roll(chain.contacts, -1, axis=1).at[:, -1].set(-1)
    # The last edge, where the tendon enters its end body, is no contact: it is fixed there.
    return jnp.where(beyond >= 0, met, jnp.nan)


def along_contacts(
    chain: Chain, exit_value: Float[Array, "n t"], entry_value: Float[Array, "n t"]
) -> Float[Array, "t contacts"]:
    """Values at the contacts of each tendon, base to tip; NaN beyond its end."""
    return _along(chain, exit_value, entry_value)[:, :-1]
