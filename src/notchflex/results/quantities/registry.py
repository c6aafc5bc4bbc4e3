"""The one table of quantities: names, symbols, units and texts of everything a result holds.

JSON keys, CSV headers, the axes of pictures, the tables on the terminal and the documentation
are all made from `QUANTITIES`, and so are the typed properties of a path and of an equilibrium
(`results/quantities/properties.py`, written by `docs/make/quantity_properties.py`). A new quantity
is one new row here.

Inside Python: mm, N, MPa, rad. At the edges (files, pictures, terminal): mm, N, MPa, deg.
`Quantity.scale` takes a number from the inside to the edge.
"""

from __future__ import annotations

import math

from notchflex.results.quantities.quantity import Quantity

DEGREES = 180.0 / math.pi
AXES = ("x", "y", "z")


def _rows() -> tuple[Quantity, ...]:
    q = Quantity
    return (
        q(
            "commanded_tension", "commanded tension", "T", "N",
            "Tension commanded at the base of a tendon; empty (NaN) where it is not commanded.",
            "load.tension_N", "", ("tendon",),
        ),
        q(
            "commanded_stroke", "commanded stroke", "u", "mm",
            "Tendon length commanded to be drawn out at the base; empty (NaN) where not commanded.",
            "load.stroke_mm", "", ("tendon",),
        ),
        q(
            "tension", "tendon tension", "T", "N",
            "Tension of a tendon at the base, as it is in the solved state.",
            "tendon_tension_N", "tendon{tendon}_force_N", ("tendon",),
        ),
        q(
            "stroke", "tendon stroke", "u", "mm",
            "Tendon length drawn out at the base since the state without load.",
            "tendon_stroke_mm", "tendon{tendon}_displacement_mm", ("tendon",),
        ),
        q(
            "notch_angle", "notch angle", r"\theta_j", "deg",
            "Rotation of the body beyond a notch against the body before it, with precurvature, "
            "base to tip.",
            "notch_angle_deg", "notch_{notch}_deg", ("notch",), DEGREES,
        ),
        q(
            "chord_angle", "chord angle", r"\psi_j", "deg",
            "Angle by which the chord of a strip has turned in its plane of bending: the bending "
            "angle of Liu 2022, about two thirds of the notch angle.",
            "chord_angle_deg", "notch_{notch}_chord_deg", ("notch",), DEGREES, optional=True,
        ),
        q(
            "total_chord_angle", "total chord angle", r"\psi", "deg",
            "Sum of the chord angles, where every flexure has one.",
            "total_chord_angle_deg", "total_chord_deg", (), DEGREES, optional=True,
        ),
        q(
            "total_angle", "total bending angle", r"\theta", "deg",
            "Bending angle of the robot: where all notches bend in one plane the sum of their "
            "angles, positive toward the bend of the first; otherwise the angle between the axes "
            "of base and tip.",
            "total_angle_deg", "total_deg", (), DEGREES,
        ),
        q(
            "tip_position", "tip position", "p", "mm",
            "Position of the tip (the end of the last uncut section) in the world.",
            "tip_position_mm", "tip_{axis}_mm", ("axis",),
        ),
        q(
            "tip_rotation", "tip rotation", "R", "",
            "Rotation matrix of the tip in the world.",
            "tip_rotation", "", ("row", "axis"),
        ),
        q(
            "body_position", "body position", "p_b", "mm",
            "Origin of every rigid body, on the tube axis at its proximal face, base first, in the "
            "world.",
            "", "", ("body", "axis"),
        ),
        q(
            "body_rotation", "body rotation", "R_b", "",
            "Rotation matrix of every rigid body, base first, in the world.",
            "", "", ("body", "row", "axis"),
        ),
        q(
            "span_tension", "span tension", "T", "N",
            "Tension along a tendon: proximal, gap 1, body 1, gap 2, ... to its last gap, of the "
            "gaps and bodies that it runs through.",
            "span_tension_N", "tendon{tendon}_{span}_N", ("tendon", "span"),
        ),
        q(
            "notch_moment", "notch moment", "M_j", "N mm",
            "Bending moment carried by what the cut of a notch leaves, the largest along it.",
            "notch_moment_Nmm", "notch_{notch}_moment_Nmm", ("notch",),
        ),
        q(
            "outer_strain", "outer strain", r"\varepsilon_j", "",
            "Bending strain of the outer fibre of the spine (Pacheco 2021, eq. 16).",
            "outer_strain", "notch_{notch}_outer_strain", ("notch",),
        ),
        q(
            "peak_strain", "peak strain", r"\varepsilon_\mathrm{max}", "",
            "Largest bending strain of a notch, in the fibre farthest from its neutral axis.",
            "peak_strain", "notch_{notch}_peak_strain", ("notch",),
        ),
        q(
            "gap", "notch gap", "g_j", "mm",
            "What is left of the opening of a notch between its lips, where it is narrowest.",
            "gap_mm", "notch_{notch}_gap_mm", ("notch",),
        ),
        q(
            "closed", "closed", "", "",
            "True where the lips of a notch touch.",
            "closed", "notch_{notch}_closed", ("notch",), kind=bool,
        ),
        q(
            "contact_force", "contact force", "N_j", "N",
            "Force between the touching lips of a closed notch.",
            "contact_force_N", "notch_{notch}_contact_N", ("notch",),
        ),
        q(
            "contact_log_ratio", "tension ratio over a contact", "x_i", "",
            "ln(tension on the base side / tension on the tip side) of a friction contact.",
            "contacts.log_ratio", "", ("tendon", "contact"),
        ),
        q(
            "contact_slid", "slid length", "s_i", "mm",
            "Tendon length that has slid over a friction contact toward the base.",
            "contacts.slid_mm", "", ("tendon", "contact"),
        ),
        q(
            "contact_turning", "turning at a contact", r"\beta_i", "deg",
            "Angle by which a tendon turns at a friction contact.",
            "contacts.turning_deg", "", ("tendon", "contact"), DEGREES,
        ),
        q(
            "contact_state", "state of a contact", "", "",
            'What a friction contact does: "stick", "slip toward base" or "slip toward tip".',
            "contacts.state", "", ("tendon", "contact"), kind=int,
            note="0 sticks, +1 slips toward the base, -1 slips toward the tip.",
        ),
        q(
            "contact_bound", "largest tension ratio over a contact", "b_i", "",
            "Largest magnitude that the friction law allows the tension ratio over a contact.",
            "", "", ("tendon", "contact"),
        ),
        q(
            "dissipation", "dissipation", "D_i", "N mm",
            "Work that a friction contact has turned to heat since the start of the path.",
            "", "", ("tendon", "contact"),
            note="Integrated by the trapezoid rule from step to step, as is the tendon work, so "
            "the two balance with the stored energy as the steps get small. A few coarse steps "
            "across a reversal give a rough value, which may even decrease.",
        ),
        q(
            "front_contact", "friction front", "m", "",
            "Contact, from 1 at the base, up to which the friction of a tendon has turned from "
            "loading to unloading (Gao 2017, eq. 26); one more than there are where all have.",
            "front.m", "tendon{tendon}_front_m", ("tendon",), kind=int,
        ),
        q(
            "front_eta", "friction at the front", r"\eta", "",
            "Friction of that contact over its largest, from 1 (loading) to -1 (unloading).",
            "front.eta", "tendon{tendon}_front_eta", ("tendon",),
        ),
        q(
            "base_force", "base force", "F", "N",
            "Force of the holder on the base, in the world; it balances the loads and the pull of "
            "the drives on the tendons.",
            "base_force_N", "base_force_{axis}_N", ("axis",),
        ),
        q(
            "base_moment", "base moment", "M", "N mm",
            "Moment of the holder on the base about its proximal end, in the world.",
            "base_moment_Nmm", "base_moment_{axis}_Nmm", ("axis",),
        ),
        q(
            "moment_error", "moment error", "e", "",
            "Largest difference between the moment of the strain modes and that which the loads "
            "ask for, over the largest moment: how well the modes serve.",
            "moment_error", "moment_error",
        ),
        q(
            "stored_energy", "stored energy", "U", "N mm",
            "Elastic energy held by flexures and stretched tendons.",
            "stored_energy_Nmm", "stored_energy_Nmm",
        ),
        q(
            "tendon_work", "tendon work", "W", "N mm",
            "Work done on a tendon at the base since the start of the path.",
            "tendon_work_Nmm", "tendon{tendon}_work_Nmm", ("tendon",),
        ),
        q(
            "converged", "converged", "", "",
            "True where the equilibrium was found.",
            "converged", "converged", kind=bool,
            note="A solved state beyond the limits of the friction law or of the strain modes "
            "counts as not converged.",
        ),
        q(
            "reason", "reason", "", "",
            "Why the equilibrium was not found; empty where it was.",
            "reason", "reason", kind=str,
        ),
        q(
            "stable", "stable", "", "",
            "True where the equilibrium is stable with its sticking contacts held.",
            "stable", "stable", kind=bool,
        ),
        q(
            "smallest_eigenvalue", "smallest eigenvalue", r"\lambda_\mathrm{min}", "N mm",
            "Smallest real part of an eigenvalue of the stiffness, sticking contacts held.",
            "smallest_eigenvalue_Nmm", "",
        ),
        q(
            "determinant_sign", "sign of the determinant", "", "",
            "Sign of the determinant of that stiffness; +1 at every stable state.",
            "", "",
        ),
        q(
            "residual", "residual", "r", "",
            "Largest scaled residual of the equations at the end of the iteration.",
            "residual", "residual",
        ),
        q(
            "iterations", "iterations", "", "",
            "Number of Newton iterations.",
            "iterations", "iterations", kind=int,
        ),
    )  # fmt: skip


QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _rows()}
"""Every quantity of a solved state, by the attribute that holds it."""

CONTACT_STATES = {0: "stick", 1: "slip toward base", -1: "slip toward tip"}
"""What the numbers of `contact_state` mean. Loading makes a tendon slip toward the base."""


def span_names(count: int) -> list[str]:
    """Return the names of the spans of a tendon, base to tip.

    Args:
        count: Number of spans, 2 m for a tendon that runs through m bodies to its end.

    Returns:
        `["proximal", "gap_1", "body_1", "gap_2", ...]`, `count` names.

    Example:
        >>> span_names(4)
        ['proximal', 'gap_1', 'body_1', 'gap_2']
    """
    names = ["proximal"]
    for index in range(1, count):
        names.append(f"gap_{(index + 1) // 2}" if index % 2 else f"body_{index // 2}")
    return names


def units() -> dict[str, str]:
    """Return the unit of every JSON key that has one, for the head of a document."""
    return {q.key: q.unit for q in QUANTITIES.values() if q.key and q.unit}


def describe() -> list[dict[str, str]]:
    """Return the table as plain rows (key, column, symbol, unit, description) for the docs."""
    return [
        {
            "name": q.name,
            "key": q.key,
            "column": q.column,
            "symbol": q.symbol,
            "unit": q.unit,
            "description": q.description,
        }
        for q in QUANTITIES.values()
    ]
