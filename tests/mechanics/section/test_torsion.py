"""Torsion constant and shear centre against `sectionproperties`, and their limits."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics.cuts import annular_sector, annular_segment
from oracles.section_analysis import torsions

SECTIONS = {"on-axis": annular_sector, "off-axis": annular_segment}
WITHIN = 0.02

# r_i / r_o and depth over the outer diameter: both cuts, every shape of segment, real tubes.
FEW = [
    (0.5, 0.05),
    (0.5, 0.15),
    (0.5, 0.27),
    (0.5, 0.6),
    (0.5, 0.9),
    (0.7, 0.13),
    (0.7, 0.5),
    (0.7, 0.83),
    (0.8642, 0.03),
    (0.8642, 0.8),
    (0.8642, 0.8642),
    (0.8642, 0.95),
    (0.95, 0.97),
]
MANY = [
    (ratio, depth)
    for ratio in (0.3, 0.6, 0.75, 0.85, 0.95)
    for depth in (0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.85, 0.9, 0.94)
]


def compare(cut, cases, margin):
    # Not where less than 2 % of the wall is left under the flat: see the docstring.
    left = [1 - 2 * fraction / (1 - ratio) for ratio, fraction in cases]
    if cut == "off-axis":
        cases = [case for case, rest in zip(cases, left, strict=True) if not -1e-6 <= rest < 0.02]
    wanted = torsions([(cut, ratio, 2 * fraction) for ratio, fraction in cases])
    errors = []
    for (ratio, fraction), (constant, centre) in zip(cases, wanted, strict=True):
        found = SECTIONS[cut](1.0, ratio, 2 * fraction)
        # A barely cut closed tube has its shear centre nearly on the axis; the mesh tells 1e-4.
        at = (float(found.shear_centre) - centre) / max(abs(centre), 1e-4 / WITHIN)
        errors.append((float(found.torsion_constant) / constant - 1, at))
    for name, error in zip(("torsion constant", "shear centre"), np.transpose(errors), strict=True):
        where = cases[int(np.argmax(np.abs(error)))]
        margin.within(f"{cut} {name}, relative, worst at {where}", error, WITHIN)


@pytest.mark.parametrize("cut", ["on-axis"])
def test_sectionproperties(cut, margin):
    compare(cut, FEW, margin)


@pytest.mark.nightly
@pytest.mark.parametrize("cut", SECTIONS)
def test_sectionproperties_everywhere(cut, margin):
    compare(cut, MANY, margin)


def test_thin_sector():
    # Thin wall with corrected ends: physics of the open arc (Young, Roark's Formulas).
    inner, depth = 0.98, 1.2
    a = np.arccos(depth - 1)
    mean, wall = 0.99, 0.02
    found = annular_sector(1.0, inner, depth)
    strip = 2 * a * mean * wall**3 / 3 - 0.21 * wall**4
    np.testing.assert_allclose(found.torsion_constant, strip, rtol=1e-4)
    centre = 2 * mean * (np.sin(a) - a * np.cos(a)) / (a - np.sin(a) * np.cos(a))
    np.testing.assert_allclose(found.shear_centre, centre, rtol=2e-4)


@pytest.mark.parametrize("ratio", [0.25, 0.5, 0.864, 0.97])
def test_open_and_solid_segments_join(ratio):
    # The bore leaves the section there, and nothing jumps.
    below, above = (annular_segment(1.0, ratio, (1 + ratio) * (1 + s)) for s in (-1e-9, 1e-9))
    np.testing.assert_allclose(below.torsion_constant, above.torsion_constant, rtol=5e-3)
    np.testing.assert_allclose(below.shear_centre, above.shear_centre, rtol=5e-3)
