"""Sides of notches against reference numbers; their series and quadrature against finer ones."""

from __future__ import annotations

import numpy as np

from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.flattening import distortion
from notchflex.mechanics.ring import Side, arc_of, end_compliance
from reference_data import named_rows

BOUNDARIES = {"sym": "between", "clamp": "clamped", "free": "free"}
ROWS = named_rows("notch_law.csv")


def parts(row):
    """Tube and arc of a row, and the boundary in our words."""
    outer, inner = row["OD"] / 2, row["ID"] / 2
    section = SECTION_OF_CUT[row["cut"]](outer, inner, row["depth"])
    return outer, inner, arc_of(outer, inner, section), BOUNDARIES[row["boundary"]]


def test_every_row(margin):
    errors = {}
    for row in ROWS:
        outer, inner, arc, boundary = parts(row)
        gap = row["shell_length"] * (2.0 if boundary == "between" else 1.0)
        distorted = distortion(arc, row["nu"])
        low, relaxed, bound = (
            end_compliance(arc, Side(boundary, gap), row["nu"], distorted.loads, factor)
            for factor in (0.0, 0.833, 1.0)
        )
        # The file leaves out the bending and the stretch of the ring as a beam.
        sector = arc.section
        bends = row["shell_length"] / (np.pi / 4 * (outer**4 - inner**4))
        stretches = row["shell_length"] / (np.pi * (outer**2 - inner**2))
        offset, weak = sector.centroid, sector.second_moment_weak
        found = {
            "a": arc.half_angle,
            "d_01": low.weak - weak * bends,
            "d_2": bound.weak - low.weak,
            "side_weak": relaxed.weak - weak * bends,
            "side_strong_at_lambda_1": bound.strong - sector.second_moment_strong * bends,
            "coupling_at_lambda_1": bound.coupling - weak * bends * offset,
            "axial_at_lambda_1": bound.axial - sector.area * (stretches + bends * offset**2),
        }
        for name, value in found.items():
            errors.setdefault(name, []).append(value / row[name] - 1.0)
        if row["cut"] == "on-axis":  # the file takes another half angle for the other cut
            phi = 2.0 * arc.wall * arc.radius**3 * abs(distorted.first)
            brazier = 48.0 * (1.0 - row["nu"] ** 2) * arc.radius**7 * distorted.second / arc.wall
            wanted = row["B"] / row["phi"]
            errors.setdefault("B / phi", []).append(brazier / phi / wanted - 1.0)
    for name, error in errors.items():
        margin.within(f"{name}, relative", error, 1e-5)
