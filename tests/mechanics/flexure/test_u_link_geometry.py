"""The middle line of the U-link against the table made by exact formulas and quadrature."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex import ULink
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


def test_it_begins_square_to_the_cut():
    heading = END.heading(0.0)
    across = END.outer_edge(0.0) - END.inner_edge(0.0)
    assert np.dot(across, [np.cos(heading), np.sin(heading)]) == pytest.approx(0.0, abs=1e-15)
    assert heading == pytest.approx(0.5 * np.pi - END.angle, abs=1e-15)


def test_the_description_has_the_same_width():
    notch = ULink(0.275, 0.70, 2.0, "away")
    assert notch.end_width == pytest.approx(END.outer_length, rel=1e-14)
    assert notch.span == pytest.approx(-2.0 * LINK.course(0.0).along, rel=1e-14)


def test_places_are_arc_lengths(margin):
    t = np.linspace(0.0, 1.0, 11)
    margin.within("t", END.at_length(END.length(t)) - t, 1e-14)


def at(place):
    """The middle line at arc lengths."""
    joint = LINK.end.length()
    return LINK.course(np.interp(place, [0.0, joint, LINK.length - joint, LINK.length], range(4)))


def test_heading_and_curvature_are_derivatives(margin):
    # Not at the joints, where the curvature jumps.
    place = np.linspace(0.01, LINK.length - 0.01, 60)
    joint = LINK.end.length()
    clear = np.minimum(abs(place - joint), abs(LINK.length - joint - place)) > 1e-4
    place, step = place[clear], 1e-5
    ahead, behind = at(place + step), at(place - step)
    along, above = ahead.along - behind.along, ahead.above - behind.above
    margin.within("speed", np.hypot(along, above) / (2.0 * step) - 1.0, 1e-9)
    margin.within("heading", np.arctan2(above, along) - at(place).heading, 1e-9)
    turning = (ahead.heading - behind.heading) / (2.0 * step)
    margin.within("curvature", turning - at(place).curvature, 1e-8)


def test_half_a_turn_takes_the_link_to_itself(margin):
    part = np.linspace(0.0, 3.0, 31)
    there, back = LINK.course(part), LINK.course(3.0 - part)
    margin.within("points along", there.along + back.along, 1e-15)
    margin.within("points above", there.above + back.above, 1e-15)
    margin.within("rise", there.above[-1] - there.above[0] - 0.275, 1e-15)
