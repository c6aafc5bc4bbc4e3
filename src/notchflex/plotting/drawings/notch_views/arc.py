"""The view of a cut that leaves an arc of the wall."""

from __future__ import annotations

import numpy as np

from notchflex import ArcNotch, Robot
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
def _(notch: ArcNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a cut that leaves an arc of the wall (Pacheco 2021, York 2015)."""
    outer, inner = robot.tube.outer_radius, robot.tube.inner_radius
    (window,), _ = notch.cut_layout(robot.tube, None, following)
    corner = window.corners[1][1]
    radial = window.radial
    # A radial cut face is seen from its outer to its inner corner.
    slanted = corner * inner / outer if radial else corner
    line = SideView(robot, first)
    cuts: list[Cut] = []
    shown = min(notch.repeat, 2)
    for number in range(shown):
        start, end = line.piece(notch.height, "" if number else "height")
        top = max(corner, slanted)
        edge = drawn(window, start, 1.0, line.diameter)
        edge[:, 1] = np.maximum(edge[:, 1], top)
        # Where the cut ends above the axis, the wall hides its face.
        face = np.array([(start, corner), (end, corner)]) if corner < top else None
        cuts.append(Cut(edge, face))
        if number == 0:
            line.piece(notch.uncut_length, "uncut length")
            if shown == 1 and following is not None:
                line.stub()
    if shown == 2:
        line.stub()
    tip = shown == 1 and following is None
    left = robot.tube.outer_diameter - notch.depth
    return line.view(
        tip=tip,
        cuts=cuts,
        across=[
            [
                Dimension(corner, outer, f"depth\n{line.sized('depth', notch.depth)}"),
                Dimension(-outer, corner, f"remaining\n{left:.6g}"),
            ]
        ],
        projected=[(float(cuts[-1].edge[0, 0]), corner, 0)],
        section_at=float(cuts[0].edge[[0, -1], 0].mean()),
        section_from=corner,
        radial=radial,
        variant=f'cut "{notch.cut}"',
    )
