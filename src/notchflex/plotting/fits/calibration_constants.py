"""Panels of the constants of a fit: profiles of the misfit, and correlations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.sheet import (
    DASHED,
    DOTTED,
    Correlations,
    Line,
    Mark,
    Note,
    Panel,
    Span,
    dots,
)
from notchflex.plotting.style import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from notchflex.fit import Calibration

END = "end of the interval"
"""Group of the ends of all intervals."""


def profile_panel(found: Calibration, name: str) -> Panel:
    """Return the rise of twice the misfit over one constant, with all others optimal."""
    interval = found.intervals[name]
    value, rise = interval.profile.T
    line = found.allowed_rise(name)
    items: list[Mark] = [
        Span("y", line, line, GREY, DOTTED, 1.2),
        Line(_smooth(value, rise, found.values[name]), BLUE),
        dots(interval.profile, BLUE, group="profile", layer=3, hover=True),
    ]
    ends = [end for end in (interval.lower, interval.upper) if end is not None]
    items += [Span("x", end, end, VERMILLION, DASHED, 1.0, group=END) for end in ends]
    sides = ["below"] * (interval.lower is None) + ["above"] * (interval.upper is None)
    if sides:
        items.append(Note(f"open {' and '.join(sides)}", VERMILLION, corner=True))
    most = float(np.max(rise[np.isfinite(rise)]))
    unit = found.units[name]
    return Panel(
        items,
        f"{_short(name)} [{unit or '-'}]",
        "rise of 2 x misfit [-]",
        title=f"profile of constant {found.names.index(name) + 1}, dotted: 95 %",
        y_range=(-0.03 * line, min(max(1.6 * line, 1.1 * most), 3.0 * line)),
        most_x=5,
    )


def correlation_panel(found: Calibration) -> Panel:
    """Return the correlation matrix of the constants."""
    few = len(found.names) < 6  # else a row has no room for two lines
    names = [_short(name) if few else name for name in found.names]
    rows = [f"{name}  {number + 1}" for number, name in enumerate(names)]
    if found.intervals:  # numbered as the profiles; names would make all panels narrow
        rows = [str(number + 1) for number in range(len(found.names))]
    return Panel(
        [Correlations(found.correlation, found.names, rows)],
        "constants, numbered as their profiles" if found.intervals else "",
        "",
        title="correlation",
    )


def _smooth(value: np.ndarray, rise: np.ndarray, best: float) -> np.ndarray:
    """Return a curve through the points, which interpolates their nearly linear signed roots."""
    known = np.isfinite(rise)
    value, root = value[known], np.sqrt(rise[known]) * np.sign(value[known] - best)
    x = np.linspace(value[0], value[-1], 200)
    return np.stack([x, np.interp(x, value, root) ** 2], axis=1)


def _short(name: str) -> str:
    """Return a name, with the section on a line of its own if it is long."""
    if len(name) < 24 or "." not in name:
        return name
    head, _, tail = name.rpartition(".")
    return f"{head}.\n{tail}"
