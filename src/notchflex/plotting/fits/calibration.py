"""The picture of a fit: data with the model's band, residuals, profiles, correlations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from notchflex.plotting.fits.calibration_constants import END, correlation_panel, profile_panel
from notchflex.plotting.fits.calibration_rows import (
    MEASURED,
    MODEL,
    band,
    data_panel,
    parts_shown,
    residual_entries,
    residual_panel,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import DASHED, Area, Line, Panel, dots, grid
from notchflex.plotting.style import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from notchflex.fit import Calibration

COLUMNS = 4


def calibration_picture(found: Calibration) -> Picture:
    """Describe a fit.

    For every robot each notch and each other measured quantity over the load: measured points are
    open markers, the line is the model with the estimated constants, and the band is its linearised
    95 % interval. Then the residuals over the noise, the profile likelihood of every constant with
    the limit of its 95 % interval, and the correlations of the constants.

    Of a robot with many notches some are drawn, with the first and the last.

    Args:
        found: The fit.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    panels: list[Panel] = []
    for label in found.given:
        panels += [data_panel(found, part) for part in parts_shown(found, label)]
        panels.append(residual_panel(found, label))
    panels += [profile_panel(found, name) for name in found.intervals]
    if len(found.names) > 1:
        panels.append(correlation_panel(found))
    columns = min(COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    title = f"{', '.join(found.given)}: {found.counted} numbers"
    cells = grid(panels, columns)
    return Picture(title, 3.0 * columns, 2.6 * rows + 0.4, cells, _legend(found, panels))


def _legend(found: Calibration, panels: Sequence[Panel]) -> list[Line | Area]:
    """Return the legend entries of what the panels show."""
    measured = "measured, a kind of marker for each pull"
    entries: list[Line | Area] = [
        dots([], GREY, 4.0, hollow=True, name=measured, group=MEASURED),
        Line([], BLUE, name=MODEL, group=MODEL),
        band([], "95 % band of the model"),
        Line([], VERMILLION, DASHED, 1.0, name="end of the 95 % interval", group=END),
        *residual_entries(found),
    ]
    shown = {getattr(item, "group", "") for panel in panels for item in panel.items}
    return [entry for entry in entries if entry.group in shown]
