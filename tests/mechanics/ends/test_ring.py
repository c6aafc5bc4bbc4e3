"""Rings that are longer than the effects of their edges reach."""

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.cuts import annular_sector
from notchflex.mechanics.ends import reach_of
from notchflex.mechanics.flattening import distortion
from notchflex.mechanics.ring import Side, arc_of, end_compliance

LENGTHS = (10.0, 20.0, 100.0, 1e3, 1e4, 1e5, 1e6)


@pytest.mark.parametrize("name", ["tube.base_length", "notch[5].uncut_length"])
def test_a_long_shaft_or_tip_changes_no_angle(name, margin):
    wrist, load = nf.load_robot("pacheco2021-b-true"), nf.Load(tension=0.5)
    states = [nf.solve(wrist.with_value(name, length), load) for length in LENGTHS]
    assert all(state.converged for state in states)
    angles = np.array([state.notch_angle for state in states])
    margin.within("notch angles", angles - angles[0], 1e-11, "rad")


@pytest.mark.parametrize("boundary", ["clamped", "free"])
@pytest.mark.parametrize("wall", [0.08, 0.15, 0.3, 0.47])
def test_the_effects_of_an_edge_have_died_out_where_the_ring_is_cut(wall, boundary, margin):
    """Beyond, the added lengths grow evenly, by the difference of a shell's and a beam's tube."""
    outer, inner = 1.0 + 0.5 * wall, 1.0 - 0.5 * wall
    arc = arc_of(outer, inner, annular_sector(outer, inner, 1.7 * outer))
    reach, loads = reach_of(arc), distortion(arc, 0.33).loads
    added = [
        np.array(end_compliance(arc, Side(boundary, part * reach), 0.33, loads, 0.8)[:3])
        for part in (1.0, 1.15, 1.3)
    ]
    margin.within("change of the growth", np.diff(added, 2, axis=0), 1e-3 * outer, "mm")
