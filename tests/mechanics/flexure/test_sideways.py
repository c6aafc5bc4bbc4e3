"""Strips with elastic ends under loads out of the plane: what is built is what was asked for."""

from __future__ import annotations

import numpy as np
import pytest

import notchflex as nf
from notchflex.mechanics.flexure import Site, rod
from notchflex.mechanics.flexure.roots import (
    ROUND,
    SHARP,
    RootedStrip,
    turned_compliance,
    with_sideways,
)
from notchflex.mechanics.material import FibreSection, NotchEnds, section_law
from notchflex.mechanics.ring import Side

LENGTH = np.array([0.2, 0.5, 0.7, 0.3])
ON_WALL = np.array([True, False, False, True])


def bar() -> FibreSection:
    size = np.ones(4)
    ends = NotchEnds()
    plain = (2.0 * size, 0.3 * size, 5.0 * size, 0.7 * size, 0.0 * size, size, size)
    return FibreSection(*plain, ends=ends)


def test_the_sections_add_up_to_the_compliance_asked_for() -> None:
    """By the stiffness that the solver takes, inverted and summed along the rod."""
    asked = (0.9, 0.25, 0.11)
    nu = 0.3
    law = section_law(nf.Linear(1.0, poisson_ratio=nu))
    made = with_sideways(bar(), LENGTH, ON_WALL, asked, nu)
    soft = np.linalg.inv(np.asarray(law.stiffness(made)))
    # On the wall x is along the strip and z along the tube; in the strip z is along it, x along
    # the tube, up to signs that do not count without coupling.
    wall = (LENGTH[:, None, None] * soft)[ON_WALL].sum(axis=0)
    strip = (LENGTH[:, None, None] * soft)[~ON_WALL].sum(axis=0)
    assert wall[0, 0] + strip[2, 2] == pytest.approx(asked[0], rel=1e-12)
    assert wall[2, 2] + strip[0, 0] == pytest.approx(asked[1], rel=1e-12)
    assert wall[[0, 2], [2, 0]] == pytest.approx(asked[2], rel=1e-12)
    assert strip[0, 2] == 0.0


@pytest.mark.parametrize("rule", [ROUND, SHARP])
def test_the_coupling_never_makes_the_stiffness_indefinite(rule) -> None:
    strip = RootedStrip(0.7, 2.5, 0.0, 0.4, 2.1, 0.0, 1.5, 1.0, rule, wall=1.0)
    tube = nf.Tube(6.0, 4.0)
    for cross in (-1e3, -7.0, 0.0, 7.0, 1e3):
        plane = np.array([[6.4, cross], [cross, 57.0]])
        about_strip, about_tube, both = turned_compliance(strip, tube, plane, 0.3)
        assert 0.25 * about_strip * about_tube > both**2
        assert both * cross <= 0.0


def test_drawn_links_are_positive_definite(margin) -> None:
    random = np.random.default_rng(3)
    law = section_law(nf.Linear(1.0, poisson_ratio=0.33))
    side = Side("between", 1.0)
    least = np.inf
    for _ in range(40):
        outer = random.uniform(1.0, 6.0)
        tube = nf.Tube(2.0 * outer, 2.0 * outer * random.uniform(0.3, 0.85))
        thickness = outer * random.uniform(0.05, 0.6)
        length = outer * random.uniform(0.1, 1.2)
        slot = outer * random.uniform(0.02, 0.2)
        if length + 2.0 * slot > 1.9 * outer:
            continue
        link = nf.ULink(slot, thickness, length, "away", ends="elastic")
        stiffness = np.asarray(law.stiffness(rod(link, tube, 0, Site(side, side, 0.33)).section))
        size = np.sqrt(np.einsum("kii->ki", stiffness))
        scaled = stiffness / size[:, :, None] / size[:, None, :]
        least = min(least, np.linalg.eigvalsh(scaled).min())
    margin.note(f"least eigenvalue of the stiffness, scaled to a diagonal of 1: {least:.3f}")
    assert least > 0.01
