"""Constants of a fit: how the misfit rises beside each, and how they make up for one another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from notchflex.plot.style import BLUE, GREY, VERMILLION

if TYPE_CHECKING:
    from notchflex.calibrate import Calibration


def draw_profile(axes: Axes, *, found: Calibration, name: str) -> None:
    """Draw by how much twice the misfit rises where one constant is held, all others at best."""
    from notchflex.calibrate.intervals import allowed_rise

    interval = found.intervals[name]
    value, rise = interval.profile.T
    line = allowed_rise(None if found.noise.is_known else found.freedom) * found.widened**2
    axes.axhline(line, color=GREY, linestyle=":", linewidth=1.2)
    x, y = _smooth(value, rise, found.values[name])
    axes.plot(x, y, color=BLUE)
    axes.plot(value, rise, "o", color=BLUE, markersize=3.0)
    for end in (interval.lower, interval.upper):
        if end is not None:
            axes.axvline(end, color=VERMILLION, linestyle="--", linewidth=1.0)
    sides = ["below"] * (interval.lower is None) + ["above"] * (interval.upper is None)
    if sides:
        axes.text(
            0.03,
            0.95,
            f"open {' and '.join(sides)}",
            transform=axes.transAxes,
            va="top",
            color=VERMILLION,
            fontsize=8.0,
        )
    most = float(np.max(rise[np.isfinite(rise)]))
    axes.set_ylim(bottom=-0.03 * line, top=min(max(1.6 * line, 1.1 * most), 3.0 * line))
    axes.locator_params(axis="x", nbins=5)
    unit = found.units[name]
    axes.set_xlabel(_short(name) + (f" [{unit}]" if unit else ""))
    axes.set_ylabel("rise of 2 x misfit")
    axes.set_title(f"profile of constant {found.names.index(name) + 1}, dotted: 95 %", loc="left")


def draw_correlation(axes: Axes, *, found: Calibration) -> None:
    """Draw the correlations of the constants as a square of numbers."""
    count = len(found.names)
    axes.imshow(found.correlation, cmap="PuOr", vmin=-1.0, vmax=1.0)
    size = 8.0 if count < 6 else max(3.0, 36.0 / count)
    for row in range(count):
        for column in range(count):
            value = found.correlation[row, column]
            text = f"{value:.2f}" if np.isfinite(value) else "-"
            shade = "white" if abs(value) > 0.7 else "black"
            axes.text(column, row, text, ha="center", va="center", fontsize=size, color=shade)
    axes.set_xticks(range(count), [str(number + 1) for number in range(count)])
    names = [f"{_short(name)}  {number + 1}" for number, name in enumerate(found.names)]
    if found.intervals:  # the profiles have the same numbers; names would make all panels narrow
        names = [str(number + 1) for number in range(count)]
        axes.set_xlabel("constants, numbered as their profiles")
    axes.set_yticks(range(count), names, fontsize=min(7.0, 2.0 * size))
    axes.grid(visible=False)
    axes.set_title("correlation", loc="left")


def _smooth(value: np.ndarray, rise: np.ndarray, best: float) -> tuple[np.ndarray, np.ndarray]:
    """A curve through the points: their signed roots are nearly straight, so lines join those."""
    known = np.isfinite(rise)
    value, root = value[known], np.sqrt(rise[known]) * np.sign(value[known] - best)
    x = np.linspace(value[0], value[-1], 200)
    return x, np.interp(x, value, root) ** 2


def _short(name: str) -> str:
    """A name on few lines: the section on a line of its own where it is long."""
    if len(name) < 24 or "." not in name:
        return name
    head, _, tail = name.rpartition(".")
    return f"{head}.\n{tail}"
