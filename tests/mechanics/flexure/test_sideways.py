"""Strips with elastic ends under loads out of the plane: what is built is what was asked for."""

from __future__ import annotations

import numpy as np

import notchflex as nf
from notchflex.mechanics.flexure import Site, rod
from notchflex.mechanics.material import section_law
from notchflex.mechanics.ring import Side


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
