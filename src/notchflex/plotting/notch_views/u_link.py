"""The view of a row of slots with round ends."""

from __future__ import annotations

from notchflex import Robot, ULink
from notchflex.plotting.notch_views import STUB, Dimension, NotchView, notch_view
from notchflex.support import Notch


@notch_view.register
def _(notch: ULink, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a row of slots with round ends (Gao 2017)."""
    slot = notch.cut_layout(robot.tube, None, following).cuts[0]
    view = NotchView(robot, first, tip=following is None)
    side = -1.0 if notch.proximal_slot == "away" else 1.0
    shown = range(notch.slots) if notch.slots <= 4 else (0, 1, 2, notch.slots - 1)
    # The slot of the section is cut from the side of the bend; its neighbour from the other one.
    centres: dict[float, float] = {}
    for place, number in enumerate(shown):
        if place and number > shown[place - 1] + 1:
            view.stub()
            view.length += STUB * view.diameter
        start, end = view.piece(notch.height, "slot width" if place == 1 else "")
        sign = side * (-1.0) ** number
        view.cut(slot, start, sign)
        if place < 3:
            centres[sign] = 0.5 * (start + end)
        if number + 1 in shown:
            view.piece(notch.strip_thickness, "" if place else "strip thickness")
    if not isinstance(following, ULink):
        view.piece(notch.uncut_length, "uncut length")
    if following is not None:
        view.stub()
    outer, half, corner = robot.tube.outer_radius, 0.5 * notch.strip_length, slot.corners[1][1]
    view.strip(notch.strip_length)
    depth = outer + half + notch.slot_radius
    view.across.append([Dimension(corner, outer, f"depth\n{depth:.6g}")])
    view.section_at, view.section_from = centres[1.0], corner
    view.projected = [(centres[1.0], -half, 0), (centres[-1.0], half, 0), (centres[1.0], corner, 1)]
    radius = view.sized("slot_radius", notch.slot_radius)
    view.notes.append(f"slot radius {radius}, half the slot width")
    return view
