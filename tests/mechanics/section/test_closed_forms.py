"""Area, centroid, second moments and edges: quadrature, our reference numbers, the authors'."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.mechanics.cuts import annular_sector, annular_segment
from notchflex.mechanics.section import Section
from oracles import section_quadrature
from reference_data import reference
from shared_data import measured

SECTIONS = {"on-axis": annular_sector, "off-axis": annular_segment}
ORACLES = {"on-axis": section_quadrature.sector, "off-axis": section_quadrature.segment}
OUTER = 0.81


def depths(inner: float) -> np.ndarray:
    """From a scratch to a sliver, and around the places where the shape changes."""
    ends = 10.0 ** -np.arange(1.0, 8.5, 0.5)
    wall = OUTER - inner
    near = np.array([-1e-3, -1e-6, -1e-9, 0.0, 1e-9, 1e-6, 1e-3])
    at = [OUTER + near, wall * (1 + near), 2 * OUTER - wall * (1 + near)]
    return np.concatenate([2 * OUTER * np.r_[ends, np.linspace(0.05, 0.95, 37), 1 - ends], *at])


def as_numpy(section: Section) -> Section:
    return Section(*map(np.asarray, section))


@pytest.mark.parametrize("cut", SECTIONS)
@pytest.mark.parametrize("ratio", [0.01, 0.5, 0.86, 0.99])
def test_quadrature_for_every_depth(cut, ratio, margin):
    inner = ratio * OUTER
    depth = depths(inner)
    found = as_numpy(SECTIONS[cut](OUTER, inner, depth))
    wanted = np.array([ORACLES[cut](OUTER, inner, g) for g in depth]).T
    for name, value, number in zip(
        ("area", "centroid", "second_moment_weak", "second_moment_strong", "edge_spine"),
        (found.area, found.centroid, *found[2:4], found.edge_spine),
        wanted,
        strict=True,
    ):
        margin.within(f"{cut} {ratio} {name}, relative", value / number - 1, 1e-10)


@pytest.mark.parametrize("cut", SECTIONS)
def test_edge_near(cut):
    # The lowest point of the outline, found on the outline.
    inner = 0.7
    depth = np.linspace(0.02, 1.6, 30)
    found = as_numpy(SECTIONS[cut](OUTER, inner, depth))
    plane = depth - OUTER
    if cut == "off-axis":
        lowest = plane
    else:
        angle = np.arccos(plane / OUTER)[:, None] * np.linspace(0, 1, 5)
        lowest = np.min(np.minimum(inner * np.cos(angle), OUTER * np.cos(angle)), axis=1)
    np.testing.assert_allclose(found.edge_near, found.centroid - lowest, rtol=1e-12)
    np.testing.assert_allclose(found.edge_spine, OUTER - found.centroid, rtol=1e-12)


def test_reference_numbers(margin):
    for cut, depth, *wanted in reference("pacheco_sections.csv")[:, :5]:
        name = list(SECTIONS)[int(cut)]
        found = as_numpy(SECTIONS[name](0.81, 0.70, depth))
        error = np.array([found.area, found.centroid, found.second_moment_weak]) / wanted - 1
        margin.within(f"{name} {depth} mm, relative", error, 1e-10)


def test_authors_numbers(margin):
    # Printed with 9 decimals of mm and 12 digits.
    for row in measured("pacheco2021_reference_section_properties.csv"):
        outer, inner, depth = (
            float(row[key]) for key in ("outer_diameter_mm", "inner_diameter_mm", "cut_depth_mm")
        )
        found = SECTIONS[row["cut_type"]](outer / 2, inner / 2, depth)
        offset = float(found.centroid) - float(row["neutral_axis_offset_mm"])
        second = float(found.second_moment_weak) / float(row["second_moment_mm4"]) - 1
        margin.within(f"{row['cut_type']} {outer} {depth} offset", offset, 6e-10, "mm")
        margin.within(f"{row['cut_type']} {outer} {depth} I, relative", second, 1e-10)
