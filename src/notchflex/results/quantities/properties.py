"""Typed properties for every quantity of a path and of an equilibrium.

Written by `docs/make/quantity_properties.py` from `results/quantities/registry.py`: change it there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int


class PathQuantities:
    """Quantities of every step: s steps, n notches, t tendons, n + 1 bodies."""

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name."""
        raise NotImplementedError

    @property
    def commanded_tension(self) -> Float[np.ndarray, "s t"]:
        """Commanded tension, N, shape (s, t).

        Tension commanded at the base of a tendon; empty (NaN) where it is not commanded.
        """
        return self.quantity("commanded_tension")

    @property
    def commanded_stroke(self) -> Float[np.ndarray, "s t"]:
        """Commanded stroke, mm, shape (s, t).

        Tendon length commanded to be drawn out at the base; empty (NaN) where not commanded.
        """
        return self.quantity("commanded_stroke")

    @property
    def tension(self) -> Float[np.ndarray, "s t"]:
        """Tendon tension, N, shape (s, t).

        Tension of a tendon at the base, as it is in the solved state.
        """
        return self.quantity("tension")

    @property
    def stroke(self) -> Float[np.ndarray, "s t"]:
        """Tendon stroke, mm, shape (s, t).

        Tendon length drawn out at the base since the state without load.
        """
        return self.quantity("stroke")

    @property
    def notch_angle(self) -> Float[np.ndarray, "s n"]:
        """Notch angle, rad, shape (s, n).

        Rotation of the body beyond a notch against the body before it, with precurvature, base to
        tip.
        """
        return self.quantity("notch_angle")

    @property
    def chord_angle(self) -> Float[np.ndarray, "s n"]:
        """Chord angle, rad, shape (s, n).

        Angle by which the chord of a strip has turned in its plane of bending: the bending angle of
        Liu 2022, about two thirds of the notch angle.
        """
        return self.quantity("chord_angle")

    @property
    def total_chord_angle(self) -> Float[np.ndarray, " s"]:
        """Total chord angle, rad, shape (s,).

        Sum of the chord angles, where every flexure has one.
        """
        return self.quantity("total_chord_angle")

    @property
    def total_angle(self) -> Float[np.ndarray, " s"]:
        """Total bending angle, rad, shape (s,).

        Bending angle of the robot: where all notches bend in one plane the sum of their angles,
        positive toward the bend of the first; otherwise the angle between the axes of base and tip.
        """
        return self.quantity("total_angle")

    @property
    def tip_position(self) -> Float[np.ndarray, "s 3"]:
        """Tip position, mm, shape (s, 3).

        Position of the tip (the end of the last uncut section) in the world.
        """
        return self.quantity("tip_position")

    @property
    def tip_rotation(self) -> Float[np.ndarray, "s 3 3"]:
        """Tip rotation, shape (s, 3, 3).

        Rotation matrix of the tip in the world.
        """
        return self.quantity("tip_rotation")

    @property
    def body_position(self) -> Float[np.ndarray, "s bodies 3"]:
        """Body position, mm, shape (s, bodies, 3).

        Origin of every rigid body, on the tube axis at its proximal face, base first, in the world.
        """
        return self.quantity("body_position")

    @property
    def body_rotation(self) -> Float[np.ndarray, "s bodies 3 3"]:
        """Body rotation, shape (s, bodies, 3, 3).

        Rotation matrix of every rigid body, base first, in the world.
        """
        return self.quantity("body_rotation")

    @property
    def span_tension(self) -> Float[np.ndarray, "s t spans"]:
        """Span tension, N, shape (s, t, spans).

        Tension along a tendon: proximal, gap 1, body 1, gap 2, ... to its last gap, of the gaps and
        bodies that it runs through. NaN beyond the end of a tendon.
        """
        return self.quantity("span_tension")

    @property
    def notch_moment(self) -> Float[np.ndarray, "s n"]:
        """Notch moment, N mm, shape (s, n).

        Bending moment carried by what the cut of a notch leaves, the largest along it.
        """
        return self.quantity("notch_moment")

    @property
    def outer_strain(self) -> Float[np.ndarray, "s n"]:
        """Outer strain, shape (s, n).

        Bending strain of the outer fibre of the spine (Pacheco 2021, eq. 16).
        """
        return self.quantity("outer_strain")

    @property
    def peak_strain(self) -> Float[np.ndarray, "s n"]:
        """Peak strain, shape (s, n).

        Largest bending strain of a notch, in the fibre farthest from its neutral axis.
        """
        return self.quantity("peak_strain")

    @property
    def gap(self) -> Float[np.ndarray, "s n"]:
        """Notch gap, mm, shape (s, n).

        What is left of the opening of a notch between its lips, where it is narrowest.
        """
        return self.quantity("gap")

    @property
    def closed(self) -> Bool[np.ndarray, "s n"]:
        """Closed, shape (s, n).

        True where the lips of a notch touch.
        """
        return self.quantity("closed")

    @property
    def contact_force(self) -> Float[np.ndarray, "s n"]:
        """Contact force, N, shape (s, n).

        Force between the touching lips of a closed notch.
        """
        return self.quantity("contact_force")

    @property
    def contact_log_ratio(self) -> Float[np.ndarray, "s t contacts"]:
        """Tension ratio over a contact, shape (s, t, contacts).

        ln(tension on the base side / tension on the tip side) of a friction contact. NaN beyond the
        end of a tendon.
        """
        return self.quantity("contact_log_ratio")

    @property
    def contact_slid(self) -> Float[np.ndarray, "s t contacts"]:
        """Slid length, mm, shape (s, t, contacts).

        Tendon length that has slid over a friction contact toward the base. NaN beyond the end of a
        tendon.
        """
        return self.quantity("contact_slid")

    @property
    def contact_turning(self) -> Float[np.ndarray, "s t contacts"]:
        """Turning at a contact, rad, shape (s, t, contacts).

        Angle by which a tendon turns at a friction contact. NaN beyond the end of a tendon.
        """
        return self.quantity("contact_turning")

    @property
    def contact_state(self) -> Int[np.ndarray, "s t contacts"]:
        """State of a contact, shape (s, t, contacts).

        What a friction contact does: "stick", "slip toward base" or "slip toward tip". 0 sticks, +1
        slips toward the base, -1 slips toward the tip.
        """
        return self.quantity("contact_state")

    @property
    def contact_bound(self) -> Float[np.ndarray, "s t contacts"]:
        """Largest tension ratio over a contact, shape (s, t, contacts).

        Largest magnitude that the friction law allows the tension ratio over a contact. NaN beyond
        the end of a tendon.
        """
        return self.quantity("contact_bound")

    @property
    def dissipation(self) -> Float[np.ndarray, "s t contacts"]:
        """Dissipation, N mm, shape (s, t, contacts).

        Work that a friction contact has turned to heat since the start of the path. Integrated by
        the trapezoid rule from step to step, as is the tendon work, so the two balance with the
        stored energy as the steps get small. A few coarse steps across a reversal give a rough
        value, which may even decrease. NaN beyond the end of a tendon.
        """
        return self.quantity("dissipation")

    @property
    def front_contact(self) -> Int[np.ndarray, "s t"]:
        """Friction front, shape (s, t).

        Contact, from 1 at the base, up to which the friction of a tendon has turned from loading to
        unloading (Gao 2017, eq. 26); one more than there are where all have.
        """
        return self.quantity("front_contact")

    @property
    def front_eta(self) -> Float[np.ndarray, "s t"]:
        """Friction at the front, shape (s, t).

        Friction of that contact over its largest, from 1 (loading) to -1 (unloading).
        """
        return self.quantity("front_eta")

    @property
    def base_force(self) -> Float[np.ndarray, "s 3"]:
        """Base force, N, shape (s, 3).

        Force of the holder on the base, in the world; it balances the loads and the pull of the
        drives on the tendons.
        """
        return self.quantity("base_force")

    @property
    def base_moment(self) -> Float[np.ndarray, "s 3"]:
        """Base moment, N mm, shape (s, 3).

        Moment of the holder on the base about its proximal end, in the world.
        """
        return self.quantity("base_moment")

    @property
    def moment_error(self) -> Float[np.ndarray, " s"]:
        """Moment error, shape (s,).

        Largest difference between the moment of the strain modes and that which the loads ask for,
        over the largest moment: how well the modes serve.
        """
        return self.quantity("moment_error")

    @property
    def stored_energy(self) -> Float[np.ndarray, " s"]:
        """Stored energy, N mm, shape (s,).

        Elastic energy held by flexures and stretched tendons.
        """
        return self.quantity("stored_energy")

    @property
    def tendon_work(self) -> Float[np.ndarray, "s t"]:
        """Tendon work, N mm, shape (s, t).

        Work done on a tendon at the base since the start of the path.
        """
        return self.quantity("tendon_work")

    @property
    def converged(self) -> Bool[np.ndarray, " s"]:
        """Converged, shape (s,).

        True where the equilibrium was found. A solved state beyond the limits of the friction law
        or of the strain modes counts as not converged.
        """
        return self.quantity("converged")

    @property
    def reason(self) -> list[str]:
        """Reason, shape (s,).

        Why the equilibrium was not found; empty where it was.
        """
        return self.quantity("reason")

    @property
    def stable(self) -> Bool[np.ndarray, " s"]:
        """Stable, shape (s,).

        True where the equilibrium is stable with its sticking contacts held.
        """
        return self.quantity("stable")

    @property
    def smallest_eigenvalue(self) -> Float[np.ndarray, " s"]:
        """Smallest eigenvalue, N mm, shape (s,).

        Smallest real part of an eigenvalue of the stiffness, sticking contacts held.
        """
        return self.quantity("smallest_eigenvalue")

    @property
    def determinant_sign(self) -> Float[np.ndarray, " s"]:
        """Sign of the determinant, shape (s,).

        Sign of the determinant of that stiffness; +1 at every stable state.
        """
        return self.quantity("determinant_sign")

    @property
    def residual(self) -> Float[np.ndarray, " s"]:
        """Residual, shape (s,).

        Largest scaled residual of the equations at the end of the iteration.
        """
        return self.quantity("residual")

    @property
    def iterations(self) -> Int[np.ndarray, " s"]:
        """Iterations, shape (s,).

        Number of Newton iterations.
        """
        return self.quantity("iterations")


class EquilibriumQuantities:
    """Quantities of one equilibrium: n notches, t tendons, n + 1 bodies."""

    def quantity(self, name: str) -> Any:
        """Return a quantity by its name."""
        raise NotImplementedError

    @property
    def commanded_tension(self) -> Float[np.ndarray, " t"]:
        """Commanded tension, N, shape (t,).

        Tension commanded at the base of a tendon; empty (NaN) where it is not commanded.
        """
        return self.quantity("commanded_tension")

    @property
    def commanded_stroke(self) -> Float[np.ndarray, " t"]:
        """Commanded stroke, mm, shape (t,).

        Tendon length commanded to be drawn out at the base; empty (NaN) where not commanded.
        """
        return self.quantity("commanded_stroke")

    @property
    def tension(self) -> Float[np.ndarray, " t"]:
        """Tendon tension, N, shape (t,).

        Tension of a tendon at the base, as it is in the solved state.
        """
        return self.quantity("tension")

    @property
    def stroke(self) -> Float[np.ndarray, " t"]:
        """Tendon stroke, mm, shape (t,).

        Tendon length drawn out at the base since the state without load.
        """
        return self.quantity("stroke")

    @property
    def notch_angle(self) -> Float[np.ndarray, " n"]:
        """Notch angle, rad, shape (n,).

        Rotation of the body beyond a notch against the body before it, with precurvature, base to
        tip.
        """
        return self.quantity("notch_angle")

    @property
    def chord_angle(self) -> Float[np.ndarray, " n"]:
        """Chord angle, rad, shape (n,).

        Angle by which the chord of a strip has turned in its plane of bending: the bending angle of
        Liu 2022, about two thirds of the notch angle.
        """
        return self.quantity("chord_angle")

    @property
    def total_chord_angle(self) -> float:
        """Total chord angle, rad.

        Sum of the chord angles, where every flexure has one.
        """
        return self.quantity("total_chord_angle")

    @property
    def total_angle(self) -> float:
        """Total bending angle, rad.

        Bending angle of the robot: where all notches bend in one plane the sum of their angles,
        positive toward the bend of the first; otherwise the angle between the axes of base and tip.
        """
        return self.quantity("total_angle")

    @property
    def tip_position(self) -> Float[np.ndarray, " 3"]:
        """Tip position, mm, shape (3,).

        Position of the tip (the end of the last uncut section) in the world.
        """
        return self.quantity("tip_position")

    @property
    def tip_rotation(self) -> Float[np.ndarray, "3 3"]:
        """Tip rotation, shape (3, 3).

        Rotation matrix of the tip in the world.
        """
        return self.quantity("tip_rotation")

    @property
    def body_position(self) -> Float[np.ndarray, "bodies 3"]:
        """Body position, mm, shape (bodies, 3).

        Origin of every rigid body, on the tube axis at its proximal face, base first, in the world.
        """
        return self.quantity("body_position")

    @property
    def body_rotation(self) -> Float[np.ndarray, "bodies 3 3"]:
        """Body rotation, shape (bodies, 3, 3).

        Rotation matrix of every rigid body, base first, in the world.
        """
        return self.quantity("body_rotation")

    @property
    def span_tension(self) -> Float[np.ndarray, "t spans"]:
        """Span tension, N, shape (t, spans).

        Tension along a tendon: proximal, gap 1, body 1, gap 2, ... to its last gap, of the gaps and
        bodies that it runs through. NaN beyond the end of a tendon.
        """
        return self.quantity("span_tension")

    @property
    def notch_moment(self) -> Float[np.ndarray, " n"]:
        """Notch moment, N mm, shape (n,).

        Bending moment carried by what the cut of a notch leaves, the largest along it.
        """
        return self.quantity("notch_moment")

    @property
    def outer_strain(self) -> Float[np.ndarray, " n"]:
        """Outer strain, shape (n,).

        Bending strain of the outer fibre of the spine (Pacheco 2021, eq. 16).
        """
        return self.quantity("outer_strain")

    @property
    def peak_strain(self) -> Float[np.ndarray, " n"]:
        """Peak strain, shape (n,).

        Largest bending strain of a notch, in the fibre farthest from its neutral axis.
        """
        return self.quantity("peak_strain")

    @property
    def gap(self) -> Float[np.ndarray, " n"]:
        """Notch gap, mm, shape (n,).

        What is left of the opening of a notch between its lips, where it is narrowest.
        """
        return self.quantity("gap")

    @property
    def closed(self) -> Bool[np.ndarray, " n"]:
        """Closed, shape (n,).

        True where the lips of a notch touch.
        """
        return self.quantity("closed")

    @property
    def contact_force(self) -> Float[np.ndarray, " n"]:
        """Contact force, N, shape (n,).

        Force between the touching lips of a closed notch.
        """
        return self.quantity("contact_force")

    @property
    def contact_log_ratio(self) -> Float[np.ndarray, "t contacts"]:
        """Tension ratio over a contact, shape (t, contacts).

        ln(tension on the base side / tension on the tip side) of a friction contact. NaN beyond the
        end of a tendon.
        """
        return self.quantity("contact_log_ratio")

    @property
    def contact_slid(self) -> Float[np.ndarray, "t contacts"]:
        """Slid length, mm, shape (t, contacts).

        Tendon length that has slid over a friction contact toward the base. NaN beyond the end of a
        tendon.
        """
        return self.quantity("contact_slid")

    @property
    def contact_turning(self) -> Float[np.ndarray, "t contacts"]:
        """Turning at a contact, rad, shape (t, contacts).

        Angle by which a tendon turns at a friction contact. NaN beyond the end of a tendon.
        """
        return self.quantity("contact_turning")

    @property
    def contact_state(self) -> Int[np.ndarray, "t contacts"]:
        """State of a contact, shape (t, contacts).

        What a friction contact does: "stick", "slip toward base" or "slip toward tip". 0 sticks, +1
        slips toward the base, -1 slips toward the tip.
        """
        return self.quantity("contact_state")

    @property
    def contact_bound(self) -> Float[np.ndarray, "t contacts"]:
        """Largest tension ratio over a contact, shape (t, contacts).

        Largest magnitude that the friction law allows the tension ratio over a contact. NaN beyond
        the end of a tendon.
        """
        return self.quantity("contact_bound")

    @property
    def dissipation(self) -> Float[np.ndarray, "t contacts"]:
        """Dissipation, N mm, shape (t, contacts).

        Work that a friction contact has turned to heat since the start of the path. Integrated by
        the trapezoid rule from step to step, as is the tendon work, so the two balance with the
        stored energy as the steps get small. A few coarse steps across a reversal give a rough
        value, which may even decrease. NaN beyond the end of a tendon.
        """
        return self.quantity("dissipation")

    @property
    def front_contact(self) -> Int[np.ndarray, " t"]:
        """Friction front, shape (t,).

        Contact, from 1 at the base, up to which the friction of a tendon has turned from loading to
        unloading (Gao 2017, eq. 26); one more than there are where all have.
        """
        return self.quantity("front_contact")

    @property
    def front_eta(self) -> Float[np.ndarray, " t"]:
        """Friction at the front, shape (t,).

        Friction of that contact over its largest, from 1 (loading) to -1 (unloading).
        """
        return self.quantity("front_eta")

    @property
    def base_force(self) -> Float[np.ndarray, " 3"]:
        """Base force, N, shape (3,).

        Force of the holder on the base, in the world; it balances the loads and the pull of the
        drives on the tendons.
        """
        return self.quantity("base_force")

    @property
    def base_moment(self) -> Float[np.ndarray, " 3"]:
        """Base moment, N mm, shape (3,).

        Moment of the holder on the base about its proximal end, in the world.
        """
        return self.quantity("base_moment")

    @property
    def moment_error(self) -> float:
        """Moment error.

        Largest difference between the moment of the strain modes and that which the loads ask for,
        over the largest moment: how well the modes serve.
        """
        return self.quantity("moment_error")

    @property
    def stored_energy(self) -> float:
        """Stored energy, N mm.

        Elastic energy held by flexures and stretched tendons.
        """
        return self.quantity("stored_energy")

    @property
    def tendon_work(self) -> Float[np.ndarray, " t"]:
        """Tendon work, N mm, shape (t,).

        Work done on a tendon at the base since the start of the path.
        """
        return self.quantity("tendon_work")

    @property
    def converged(self) -> bool:
        """Converged.

        True where the equilibrium was found. A solved state beyond the limits of the friction law
        or of the strain modes counts as not converged.
        """
        return self.quantity("converged")

    @property
    def reason(self) -> str:
        """Reason.

        Why the equilibrium was not found; empty where it was.
        """
        return self.quantity("reason")

    @property
    def stable(self) -> bool:
        """Stable.

        True where the equilibrium is stable with its sticking contacts held.
        """
        return self.quantity("stable")

    @property
    def smallest_eigenvalue(self) -> float:
        """Smallest eigenvalue, N mm.

        Smallest real part of an eigenvalue of the stiffness, sticking contacts held.
        """
        return self.quantity("smallest_eigenvalue")

    @property
    def determinant_sign(self) -> float:
        """Sign of the determinant.

        Sign of the determinant of that stiffness; +1 at every stable state.
        """
        return self.quantity("determinant_sign")

    @property
    def residual(self) -> float:
        """Residual.

        Largest scaled residual of the equations at the end of the iteration.
        """
        return self.quantity("residual")

    @property
    def iterations(self) -> int:
        """Iterations.

        Number of Newton iterations.
        """
        return self.quantity("iterations")


__all__ = ["EquilibriumQuantities", "PathQuantities"]
