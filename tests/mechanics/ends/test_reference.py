"""Sides of notches against reference numbers; their series and quadrature against finer ones."""

from __future__ import annotations

import numpy as np

from notchflex.mechanics import ends as flattening
from notchflex.mechanics import ring
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.ring import Side, arc_of, end_compliance
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
