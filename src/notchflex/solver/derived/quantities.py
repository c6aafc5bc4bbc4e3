"""Quantities of one solved state, each registered beside its formula; compiled by JAX."""

from __future__ import annotations

import numpy as np
from jaxtyping import Array

from notchflex._jax import jax, jnp
from notchflex._quantity import Quantity
from notchflex.mechanics.flexure import in_space, rotation_error_estimate
from notchflex.solver.derived.moments import moment_error as error_of_modes
from notchflex.solver.derived.solved_state import (
    SolvedState,
    along_contacts,
    along_edges,
    bending_angle,
    largest_moment,
    notch_angles,
    paired,
)
from notchflex.solver.element import bound_side

# States with a larger moment error count as not converged.
MAX_MOMENT_ERROR = 0.35
# Fraction of the end compliance of a notch beyond its faces: from finite elements, middle notches
# of wrists A and B at every load (3.0 % and 4.1 % of the angle).
_BEYOND_FACES = 0.086
# States with a larger error of rotation count as not converged, rad.
_MAX_ROTATION_ERROR = 2e-6


@Quantity("solve", "tendon tension", "T", "N", key="tendon_tension_N",
          column="tendon{tendon}_force_N", per=("tendon",))  # fmt: skip
def tension(state: SolvedState) -> Array:
    """Tension of a tendon at the base, as it is in the solved state."""
    return state.solved.point.base_tension


@Quantity("solve", "tendon stroke", "u", "mm", key="tendon_stroke_mm",
          column="tendon{tendon}_displacement_mm", per=("tendon",))  # fmt: skip
def stroke(state: SolvedState) -> Array:
    """Tendon length drawn out at the base since the state without load."""
    return state.solved.stroke


@Quantity("solve", "notch angle", r"\theta_j", "deg", key="notch_angle_deg",
          column="notch_{notch}_deg", per=("notch",))  # fmt: skip
def notch_angle(state: SolvedState) -> Array:
    """Rotation of the body beyond a notch against the body before it.

    It includes the precurvature; the order is from base to tip.
    """
    return notch_angles(state.chain, state.relative.rotation)


@Quantity("state", "edge angle", r"\phi_j", "deg", key="edge_angle_deg",
          column="notch_{notch}_edge_deg", per=("notch",), optional=True)  # fmt: skip
def edge_angle(state: SolvedState) -> Array:
    """Angle between the two faces of a notch, as a photograph shows it.

    With elastic ends it is less than the notch angle, which moves the tip: part of the elastic
    angle lies in the rings beyond the faces.
    """
    chain, flexure, ends = state.chain, state.at.flexure, state.chain.rods.section.ends
    angles = state.quantity("notch_angle")
    if ends is None:
        return angles
    beyond = _BEYOND_FACES * ends.weak / (1.0 + ends.weak)
    curvature = in_space(flexure.strain)[..., 1]
    return angles - jnp.einsum("ni,ni,ni->n", chain.rods.length, beyond, curvature)


@Quantity("state", "chord angle", r"\psi_j", "deg", key="chord_angle_deg",
          column="notch_{notch}_chord_deg", per=("notch",), optional=True)  # fmt: skip
def chord_angle(state: SolvedState) -> Array:
    """Angle by which the chord of a strip has turned in its plane of bending.

    It is the bending angle of Liu 2022, about two thirds of the notch angle.
    """
    chord, angle = state.chain.rods.chord, state.at.flexure.chord_angle
    if angle is None or chord is None:
        return jnp.full(state.chain.flexures, jnp.nan)
    return jnp.where(chord > 0.0, angle, jnp.nan)


@Quantity("solve", "total bending angle", r"\theta", "deg", key="total_angle_deg",
          column="total_deg")  # fmt: skip
def total_angle(state: SolvedState) -> Array:
    """Bending angle of the robot.

    Where all notches bend in one plane it is the sum of their angles, positive toward the bend of
    the first; otherwise the angle between the axes of base and tip.
    """
    angles, tip = state.quantity("notch_angle"), state.bodies.rotation[-1]
    return bending_angle(state.chain.notch_frame, angles, tip)


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


@Quantity("solve", kind=bool)
def friction_holds(state: SolvedState) -> Array:
    """Whether no tendon turns so sharply at an edge that its friction would hold any pull."""
    return jnp.all(state.chain.friction.valid(*state.turning))


@Quantity("state", "span tension", "T", "N", key="span_tension_N", column="tendon{tendon}_{span}_N",
          per=("tendon", "span"))  # fmt: skip
def span_tension(state: SolvedState) -> Array:
    """Tension along a tendon: proximal, gap 1, body 1, gap 2, ... to its last gap.

    These are the gaps and bodies that it runs through.
    """
    spans = along_edges(state.chain, *state.tensions)[:, :-1]
    return jnp.concatenate([state.solved.point.base_tension[:, None], spans], axis=1)


@Quantity("state", "notch moment", "M_j", "N mm", key="notch_moment_Nmm",
          column="notch_{notch}_moment_Nmm", per=("notch",))  # fmt: skip
def notch_moment(state: SolvedState) -> Array:
    """Bending moment carried by what the cut of a notch leaves, the largest along it."""
    return largest_moment(state.at.flexure)


@Quantity("state", "outer strain", r"\varepsilon_j", key="outer_strain",
          column="notch_{notch}_outer_strain", per=("notch",))  # fmt: skip
def outer_strain(state: SolvedState) -> Array:
    """Bending strain of the outer fibre of the spine (Pacheco 2021, eq. 16)."""
    return jnp.max(state.curvature * state.chain.rods.section.edge_spine, axis=-1)


@Quantity("state", "peak strain", r"\varepsilon_\mathrm{max}", key="peak_strain",
          column="notch_{notch}_peak_strain", per=("notch",))  # fmt: skip
def peak_strain(state: SolvedState) -> Array:
    """Largest bending strain of a notch, in the fibre farthest from its neutral axis."""
    return jnp.max(state.fibre_strain, axis=-1)


@Quantity("state", "notch gap", "g_j", "mm", key="gap_mm", column="notch_{notch}_gap_mm",
          per=("notch",))  # fmt: skip
def gap(state: SolvedState) -> Array:
    """What is left of the opening of a notch between its lips, where it is narrowest."""
    return state.contact_pairs[1]


@Quantity("derived", "closed", key="closed", column="notch_{notch}_closed", per=("notch",),
          kind=bool)  # fmt: skip
def closed(state: SolvedState) -> Array:
    """True where the lips of a notch touch."""
    # Contact force or gap is zero, but for rounding.
    force, gap = state.quantity("contact_force"), state.quantity("gap")
    return force > gap * state.chain.contact_stiffness


@Quantity("state", "contact force", "N_j", "N", key="contact_force_N",
          column="notch_{notch}_contact_N", per=("notch",))  # fmt: skip
def contact_force(state: SolvedState) -> Array:
    """Force between the touching lips of a closed notch."""
    return state.contact_pairs[0]


@Quantity("state", "tension ratio over a contact", "x_i", key="contacts.log_ratio",
          per=("tendon", "contact"))  # fmt: skip
def contact_log_ratio(state: SolvedState) -> Array:
    """ln(tension on the base side / tension on the tip side) of a friction contact."""
    pairs = [(own[..., 0], own[..., 1]) for own in state.solved.point.unknowns.log_ratio]
    return along_contacts(state.chain, *paired(state.chain, pairs))


@Quantity("state", "slid length", "s_i", "mm", key="contacts.slid_mm", per=("tendon", "contact"))
def contact_slid(state: SolvedState) -> Array:
    """Tendon length that has slid over a friction contact toward the base."""
    chain, spans = state.chain, state.at.spans
    beyond = paired(chain, [(s.released_beyond, s.tension_length_beyond) for s in spans])
    summed = paired(chain, [(s.released_length, s.tension_length) for s in spans])
    in_body = state.tensions[1] * state.by_tendon("body_length")
    at_entry = beyond[0] + (beyond[1] + in_body) * state.compliance
    return along_contacts(chain, summed[0] + summed[1] * state.compliance, at_entry)


@Quantity("state", "turning at a contact", r"\beta_i", "deg", key="contacts.turning_deg",
          per=("tendon", "contact"))  # fmt: skip
def contact_turning(state: SolvedState) -> Array:
    """Angle by which a tendon turns at a friction contact."""
    return along_contacts(state.chain, *state.turning)


@Quantity("state", "state of a contact", key="contacts.state", per=("tendon", "contact"), kind=int,
          note="0 sticks, +1 slips toward the base, -1 slips toward the tip.")  # fmt: skip
def contact_state(state: SolvedState) -> Array:
    """What a friction contact does: "stick", "slip toward base" or "slip toward tip"."""
    return bound_side(state.quantity("contact_log_ratio"), state.quantity("contact_bound"))


@Quantity("state", "largest tension ratio over a contact", "b_i", per=("tendon", "contact"))
def contact_bound(state: SolvedState) -> Array:
    """Largest magnitude that the friction law allows the tension ratio over a contact."""
    pairs = [(s.bound[..., 0], s.bound[..., 1]) for s in state.at.spans]
    return along_contacts(state.chain, *paired(state.chain, pairs))


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
    return error_of_modes(state.chain, state.solved.point.unknowns, state.at)


@Quantity("solve", kind=bool)
def bend_possible(state: SolvedState) -> Array:
    """Whether every flexure is bent as it can be, and as its pose can be computed.

    By less than half a turn, with no fibre shortened to nothing, and not so far about several axes
    that the order of its turns is not known well.
    """
    chain, modes = state.chain, state.solved.point.unknowns.modes
    below_half_turn = jnp.sum(state.at.flexure.bend**2, axis=-1) < np.pi**2
    accurate = jax.vmap(rotation_error_estimate)(chain.rods, modes) < _MAX_ROTATION_ERROR
    return jnp.all(below_half_turn & accurate) & jnp.all(state.fibre_strain < 1.0)


@Quantity("state", "stored energy", "U", "N mm", key="stored_energy_Nmm",
          column="stored_energy_Nmm")  # fmt: skip
def stored_energy(state: SolvedState) -> Array:
    """Elastic energy held by flexures, lips that press and stretched tendons."""
    chain, base_tension = state.chain, state.solved.point.base_tension
    density, _ = state.stored_energy_density
    in_gap, in_body = state.tensions
    in_tendons = in_gap**2 * state.by_tendon("natural_gap")
    in_tendons = in_tendons + in_body**2 * state.by_tendon("body_length")
    in_contacts = jnp.zeros(())
    if chain.contact_flexibility is not None:
        squares = [jnp.sum(one**2, axis=-1) for one in state.solved.point.unknowns.contact_force]
        in_contacts = 0.5 * jnp.sum(chain.contact_flexibility[None] * jnp.stack(squares))
    return (
        in_contacts
        + jnp.sum(chain.rods.length * density)
        + 0.5 * jnp.sum(in_tendons * state.by_tendon("visits") * state.compliance)
        + 0.5 * jnp.sum(base_tension**2 * chain.free_length / chain.axial_stiffness)
    )


@Quantity("state", per=("notch", "row", "node"))
def flattening(state: SolvedState) -> Array:
    """Flattening at every node: its path X, transformed moment times length, and H times length.

    Zero for materials without hysteresis; see `mechanics/material/flattening.py`.
    """
    chain, memory = state.chain, state.solved.memory.material
    length = chain.rods.length
    if isinstance(memory, tuple) or chain.rods.section.ends is None:
        return jnp.zeros((len(length), 3, 1))
    _, at = state.stored_energy_density
    return jnp.stack([at.path, length * at.transformed, length * at.by_transformation], axis=1)
