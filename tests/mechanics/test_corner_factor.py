"""Strain at the corners of a cut, by finite elements of cells that were not fitted."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.corner_factor import corner_factor
from reference_data import named_rows

CELLS = named_rows("fem_corner_cells.csv")
RADIUS = 0.05


@pytest.mark.parametrize(("use", "allowed"), [("fit", 3.5), ("judge", 5.0)])
def test_finite_elements(margin, use: str, allowed: float):
    rows = [row for row in CELLS if row["use"] == use]
    assert len(rows) > 10
    for row in rows:
        law = float(corner_factor(row["radius"], row["depth"], row["ring"]))
        margin.within(use, 100.0 * (law / row["factor"] - 1.0), allowed, "%")


def test_rings_beyond_the_cells():
    """Cells with a wall of 0.07 and a height of 0.5, two elements through the wall."""
    for ring, found in ((0.6, 2.704), (1.2, 3.073), (2.4, 3.309)):
        assert float(corner_factor(0.02, 0.72, ring)) == pytest.approx(found, rel=0.045)
    assert corner_factor(0.02, 0.72, 9.0) == corner_factor(0.02, 0.72, 2.4)


def test_a_cycle_with_corners_of_a_radius():
    wrist = nf.load_robot("pacheco2021-a-true")
    path = nf.simulate(wrist, nf.pull(0.0, 0.2, steps=3).release())
    rounded = nf.strain_cycle(path, limit=nf.Fatigue(line="cao2020", corner_radius=RADIUS))
    outer, ring = wrist.tube.outer_diameter, wrist.notch[0].uncut_length
    depth = wrist.notch[0].section_depth(wrist.tube) / outer
    first, other = (
        float(corner_factor(RADIUS / outer, depth, one / outer)) for one in (np.inf, ring)
    )
    assert rounded.corner_factor == pytest.approx([first, *[other] * 4], rel=1e-14)
    own = nf.Fatigue(line="cao2020", corner_factor=other)
    same = nf.strain_cycle(path, limit=own).margin[1:]
    assert rounded.margin[1:] == pytest.approx(same, abs=1e-15)


def test_the_quantity_has_the_factor():
    limit = {"fatigue.line": "cao2020", "fatigue.corner_radius": RADIUS}
    robot = nf.load_robot("pacheco2021-a-true").with_values(limit)
    factor = nf.strain_cycle(nf.simulate(robot, nf.pull(0.0, 0.2, steps=3))).corner_factor
    load = nf.Load(tension=0.2)
    own = [
        nf.solve(robot.replace(fatigue=nf.Fatigue(line="cao2020", corner_factor=float(one))), load)
        for one in factor[:2]
    ]
    wanted = [own[0].fatigue_margin[0], *own[1].fatigue_margin[1:]]
    assert nf.solve(robot, load).fatigue_margin == pytest.approx(wanted, abs=1e-15)


def test_where_no_factor_is_known():
    wrist = nf.load_robot("pacheco2021-a-true").with_value("notch[2].depth", 0.9)
    path = nf.simulate(wrist, nf.pull(0.0, 0.2, steps=3).release())
    cycle = nf.strain_cycle(path, limit=nf.Fatigue(line="cao2020", corner_radius=RADIUS))
    assert np.isnan(cycle.smallest_margin).tolist() == [False, True, False, False, False]
    assert any("corner_factor (K_t) instead" in sentence for sentence in cycle.warnings())
    with pytest.raises(nf.InputError, match="give one"):
        nf.Fatigue(line="cao2020", corner_radius=RADIUS, corner_factor=2.0)
