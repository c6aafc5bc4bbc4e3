"""The view of a strip between two triangular notches."""

from __future__ import annotations

from notchflex import Robot, StripNotch
from notchflex.plotting.drawings.notch_views.view import (
    Cut,
    Dimension,
    NotchView,
    SideView,
    drawn,
    notch_view,
)
from notchflex.support import Notch


@notch_view.register
def _(notch: StripNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a pair of triangular notches with the strip between them (Liu 2022)."""
    # The last notch may reach beyond the tip, so the view is broken off there too.
    (below, above), _ = notch.cut_layout(robot.tube, None, following)
    outer = robot.tube.outer_radius
    line = SideView(robot, first)
    cuts: list[Cut] = []
    vertex = 0.0
    for number in range(min(notch.repeat, 2)):
        start, near = line.piece(notch.height, "" if number else "height")
        _, far = line.piece(notch.strip_thickness, "" if number else "strip thickness")
        cuts.append(Cut(drawn(below, start, 1.0, line.diameter)))
        cuts.append(Cut(drawn(above, far, -1.0, line.diameter)))
        vertex = near
        if number == 0:
            line.piece(notch.uncut_length, "uncut length")
    line.at = max(line.at, float(cuts[-1].edge[-1, 0]))
    line.stub()
    corner = notch.depth - outer
    left = robot.tube.outer_diameter - notch.depth
    length, walls = notch.strip_length_in(robot.tube), notch.wall_width_in(robot.tube)
    return line.view(
        tip=False,
        cuts=cuts,
        across=[
            [
                Dimension(-corner, outer, f"depth\n{line.sized('depth', notch.depth)}"),
                Dimension(-outer, -corner, f"remaining\n{left:.6g}"),
            ],
            [
                Dimension(
                    -0.5 * length,
                    0.5 * length,
                    f"strip\nlength\n{line.sized('strip_length', length)}",
                )
            ],
        ],
        projected=[(vertex, -corner, 0), (line.at, 0.5 * length, 1), (line.at, -0.5 * length, 1)],
        section_at=float(cuts[1].edge[0, 0]),
        section_from=corner,
        toward=True,
        notes=[f"wall width (both walls together) {line.sized('wall_width', walls)}"],
    )
