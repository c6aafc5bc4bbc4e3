"""Constants of a fit: how the misfit rises beside each, and how they make up for one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from notchflex.plotting.sheet import (
    DASHED,
    DOTTED,
    Correlations,
    Item,
    Level,
    Line,
    Note,
    Panel,
    Upright,
)
from notchflex.plotting.style import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from notchflex.fit import Calibration

END = "end of the interval"
"""What shows and hides all ends of intervals together."""


def profile_panel(found: Calibration, name: str) -> Panel:
    """Return by how much twice the misfit rises where one constant is held, all others at best."""
    interval = found.intervals[name]
    value, rise = interval.profile.T
    line = found.allowed_rise(name)
    items: list[Item] = [
        Level(line, GREY, DOTTED, 1.2),
        Line(_smooth(value, rise, found.values[name]), BLUE),
        Line(interval.profile, BLUE, None, marker="o", group="profile", layer=3, told=True),
    ]
    ends = [end for end in (interval.lower, interval.upper) if end is not None]
    items += [Upright(end, VERMILLION, DASHED, 1.0, group=END) for end in ends]
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
    """Return the correlations of the constants as a square of numbers."""
    few = len(found.names) < 6  # of more, a row has no room for two lines
    names = [_short(name) if few else name for name in found.names]
    rows = [f"{name}  {number + 1}" for number, name in enumerate(names)]
    if found.intervals:  # the profiles have the same numbers; names would make all panels narrow
        rows = [str(number + 1) for number in range(len(found.names))]
    return Panel(
        [Correlations(found.correlation, found.names, rows)],
        "constants, numbered as their profiles" if found.intervals else "",
        "",
        title="correlation",
    )


def _smooth(value: np.ndarray, rise: np.ndarray, best: float) -> np.ndarray:
    """A curve through the points: their signed roots are nearly straight, so lines join those."""
    known = np.isfinite(rise)
    value, root = value[known], np.sqrt(rise[known]) * np.sign(value[known] - best)
    x = np.linspace(value[0], value[-1], 200)
    return np.stack([x, np.interp(x, value, root) ** 2], axis=1)


def _short(name: str) -> str:
    """A name on few lines: the section on a line of its own where it is long."""
    if len(name) < 24 or "." not in name:
        return name
    head, _, tail = name.rpartition(".")
    return f"{head}.\n{tail}"
