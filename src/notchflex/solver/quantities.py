"""Quantities of one solved state, each registered beside its formula; compiled by JAX."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex._quantity import REGISTERED, Quantity, axis_sizes
from notchflex.mechanics.chain import Chain
from notchflex.mechanics.flexure import in_space, rotation_error_estimate
from notchflex.mechanics.material import edge_strain
from notchflex.mechanics.material import peak_strain as peak_strain_of_section
from notchflex.mechanics.motion import IN_PLANE
from notchflex.mechanics.sheath import mean_tension
from notchflex.solver.programs.static_structure import PytreeLayout
from notchflex.solver.residual import Iterate, SolverState, bound_side, evaluate
from notchflex.solver.solved_state import SolvedState

# States with a larger moment error count as not converged.
MAX_MOMENT_ERROR = 0.35
# Fraction of the end compliance of a notch beyond its faces: from finite elements, middle notches
# of wrists A and B at every load (3.0 % and 4.1 % of the angle).
_BEYOND_FACES = 0.086
# Rounding of the cosine between the directions of two notches.
_ROUNDING = 1e-15
# Smaller moments do not count, as a fraction of the largest stiffness of a mode (per rad).
_MIN_RELATIVE_MOMENT = 1e-12
# States with a larger error of rotation count as not converged, rad.
_MAX_ROTATION_ERROR = 1e-5


@Quantity("solve", "tendon tension", "T", "N", key="tendon_tension_N",
          column="tendon{tendon}_force_N", per=("tendon",))  # fmt: skip
def tension(state: SolvedState) -> Array:
    """Tension of a tendon at its drive, as it is in the solved state: without a sheath the base."""
    return state.solved.tension


@Quantity("solve", "tendon stroke", "u", "mm", key="tendon_stroke_mm",
          column="tendon{tendon}_displacement_mm", per=("tendon",))  # fmt: skip
def stroke(state: SolvedState) -> Array:
    """Way of the drive of a tendon since the state without load: without a sheath, drawn out."""
    return state.solved.stroke


@Quantity("state", "tendon tension at the base", r"T_\mathrm{b}", "N", key="base_tension_N",
          column="tendon{tendon}_base_force_N", per=("tendon",),
          optional=lambda path: path.chain.sheath is not None)  # fmt: skip
def base_tension(state: SolvedState) -> Array:
    """Tension of a tendon at the base, behind its sheath; empty (NaN) without sheaths."""
    at_base = state.solved.point.base_tension
    return jnp.full_like(at_base, jnp.nan) if state.solved.memory.sheath is None else at_base


@Quantity("state", "tendon stroke at the base", r"u_\mathrm{b}", "mm", key="base_stroke_mm",
          column="tendon{tendon}_base_displacement_mm", per=("tendon",),
          optional=lambda path: path.chain.sheath is not None)  # fmt: skip
def base_stroke(state: SolvedState) -> Array:
    """Tendon length drawn out at the base, behind its sheath; empty (NaN) without sheaths."""
    sheath = state.solved.memory.sheath
    return jnp.full_like(state.solved.stroke, jnp.nan) if sheath is None else sheath.stroke


@Quantity("solve", per=("tendon",))
def wire_stroke(state: SolvedState) -> Array:
    """Way of the wire's end at the drive, on which the drive works; without a backlash `stroke`."""
    return state.solved.wire_stroke


@Quantity("solve", "notch angle", r"\theta_j", "deg", key="notch_angle_deg",
          column="notch_{notch}_deg", per=("notch",))  # fmt: skip
def notch_angle(state: SolvedState) -> Array:
    """Rotation of the body beyond a notch against the body before it.

    It includes the precurvature; the order is from base to tip. The axis is y of the notch's frame,
    turned by the notch's direction about the tube; angles of up to half a turn are distinguished.
    """
    across, frame = state.chain.notch_frame[..., IN_PLANE], state.chain.frame
    if frame is not None:
        across = frame[:, IN_PLANE].T @ across
    turned = jnp.einsum("nba,nbc,ncd->nad", across, state.relative.rotation, across)
    return jnp.atan2(turned[:, 0, 1] - turned[:, 1, 0], turned[:, 0, 0] + turned[:, 1, 1])


@Quantity("state", "edge angle", r"\phi_j", "deg", key="edge_angle_deg",
          column="notch_{notch}_edge_deg", per=("notch",))  # fmt: skip
def edge_angle(state: SolvedState) -> Array:
    """Angle between the two faces of a notch, as a photograph shows it.

    With elastic ends it is less than the notch angle, which moves the tip: part of the elastic
    angle lies in the rings beyond the faces.
    """
    chain, flexure, ends = state.chain, state.evaluation.flexure, state.chain.rods.section.ends
    angles = state.quantity("notch_angle")
    if ends is None:
        return angles
    beyond = _BEYOND_FACES * ends.weak / (1.0 + ends.weak)
    curvature = in_space(flexure.strain)[..., 1]
    return angles - jnp.einsum("ni,ni,ni->n", chain.rods.length, beyond, curvature)


def has_chord(chain: Chain) -> Any:
    """Return which flexures of a chain have a chord, whose angle is an output."""
    chord = chain.rods.chord
    return np.zeros(chain.flexures, bool) if chord is None else np.asarray(chord) > 0.0


@Quantity("state", "chord angle", r"\psi_j", "deg", key="chord_angle_deg",
          column="notch_{notch}_chord_deg", per=("notch",),
          optional=lambda path: has_chord(path.chain))  # fmt: skip
def chord_angle(state: SolvedState) -> Array:
    """Angle by which the chord of a strip has turned in its plane of bending.

    It is the bending angle of Liu 2022, about two thirds of the notch angle.
    """
    chord, angle = state.chain.rods.chord, state.evaluation.flexure.chord_angle
    if angle is None or chord is None:
        return jnp.full(state.chain.flexures, jnp.nan)
    return jnp.where(chord > 0.0, angle, jnp.nan)


@Quantity("solve", "total bending angle", r"\theta", "deg", key="total_angle_deg",
          column="total_deg")  # fmt: skip
def total_angle(state: SolvedState) -> Array:
    """Turning of the tube axis about the bending axis of the first notch, over all notches.

    It is the sum of the notch angles, each times the cosine of the angle between the directions of
    that notch and of the first. In one plane that is the sum of the angles, those of notches on
    the other side negative.
    """
    side = state.chain.notch_frame[:, :, 0]
    cosine = side @ side[0]
    # 1, 0 or -1 to rounding where notches open to equal, perpendicular or opposite sides.
    error = cosine - jnp.round(cosine)
    rounding = jnp.where(jnp.abs(error) < _ROUNDING, error, 0.0)
    return state.quantity("notch_angle") @ (cosine - jax.lax.stop_gradient(rounding))


@Quantity("solve", "body position", "p_b", "mm", per=("body", "axis"), in_world=True)
def body_position(state: SolvedState) -> Array:
    """Origin of every rigid body in the world, base first.

    It is on the tube axis, at the proximal face of the body.
    """
    return state.bodies.translation


@Quantity("solve", "body rotation", "R_b", per=("body", "row", "axis"), in_world=True)
def body_rotation(state: SolvedState) -> Array:
    """Rotation matrix of every rigid body, base first, in the world."""
    return state.bodies.rotation


@Quantity("solve", "tip position", "p", "mm", key="tip_position_mm", column="tip_{axis}_mm",
          per=("axis",), after="total_angle", in_world=True)  # fmt: skip
def tip_position(state: SolvedState) -> Array:
    """Position of the tip (the end of the last uncut section) in the world."""
    last = jax.tree.map(lambda leaf: leaf[-1], state.bodies)
    return last.point(jnp.array([0.0, 0.0, 1.0]) * state.chain.body_length[-1])


@Quantity("derived", "tip rotation", "R", key="tip_rotation", per=("row", "axis"),
          after="tip_position", in_world=True)  # fmt: skip
def tip_rotation(state: SolvedState) -> Array:
    """Rotation matrix of the tip in the world."""
    return state.quantity("body_rotation")[..., -1, :, :]


@Quantity("derived", "angle between the axes of base and tip", r"\alpha", "deg",
          key="tip_axis_angle_deg", column="tip_axis_deg", after="total_angle")  # fmt: skip
def tip_axis_angle(state: SolvedState) -> Array:
    """Angle between the axis of the base and that of the tip, from 0 to half a turn.

    It has a kink, and no derivative, where both are parallel.
    """
    axes = state.quantity("body_rotation")[..., :, 2]
    base, tip = axes[..., 0, :], axes[..., -1, :]
    between = xp.linalg.norm(tip - base, axis=-1), xp.linalg.norm(tip + base, axis=-1)
    return 2.0 * xp.arctan2(*between)


@Quantity("solve", kind=bool)
def friction_holds(state: SolvedState) -> Array:
    """Whether no tendon turns so sharply at an edge that its friction would hold any pull."""
    return jnp.all(state.chain.friction.valid(state.turning))


@Quantity("state", "span tension", "T", "N", key="span_tension_N", column="tendon{tendon}_{span}_N",
          per=("tendon", "span"))  # fmt: skip
def span_tension(state: SolvedState) -> Array:
    """Tension along a tendon: proximal, gap 1, body 1, gap 2, ... to its last gap.

    These are the gaps and bodies that it runs through.
    """
    spans = state.along_edges(state.tensions)[:, :-1]
    return jnp.concatenate([state.solved.point.base_tension[:, None], spans], axis=1)


@Quantity("state", "notch moment", "M_j", "N mm", key="notch_moment_Nmm",
          column="notch_{notch}_moment_Nmm", per=("notch",))  # fmt: skip
def notch_moment(state: SolvedState) -> Array:
    """Bending moment carried by what the cut of a notch leaves, the largest along it."""
    moment = in_space(state.evaluation.flexure.resultants)[..., 1]
    where = jnp.argmax(jnp.abs(moment), axis=-1)
    return jnp.take_along_axis(moment, where[:, None], axis=-1)[:, 0]


@Quantity("state", "outer strain", r"\varepsilon_j", key="outer_strain",
          column="notch_{notch}_outer_strain", per=("notch",))  # fmt: skip
def outer_strain(state: SolvedState) -> Array:
    """Strain of the outer fibre in the middle of the spine (Pacheco 2021, eq. 16)."""
    strain = state.section_strain
    spine = state.chain.rods.section.edge_spine
    return state.of_sections(jnp.max(strain.stretch + strain.curvature * spine, axis=-1))


@Quantity("state", "peak strain", r"\varepsilon_\mathrm{max}", key="peak_strain",
          column="notch_{notch}_peak_strain", per=("notch",))  # fmt: skip
def peak_strain(state: SolvedState) -> Array:
    """Largest strain of any fibre of a notch: bending both ways and stretch, no shear."""
    strains = peak_strain_of_section(state.section_strain, state.chain.rods.section)
    return state.of_sections(jnp.max(strains, axis=-1))


@Quantity("state", per=("notch", "node", "row"))
def notch_strain(state: SolvedState) -> Array:
    """Stretch, curvature and sideways curvature (1/mm) of the section at every node of a notch."""
    return state.of_sections(jnp.stack(state.section_strain, axis=-1))


@Quantity("state", "margin of fatigue", r"\varepsilon_\mathrm{m}", key="fatigue_margin",
          column="notch_{notch}_fatigue_margin", per=("notch",),
          optional=lambda path: path.chain.limit is not None,
          note="NaN without a limit line, and where it is not known at a mean strain.")  # fmt: skip
def fatigue_margin(state: SolvedState) -> Array:
    """Strain amplitude that the limit line allows less that between this state and rest.

    It is the smallest of all points on the boundary of the notch's section.
    """
    limit, section = state.chain.limit, state.chain.rods.section
    if limit is None:
        return jnp.full(state.chain.flexures, jnp.nan)
    half = 0.5 * edge_strain(state.section_strain, section)
    margin = limit.margin(half, jnp.abs(half)).reshape(state.chain.flexures, -1)
    known = margin == margin
    least = jnp.min(jnp.where(known, margin, 0.0), axis=-1)
    return state.of_sections(jnp.where(jnp.all(known, axis=-1), least, jnp.nan))


@Quantity("state", "notch gap", "g_j", "mm", key="gap_mm", column="notch_{notch}_gap_mm",
          per=("notch",), note="NaN where there are no lips, as of a backbone.",
          optional=lambda path: np.array([notch.has_lips for notch in path.robot.notches])
          )  # fmt: skip
def gap(state: SolvedState) -> Array:
    """What is left of the opening of a notch between its lips, where it is narrowest."""
    return state.contact_pairs[1]


@Quantity("derived", "closed", key="closed", column="notch_{notch}_closed", per=("notch",),
          kind=bool)  # fmt: skip
def closed(state: SolvedState) -> Array:
    """True where the lips of a notch press on each other."""
    return state.quantity("contact_force") > 0.0


@Quantity("state", "contact force", "N_j", "N", key="contact_force_N",
          column="notch_{notch}_contact_N", per=("notch",))  # fmt: skip
def contact_force(state: SolvedState) -> Array:
    """Force between the touching lips of a closed notch."""
    return state.contact_pairs[0]


@Quantity("state", "tension ratio over a contact", "x_i", key="contacts.log_ratio",
          per=("tendon", "contact"))  # fmt: skip
def contact_log_ratio(state: SolvedState) -> Array:
    """ln(tension on the base side / tension on the tip side) of a friction contact.

    With a `constant_loss` both tensions are raised by it.
    """
    return state.along_contacts(state.solved.point.unknowns.log_ratio)


@Quantity("state", "slid length", "s_i", "mm", key="contacts.slid_mm", per=("tendon", "contact"))
def contact_slid(state: SolvedState) -> Array:
    """Tendon length that has slid over a friction contact toward the base."""
    spans = state.evaluation.spans
    released = state.at_edges(jnp.stack([s.released_length, s.released_beyond], -1) for s in spans)
    lengths = (jnp.stack([s.tension_length, s.tension_length_beyond], -1) for s in spans)
    in_body = state.tensions[..., 1] * state.by_tendon("body_length")
    tension_length = state.at_edges(lengths) + jnp.stack([0.0 * in_body, in_body], axis=-1)
    return state.along_edges(released + tension_length * state.compliance[..., None])[:, :-1]


@Quantity("state", "turning at a contact", r"\beta_i", "deg", key="contacts.turning_deg",
          per=("tendon", "contact"))  # fmt: skip
def contact_turning(state: SolvedState) -> Array:
    """Angle by which a tendon turns at a friction contact."""
    return state.along_edges(state.turning)[:, :-1]


@Quantity("state", "state of a contact", key="contacts.state", per=("tendon", "contact"), kind=int,
          note="0 sticks, +1 slips toward the base, -1 slips toward the tip.")  # fmt: skip
def contact_state(state: SolvedState) -> Array:
    """What a friction contact does: "stick", "slip toward base" or "slip toward tip"."""
    side = bound_side(state.quantity("contact_log_ratio"), state.quantity("contact_bound"))
    loss = state.chain.friction.constant_loss(state.turning)
    if loss is None:
        return side
    # Below its loss a tension draws nothing over the contact, though none is left behind it.
    before = state.quantity("span_tension")[:, :-1]
    return jnp.where((side > 0) & (before < state.along_edges(loss)[:, :-1]), 0, side)


@Quantity("state", "largest tension ratio over a contact", "b_i", per=("tendon", "contact"))
def contact_bound(state: SolvedState) -> Array:
    """Largest magnitude that the friction law allows the tension ratio over a contact."""
    return state.along_contacts(span.bound for span in state.evaluation.spans)


@Quantity("state", "base force", "F", "N", key="base_force_N", column="base_force_{axis}_N",
          per=("axis",), in_world=True)  # fmt: skip
def base_force(state: SolvedState) -> Array:
    """Force of the holder on the base, in the world.

    It balances the loads and the pull of the drives on the tendons.
    """
    return state.base[3:]


@Quantity("state", "base moment", "M", "N mm", key="base_moment_Nmm",
          column="base_moment_{axis}_Nmm", per=("axis",), in_world=True)  # fmt: skip
def base_moment(state: SolvedState) -> Array:
    """Moment of the holder on the base about its proximal end, in the world."""
    return state.base[:3]


@Quantity("solve", "moment error", "e", key="moment_error", column="moment_error")
def moment_error(state: SolvedState) -> Array:
    """Largest error of the moment of the strain modes, over the largest moment.

    The error is the difference from the moment that the loads ask for: how well the modes serve.
    """
    # Bending about x and y in space, about y in the plane.
    chain, bending = state.chain, slice(1 if state.chain.frame is not None else 2)
    required = state.required()[..., bending]
    real = jnp.any(chain.rods.padding_mask == 0.0, axis=-1)
    if chain.law.lumped is not False:
        real = real & ~jnp.asarray(chain.law.lumped)
    has_length = (real[:, None] & (chain.rods.length > 0.0))[..., None]
    carried = 1.0 * jnp.any(chain.rods.basis[..., bending, :] != 0.0, axis=(1, 3))[:, None]
    missing = state.evaluation.flexure.resultants[..., bending] - required
    error = jnp.max(jnp.abs(missing) * has_length * carried)
    largest = jnp.max(jnp.abs(required) * has_length)
    # Smaller moments are rounding errors.
    bends = largest > _MIN_RELATIVE_MOMENT * jnp.max(chain.stiffness)
    return jnp.where(bends, error / jnp.where(bends, largest, 1.0), 0.0)


@Quantity("solve", kind=bool)
def bend_possible(state: SolvedState) -> Array:
    """Whether every flexure is bent as it can be, and as its pose can be computed.

    By less than half a turn, with no fibre shortened to nothing, not beyond the ends of a table,
    and not so far about several axes that the order of its turns is not known well.
    """
    chain, flexure = state.chain, state.evaluation.flexure
    below_half_turn = jnp.sum(flexure.bend**2, axis=-1) < np.pi**2
    error = jax.vmap(rotation_error_estimate)(chain.rods, state.solved.point.unknowns.modes)
    covers = jax.vmap(type(chain.law).covers, (chain.law.axis, 0, 0))
    covered = covers(chain.law, in_space(flexure.strain), chain.rods.section)
    return jnp.all(below_half_turn & (error < _MAX_ROTATION_ERROR)) & jnp.all(covered)


@Quantity("state", "stored energy", "U", "N mm", key="stored_energy_Nmm",
          column="stored_energy_Nmm")  # fmt: skip
def stored_energy(state: SolvedState) -> Array:
    """Elastic energy held by flexures, lips that press, stretched tendons and their sheaths."""
    chain, base_tension = state.chain, state.solved.point.base_tension
    sheath, in_sheaths = state.solved.memory.sheath, jnp.zeros(())
    if chain.sheath is not None and sheath is not None:
        squared = mean_tension((sheath.place, sheath.level), power=2)
        in_sheaths = 0.5 * jnp.sum(chain.sheath.compliance * squared)
    density, _ = state.stored_energy_density
    in_gap, in_body = jnp.moveaxis(state.tensions, -1, 0)
    in_tendons = in_gap**2 * state.by_tendon("natural_gap")
    in_tendons = in_tendons + in_body**2 * state.by_tendon("body_length")
    in_contacts = jnp.zeros(())
    if chain.contact_flexibility is not None:
        squares = [
            jnp.sum(force**2, axis=-1) for force in state.solved.point.unknowns.contact_force
        ]
        in_contacts = 0.5 * jnp.sum(chain.contact_flexibility[None] * jnp.stack(squares))
    return (
        in_contacts
        + in_sheaths
        + jnp.sum(chain.rods.length * density)
        + 0.5 * jnp.sum(in_tendons * state.by_tendon("visits") * state.compliance)
        + 0.5 * jnp.sum(base_tension**2 * chain.free_length / chain.axial_stiffness)
    )


@Quantity("state", per=("notch", "row", "node"))
def flattening(state: SolvedState) -> Array:
    """Flattening at every node: its path X, transformed moment times length, and H times length.

    Zero for materials without hysteresis; see `mechanics/material/law.py`.
    """
    chain, memory = state.chain, state.solved.memory.material
    length = chain.rods.length
    if isinstance(memory, tuple) or chain.rods.section.ends is None:
        return jnp.zeros((len(length), 3, 1))
    _, at_nodes = state.stored_energy_density
    return jnp.stack(
        [at_nodes.path, length * at_nodes.transformed, length * at_nodes.by_transformation], axis=1
    )


def reported(source: str) -> tuple[str, ...]:
    """Return the names of the quantities that a program computes: "solve", or "state" after it."""
    return tuple(name for name, quantity in REGISTERED.items() if quantity.source == source)


class Shape(namedtuple("Shape", reported("solve"))):  # pyright: ignore[reportUntypedNamedTuple]
    """Quantities that the program of a solve reports, of one state or many (leading axis)."""

    __slots__ = ()

    @staticmethod
    def form(flexures: int, tendons: int) -> PytreeLayout:
        """Return its layout for a number of flexures and tendons."""
        sizes = axis_sizes(flexures, tendons)
        registered = (REGISTERED[name] for name in Shape._fields)
        return PytreeLayout.of(
            Shape(*(np.zeros([sizes[axis] for axis in q.per], q.kind) for q in registered))
        )


def shape(chain: Chain, solved: SolverState) -> Shape:
    """Compute the quantities that the program of a solve reports."""
    state = SolvedState(chain, solved)
    return Shape(*(state.quantity(name) for name in Shape._fields))


def quantities(chain: Chain, solved: SolverState) -> dict[str, Array]:
    """Compute all other reported quantities of a solved state, in the frame of the base."""
    state = SolvedState(chain, solved)
    return {name: state.quantity(name) for name in reported("state")}


def believable(value: Callable[[str], Any]) -> Any:
    """Return whether states lie within the range of friction law, modes and geometry."""
    return (
        value("friction_holds")
        & (value("moment_error") < MAX_MOMENT_ERROR)
        & value("bend_possible")
    )


def unpad_quantity(chain: Chain, name: str, values: np.ndarray) -> np.ndarray:
    """Select the values of a chain from those of its padded chain with contacts at all edges."""
    per = REGISTERED[name].per
    if per[:1] in (("notch",), ("body",)):
        unpadded = slice(chain.flexures + (per[0] == "body"))
        return values[(..., unpadded, *(slice(None),) * (len(per) - 1))]
    if per[1:] not in (("span",), ("contact",)):
        return values
    contacts = np.asarray(chain.contacts)
    first = int(per[1] == "span")  # the proximal span comes before the first edge
    tendons = np.arange(len(contacts))[:, None]
    beyond = 0 if REGISTERED[name].kind is int else np.nan
    own_values = np.where(
        contacts[:, 1:] >= 0, values[..., tendons, contacts[:, :-1] + first], beyond
    )
    return np.concatenate([values[..., :first], own_values], axis=-1)


# Limit points between two solved states, where the resistance of a notch falls as it closes.
#
# Beyond a limit point no equilibrium exists under a higher tension: the notch snaps to another
# shape. Between the two states the holding tension of the notch has passed an extremum, which no
# sequence of equilibria under a monotonic tension can do.

# Number of shapes between the two, and the smallest relative fall of the holding tension.
_SHAPES_BETWEEN, _MIN_FALL = 33, 1e-6


def snapped_notches(chain: Chain, before: SolverState, after: SolverState) -> Float[Array, " n"]:
    """Return 1 for notches that snapped shut past a limit point, -1 for open, 0 else."""
    # Every notch moves from its first shape to its last, under a constant tension. Its resistance
    # over the drive of tendons and loads is its holding tension, relative to that tension, as long
    # as its edges do not touch. The friction of its edge grows with its angle; that of the notches
    # before it is that of the second state.
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
        evaluation = evaluate(chain, point, before.memory, after.applied)
        resistance = jnp.sum(evaluation.flexure.internal * change, axis=-1)
        missing = jnp.sum(evaluation.residual.modes * chain.stiffness * change, axis=-1)
        # With the friction of a notch's own edge, relative to the end: a contact slides all the way
        # in the direction of its total slip, so its log ratio is its bound. Several tendons are
        # weighted with their tensions.
        left, all_tension = jnp.zeros(()), jnp.zeros(())
        for span, last, slip in zip(evaluation.spans, unknowns.log_ratio, slid, strict=True):
            log_ratio = jnp.sign(slip[..., 0]) * span.bound[..., 0]
            raised = (span.gap_tension + offset) * jnp.exp(last[..., 0] - log_ratio)
            left = left + jnp.sum(jnp.where(span.gap_tension > 0.0, raised - offset, 0.0), axis=-1)
            all_tension = all_tension + jnp.sum(span.gap_tension, axis=-1)
        tight = all_tension > 0.0
        own_edge = jnp.where(tight, left / jnp.where(tight, all_tension, 1.0), 1.0)
        drive = own_edge * (resistance - missing)
        apart = jnp.ones(chain.flexures)
        for group, response in zip(chain.contact_pairs, evaluation.contacts, strict=True):
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
