"""The saved picture: the robot as it is seen, its loop, its numbers and a legend."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.renderers.with_matplotlib import draw_panel
from notchflex.plotting.shapes.applied_loads import applied_loads
from notchflex.plotting.shapes.robot_shape import shape_at
from notchflex.plotting.style import house_style
from notchflex.viewer.page.charts import loop
from notchflex.viewer.page.legend import BALL, entries, strain_scale
from notchflex.viewer.page.readout import rows
from notchflex.viewer.session import Session

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (12.0, 7.5)  # inches
SHAPE = (1080, 1050)  # pixels of the view of the robot, height and width
_DOTS = 160  # per inch


def picture(session: Session, view: NDArray[np.uint8], tendon: int) -> bytes:
    """Return a PNG file.

    Args:
        session: The robot and its load history.
        view: The robot on a transparent background, (height, width, 4).
        tendon: The tendon of the loop, from 0.
    """
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(SIZE, dpi=_DOTS)
        title = figure.suptitle(session.robot.name, x=0.02, ha="left", fontsize=14)
        title.set_parse_math(False)  # a name may hold any sign
        place = figure.add_axes((0.01, 0.02, 0.58, 0.9))
        place.imshow(view)
        place.set_axis_off()
        draw_panel(figure.add_axes((0.67, 0.52, 0.31, 0.41)), loop(session, tendon))
        _write(figure.add_axes((0.62, 0.02, 0.37, 0.42)), session)
        target = io.BytesIO()
        figure.savefig(target, format="png", dpi=_DOTS)
    return target.getvalue()


def _write(axes: Axes, session: Session) -> None:
    """Write numbers and loads, and a legend of the colours."""
    from matplotlib.lines import Line2D

    axes.set_axis_off()
    shape = shape_at(session.solved, 0)
    loads = [one.label for one in applied_loads(session.solved, 0, shape)]
    lines = [f"{row.label}: {row.value}" for row in rows(session)]
    lines.append(f"loads at the tip: {', '.join(loads) or 'none'}")
    axes.text(
        0.0, 1.0, "\n".join(lines), va="top", fontsize=9, parse_math=False, transform=axes.transAxes
    )
    marks: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 7}
    shown = entries(session.robot)
    handles = [
        Line2D([], [], color=one.colour, label=one.text, **(marks if one.mark == BALL else {}))
        for one in shown
    ]
    axes.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(-0.02, -0.02),
        ncols=2,
        fontsize=8,
        handlelength=1.2,
    )
    allowed = session.robot.material.allowed_strain
    if allowed is not None:
        _strain_scale(axes, 100.0 * allowed)


def _strain_scale(axes: Axes, allowed: float) -> None:
    """Draw the colour scale of the strain up to the allowed one [%]."""
    from matplotlib.colors import ListedColormap

    scale = axes.inset_axes((0.24, 0.44, 0.34, 0.035))
    colours = ListedColormap(strain_scale(64))
    scale.imshow(np.linspace(0.0, 1.0, 64)[None], aspect="auto", cmap=colours)
    scale.set_axis_off()
    y = 0.457
    axes.text(0.0, y, "notch strain   0", va="center", fontsize=8, transform=axes.transAxes)
    axes.text(0.6, y, f"{allowed:g} % allowed", va="center", fontsize=8, transform=axes.transAxes)
