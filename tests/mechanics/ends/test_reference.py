"""Sides of notches against reference numbers; their series and quadrature against finer ones."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics import ends as flattening
from notchflex.mechanics import ring
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.ends import notch_stiffness
from notchflex.mechanics.ring import Side, arc_harmonics, arc_of, end_compliance
from reference_data import named_rows

BOUNDARIES = {"sym": "between", "clamp": "clamped", "free": "free"}
ROWS = named_rows("notch_law.csv")
UPPER_BOUND = np.ones(ring.HARMONICS)


def parts(row):
    """Tube, section and arc of a row, and the boundary in our words."""
    outer, inner = row["OD"] / 2, row["ID"] / 2
    section = SECTION_OF_CUT[row["cut"]](outer, inner, row["depth"])
    return outer, inner, section, arc_of(outer, inner, section), BOUNDARIES[row["boundary"]]


def test_every_row(margin):
    errors = {}
    for row in ROWS:
        outer, inner, section, arc, boundary = parts(row)
        gap = row["shell_length"] * (2.0 if boundary == "between" else 1.0)
        side = (outer, inner, arc, Side(boundary, gap), row["nu"])
        relaxed, bound = end_compliance(*side), end_compliance(*side, UPPER_BOUND)
        low = end_compliance(*side, np.where(np.arange(ring.HARMONICS) < 2, 1.0, 0.0))
        outer_angle, phi, brazier = flattening.flattening_numbers(
            outer, inner, row["cut"], row["depth"], row["nu"], section
        )
        found = {
            "a": arc.half_angle,
            "d_01": low.weak,
            "d_2": bound.weak - low.weak,
            "side_weak": relaxed.weak,
            "side_strong_at_lambda_1": bound.strong,
            "coupling_at_lambda_1": bound.coupling,
            "axial_at_lambda_1": bound.axial,
            "a_o": outer_angle,
            "phi": phi,
            # φ and B are over I, in that file by quadrature (1e-5 for segments).
            "B / phi": brazier / phi,
            "k": flattening.edge_and_brazier(arc.radius, (Side("between", gap),) * 2)[0],
        }
        for name, value in found.items():
            wanted = row["B"] / row["phi"] if name == "B / phi" else row[name]
            errors.setdefault(name, []).append(value / wanted - 1.0)
    for name, error in errors.items():
        margin.within(f"{name}, relative", error, 1e-5)


def test_sides_add_up():
    row = ROWS[0]
    weak = [
        notch_stiffness(0.81, 0.7, "on-axis", 1.4, 0.8, 0.33, near, far).weak
        for near, far in (
            (Side("clamped", 1.2), Side("between", 1.2)),
            (Side("between", 1.2), Side("clamped", 1.2)),
        )
    ]
    assert weak[0] == pytest.approx(0.8 + row["side_weak"] + ROWS[1]["side_weak"], rel=1e-6)
    assert weak[0] == pytest.approx(weak[1], rel=1e-14)


@pytest.mark.parametrize("row", ROWS[::7], ids=lambda row: row["boundary"])
def test_loads_by_quadrature(row, margin):
    # The stress of the arc, integrated through the wall and around by Gauss rules.
    arc = parts(row)[3]
    r, t, a = arc.radius, arc.wall, arc.half_angle
    node, weight = np.polynomial.legendre.leggauss(80)
    phi, around = a * node, a * weight
    zeta, through = 0.5 * t * node[:, None], 0.5 * t * weight[:, None]
    sector = arc.section
    n = np.arange(ring.HARMONICS)[:, None]
    waves = np.cos(n * phi), np.sin(n * phi), np.cos(n * phi)
    stresses = (
        ((r + zeta) * np.cos(phi) - sector.centroid) / sector.second_moment_weak,
        (r + zeta) * np.sin(phi) / sector.second_moment_strong,
        np.ones_like(zeta * phi) / sector.area,
    )
    for found, stress, wave in zip(arc_harmonics(arc), stresses, waves, strict=True):
        force = np.sum(through * (1 + zeta / r) * stress, axis=0)
        moment = np.sum(through * zeta * (1 + zeta / r) * stress, axis=0)
        norm = np.pi * np.where(n[:, 0] == 0, 2.0, 1.0)
        wanted = np.stack([wave @ (around * force), -wave @ (around * moment)], axis=-1)
        wanted /= norm[:, None]
        margin.within("harmonics, of the largest", (found - wanted) / np.abs(wanted).max(), 1e-12)


def test_quadrature_of_the_flattening(margin):
    # Twice the points: the numbers are converged to rounding.
    node, weight = np.polynomial.legendre.leggauss(48)
    section = SECTION_OF_CUT["on-axis"](0.81, 0.7, 1.0)
    _, phi, brazier = flattening.flattening_numbers(0.81, 0.7, "on-axis", 1.0, 0.33, section)
    a = np.arccos((1.0 - 0.81) / 0.81)
    angle, s = 0.5 * a * (1 + node), np.sin(a) / a
    m = 0.5 * (np.sin(a) ** 2 + np.sin(angle) ** 2) + s * (np.cos(a) - np.cos(angle))
    m = m - s * angle * np.sin(angle)
    r, t, weak = 0.755, 0.11, section.second_moment_weak
    wanted = 2 * t * r**3 * abs(0.5 * a * m @ weight) / weak
    margin.within("φ, relative", phi / wanted - 1, 1e-12)
    wanted = 48 * (1 - 0.33**2) * r**7 * 0.5 * a * (m**2 @ weight) / (t * weak)
    margin.within("B, relative", brazier / wanted - 1, 1e-12)


def test_ring_in_other_directions(margin):
    # n = 0: a long ring under an edge moment and uniform tension, beam on elastic foundation.
    r, t, nu = 0.755, 0.11, 0.33
    found = ring.edge_compliance(r, t, Side("clamped", 3.0), nu)[0]
    stiffness = t**3 / 12 / (1 - nu**2)
    rate = (t / r**2 / (4 * stiffness)) ** 0.25
    margin.within("slope under a moment, relative", found[1, 1] * rate * stiffness - 1, 5e-9)
