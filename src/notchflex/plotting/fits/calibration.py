"""The picture of a fit: data with the model's band, residuals, profiles, correlations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.fits.calibration_rows import (
    MEASURED,
    MODEL,
    band,
    data_panels,
    residual_entries,
    residual_panel,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import (
    DASHED,
    DOTTED,
    Area,
    Correlations,
    Curve,
    Mark,
    Note,
    Panel,
    Span,
    dots,
    grid,
)
from notchflex.plotting.style import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from notchflex.fit import Calibration

COLUMNS = 4
END = "end of the interval"
"""Group of the ends of all intervals."""


def calibration_picture(fit: Calibration) -> Picture:
    """Describe a fit.

    For every robot each notch and each other measured quantity over the load: measured points are
    open markers, the line is the model with the estimated constants, and the band is its linearised
    95 % interval. Then the residuals over the noise, the profile likelihood of every constant with
    the limit of its 95 % interval, and the correlations of the constants.

    Of a robot with many notches some are drawn, with the first and the last.

    Args:
        fit: The fit.
    """
    panels: list[Panel] = []
    for label in fit.given:
        panels += [*data_panels(fit, label), residual_panel(fit, label)]
    panels += [profile_panel(fit, name) for name in fit.intervals]
    if len(fit.names) > 1:
        panels.append(correlation_panel(fit))
    columns = min(COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    title = f"{', '.join(fit.given)}: {fit.counted} numbers"
    cells = grid(panels, columns)
    return Picture(title, 3.0 * columns, 2.6 * rows + 0.4, cells, _legend(fit, panels))


def _legend(fit: Calibration, panels: Sequence[Panel]) -> list[Curve | Area]:
    """Return the legend entries of what the panels show."""
    measured = "measured, a kind of marker for each pull"
    entries: list[Curve | Area] = [
        dots([], GREY, 4.0, hollow=True, name=measured, group=MEASURED),
        Curve([], BLUE, name=MODEL, group=MODEL),
        band([], "95 % band of the model"),
        Curve([], VERMILLION, DASHED, 1.0, name="end of the 95 % interval", group=END),
        *residual_entries(fit),
    ]
    shown = {item.group for panel in panels for item in panel.items}
    return [entry for entry in entries if entry.group in shown]


def profile_panel(fit: Calibration, name: str) -> Panel:
    """Return the rise of twice the misfit over one constant, with all others optimal."""
    interval = fit.intervals[name]
    value, rise = interval.profile.T
    line = fit.allowed_rise(name)
    items: list[Mark] = [
        Span("y", line, line, GREY, DOTTED, 1.2),
        Curve(_smooth(value, rise, fit.values[name]), BLUE),
        dots(interval.profile, BLUE, group="profile", layer=3, hover=True),
    ]
    ends = [end for end in (interval.lower, interval.upper) if end is not None]
    items += [Span("x", end, end, VERMILLION, DASHED, 1.0, group=END) for end in ends]
    sides = ["below"] * (interval.lower is None) + ["above"] * (interval.upper is None)
    if sides:
        items.append(Note(f"open {' and '.join(sides)}", VERMILLION, corner=True))
    most = float(np.max(rise[np.isfinite(rise)]))
    unit = fit.units[name]
    return Panel(
        items,
        f"{_short(name)} [{unit or '-'}]",
        "rise of 2 x misfit [-]",
        title=f"profile of constant {fit.names.index(name) + 1}, dotted: 95 %",
        y_range=(-0.03 * line, min(max(1.6 * line, 1.1 * most), 3.0 * line)),
        most_x=5,
    )


def correlation_panel(fit: Calibration) -> Panel:
    """Return the correlation matrix of the constants."""
    few = len(fit.names) < 6  # else a row has no room for two lines
    names = [_short(name) if few else name for name in fit.names]
    rows = [f"{name}  {number + 1}" for number, name in enumerate(names)]
    if fit.intervals:  # numbered as the profiles; names would make all panels narrow
        rows = [str(number + 1) for number in range(len(fit.names))]
    return Panel(
        [Correlations(fit.correlation, fit.names, rows)],
        "constants, numbered as their profiles" if fit.intervals else "",
        "",
        title="correlation",
    )


def _smooth(value: np.ndarray, rise: np.ndarray, best: float) -> np.ndarray:
    """Return a curve through the points, which interpolates their nearly linear signed roots."""
    is_known = np.isfinite(rise)
    value, root = value[is_known], np.sqrt(rise[is_known]) * np.sign(value[is_known] - best)
    x = np.linspace(value[0], value[-1], 200)
    return np.stack([x, np.interp(x, value, root) ** 2], axis=1)


def _short(name: str) -> str:
    """Return a name, with the section on a line of its own if it is long."""
    if len(name) < 24 or "." not in name:
        return name
    head, _, tail = name.rpartition(".")
    return f"{head}.\n{tail}"
