"""A picture of an episode: the robot to scale, its target and its tension."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import UInt8

from notchflex._extras import need
from notchflex.learning.rows import EpisodeRows

_SIZE, _DOTS = 4.8, 100  # inches, dots per inch
_ROOM = 0.75  # of the length of the robot, to either side


def frame(rows: EpisodeRows, row: int) -> UInt8[np.ndarray, "h w 3"]:
    """Return a picture of one row.

    Raises:
        InputError: matplotlib is not installed.
    """
    need("matplotlib", "plot", 'render_mode="rgb_array"')
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from notchflex.plotting.path import state_shape
    from notchflex.plotting.renderers.with_matplotlib import draw_panel
    from notchflex.plotting.shapes.outline import bending_plane, project
    from notchflex.plotting.sheet import dots
    from notchflex.plotting.style import VERMILLION, house_style

    panel, far = state_shape(rows.path(row), 0), _ROOM * rows.settings.length
    view: Any = None if panel.in_space else bending_plane(rows.settings.model)
    target = rows.target[row][None]
    points = target if view is None else project(target, view)
    mark = dots(points, VERMILLION, 7.0, name="target", layer=20)
    panel = replace(panel, items=[*panel.items, mark], legend="")
    with house_style():
        figure = Figure(figsize=(_SIZE, _SIZE), dpi=_DOTS, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes: Any = figure.add_subplot(projection="3d" if panel.in_space else None)
        draw_panel(axes, panel)
        if panel.in_space:
            axes.set(xlim=(-far, far), ylim=(-far, far), zlim=(-0.4 * far, 1.6 * far))
            axes.set_box_aspect((1.0, 1.0, 1.0))
        else:
            axes.set(xlim=(-far, far), ylim=(-0.4 * far, 1.6 * far))
            axes.set_aspect("equal", adjustable="box")
        canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
