"""The view of a strip between two triangular notches."""

from __future__ import annotations

from notchflex import Robot, StripNotch
from notchflex.plotting.notch_views import NotchView, notch_view
from notchflex.support import Notch


@notch_view.register
def _(notch: StripNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a pair of triangular notches with the strip between them (Liu 2022)."""
    # The last notch may reach beyond the tip, so the view is broken off there too.
    (below, above), _ = notch.cut_layout(robot.tube, None, following)
    view, vertex = NotchView(robot, first, toward=True), 0.0
    for number in range(min(notch.repeat, 2)):
        start, vertex = view.piece(notch.height, "" if number else "height")
        _, far = view.piece(notch.strip_thickness, "" if number else "strip thickness")
        view.cut(below, start)
        view.cut(above, far, -1.0)
        if number == 0:
            view.piece(notch.uncut_length, "uncut length")
    view.length = max(view.length, float(view.cuts[-1][-1, 0]))
    view.stub()
    corner, length = notch.depth - robot.tube.outer_radius, notch.strip_length_in(robot.tube)
    view.depth(-corner, notch.depth)
    view.strip(length)
    ends = [(view.length, sign * length, 1) for sign in (0.5, -0.5)]
    view.projected = [(vertex, -corner, 0), *ends]
    view.section_at, view.section_from = float(view.cuts[1][0, 0]), corner
    walls = view.sized("wall_width", notch.wall_width_in(robot.tube))
    view.notes.append(f"wall width (both walls together) {walls}")
    return view
