"""The view of a cut that leaves an arc of the wall."""

from __future__ import annotations

import numpy as np

from notchflex import ArcNotch, Robot
from notchflex.plotting.notch_views import NotchView, notch_view
from notchflex.support import Notch


@notch_view.register
def _(notch: ArcNotch, robot: Robot, first: bool, following: Notch | None) -> NotchView:
    """Describe a cut that leaves an arc of the wall (Pacheco 2021, York 2015)."""
    (window,), _ = notch.cut_layout(robot.tube, None, following)
    corner = window.corners[1][1]
    # A radial cut face is seen from its outer to its inner corner.
    ratio = robot.tube.inner_radius / robot.tube.outer_radius if window.radial else 1.0
    view = NotchView(robot, first, radial=window.radial, variant=f'cut "{notch.cut}"')
    for number in range(min(notch.repeat, 2)):
        start, end = view.piece(notch.height, "" if number else "height")
        edge = view.cut(window, start)
        edge[:, 1] = np.maximum(edge[:, 1], max(corner, corner * ratio))
        if corner < 0.0 and window.radial:  # above the axis the wall hides its face
            view.faces.append(np.array([(start, corner), (end, corner)]))
        if number == 0:
            view.piece(notch.uncut_length, "uncut length")
    if notch.repeat > 1 or following is not None:
        view.stub()
    view.tip = notch.repeat == 1 and following is None
    view.depth(corner, notch.depth)
    view.projected = [(float(view.cuts[-1][0, 0]), corner, 0)]
    view.section_at, view.section_from = float(view.cuts[0][[0, -1], 0].mean()), corner
    return view
