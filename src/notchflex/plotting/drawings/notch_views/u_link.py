"""The view of a row of slots with round ends."""

from __future__ import annotations

from notchflex import Robot, ULink
from notchflex.plotting.drawings.notch_views.view import (
    STUB,
    Cut,
    Dimension,
    NotchView,
    SideView,
    drawn,
    notch_view,
)
from notchflex.support import Notch


@notch_view.register
def _(notch: ULink, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a row of slots with round ends (Gao 2017)."""
    outer, radius, half = robot.tube.outer_radius, notch.slot_radius, 0.5 * notch.strip_length
    slot = notch.cut_layout(robot.tube, None, following).cuts[0]
    line = SideView(robot, first)
    cuts: list[Cut] = []
    side = -1.0 if notch.proximal_slot == "away" else 1.0
    shown = range(notch.slots) if notch.slots <= 4 else (0, 1, 2, notch.slots - 1)
    # The slot of the section is cut from the side of the bend; its neighbour from the other one.
    centres: dict[float, float] = {}
    for place, number in enumerate(shown):
        if place and number > shown[place - 1] + 1:
            line.stub()
            line.at += STUB * line.diameter
        start, end = line.piece(notch.height, "slot width" if place == 1 else "")
        sign, middle = side * (-1.0) ** number, 0.5 * (start + end)
        cuts.append(Cut(drawn(slot, start, sign, line.diameter)))
        if place < 3:
            centres[sign] = middle
        if number + 1 in shown:
            line.piece(notch.strip_thickness, "" if place else "strip thickness")
    if not isinstance(following, ULink):
        line.piece(notch.uncut_length, "uncut length")
    if following is not None:
        line.stub()
    section_at = centres[1.0]
    ends = [(section_at, -half), (centres[-1.0], half)]
    corner = slot.corners[1][1]
    depth = outer + half + radius
    return line.view(
        tip=following is None,
        cuts=cuts,
        across=[
            [
                Dimension(
                    -half, half, f"strip\nlength\n{line.sized('strip_length', notch.strip_length)}"
                )
            ],
            [Dimension(corner, outer, f"depth\n{depth:.6g}")],
        ],
        projected=[*((at, height, 0) for at, height in ends), (section_at, corner, 1)],
        section_at=section_at,
        section_from=corner,
        notes=[f"slot radius {line.sized('slot_radius', radius)}, half the slot width"],
    )
