"""The middle line of the U-link against the table made by exact formulas and quadrature."""

from __future__ import annotations

import numpy as np

from notchflex.mechanics.flexure.u_link import CurvedEnd, Link
from reference_data import reference

END = CurvedEnd(slot_radius=0.275, strip_thickness=0.70)
LINK = Link(slot_radius=0.275, strip_thickness=0.70, strip_length=2.0)


def test_curved_end(margin):
    table = reference("gao_geometry_seg1.csv")
    t = table[:, 0]
    found = {
        "arc length, mm": END.length(t)[:, None],
        "M, mm": END.inner_edge(t),
        "N, mm": END.outer_edge(t),
        "C, mm": END.middle(t),
        "heading, rad": END.heading(t)[:, None],
        "curvature, 1/mm": END.curvature(t)[:, None],
        "thickness, mm": END.thickness(t)[:, None],
    }
    wanted = np.split(table[:, 1:], np.cumsum([value.shape[1] for value in found.values()])[:-1], 1)
    for (what, value), column in zip(found.items(), wanted, strict=True):
        margin.within(what, value - column, 1e-10)


def test_half_a_turn_takes_the_link_to_itself(margin):
    part = np.linspace(0.0, 3.0, 31)
    there, back = LINK.course(part), LINK.course(3.0 - part)
    margin.within("points along", there.along + back.along, 1e-15)
    margin.within("points above", there.above + back.above, 1e-15)
    margin.within("rise", there.above[-1] - there.above[0] - 0.275, 1e-15)
