"""A fit as a picture: data with the model's band, residuals, profiles, correlations."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from notchflex.plot.calibration_constants import draw_correlation, draw_profile
from notchflex.plot.calibration_rows import Part, draw_data, draw_residuals, parts_shown
from notchflex.plot.style import BLUE, GREY, VERMILLION, house_style, new_figure

if TYPE_CHECKING:
    from notchflex.calibrate import Calibration

COLUMNS = 4


def calibration_figure(found: Calibration) -> Figure:
    """Draw a fit.

    Robot by robot every notch and what else was measured over the load: measured points are open
    markers, the line is the model with the constants that were found, and its band is where the
    model lies with 95 % by the covariance of the constants, in a straight-line view. Then the
    residuals of all notches, over the noise, the profile likelihood of every constant with the line
    that ends its 95 % interval, and the correlations of the constants.

    Of a robot with many notches some are drawn, the first and the last among them.

    Args:
        found: The fit.

    Returns:
        The figure; `notchflex.plot.save` writes it.
    """
    rooms: list[Callable[[Axes], None]] = []
    for label in found.given:
        shown: list[Part] = parts_shown(found, label)
        rooms += [partial(draw_data, found=found, part=part) for part in shown]
        rooms.append(partial(draw_residuals, found=found, label=label))
    rooms += [partial(draw_profile, found=found, name=name) for name in found.intervals]
    if len(found.names) > 1:
        rooms.append(partial(draw_correlation, found=found))
    columns = min(COLUMNS, len(rooms))
    rows = math.ceil(len(rooms) / columns)
    with house_style():
        title = f"{', '.join(found.given)}: {len(found.residuals)} numbers measured"
        figure = new_figure(3.0 * columns, 2.6 * rows + 0.4, title)
        for number, draw in enumerate(rooms):
            draw(figure.add_subplot(rows, columns, number + 1))
        figure.legend(handles=_legend(), loc="outside lower center", ncols=4)
    return figure


def _legend() -> list[Line2D | Patch]:
    return [
        Line2D(
            [],
            [],
            linestyle="",
            marker="o",
            markersize=4.0,
            markerfacecolor="none",
            markeredgecolor=GREY,
            label="measured, a kind of marker for each pull",
        ),
        Line2D([], [], color=BLUE, label="model"),
        Patch(facecolor=BLUE, alpha=0.25, label="95 % band of the model"),
        Line2D([], [], color=VERMILLION, linestyle="--", label="end of the 95 % interval"),
    ]
