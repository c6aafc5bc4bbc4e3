"""The picture of a fit: data with the model's band, residuals, profiles, correlations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import (
    DASHED,
    DOTTED,
    MARKERS,
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
from notchflex.plotting.style import BLUE, GREY, VERMILLION, sequence_colours
from notchflex.support import QUANTITIES

if TYPE_CHECKING:
    from notchflex.fit import Calibration


MEASURED, MODEL, BAND = "measured", "model", "band"
"""Groups of marks in all panels."""
MAX_NOTCHES = 6
"""Of a robot with more notches some are drawn."""
MAX_NAMED = 8
"""Of so many notches a legend has the first and the last colour only."""

_OTHERS = dots([], GREY, 3.5, marker="X", name="residuals of others", group="others")
_NOTCHES = ("notch_angle", "edge_angle")
_KINDS = dict.fromkeys((*_NOTCHES, "total_angle", "total_edge_angle", "tip_rotation"), "angle") | {
    "tip_tension": "tension"
}


def data_panels(fit: Calibration, label: str) -> Iterator[Panel]:
    """Yield the panels of a robot: some notches, and every other measured number."""
    from notchflex.fit import OBSERVED

    for quantity in OBSERVED:
        if quantity == "axis_points":  # thirty points and more: only their residuals
            continue
        components = np.unique(fit.residuals.part[_rows_of(fit, label, quantity)])
        if len(components) > MAX_NOTCHES:
            spread = np.linspace(0, len(components) - 1, MAX_NOTCHES).round().astype(int)
            components = components[spread]
        for component in components.tolist():
            yield data_panel(fit, label, quantity, component)


def data_panel(fit: Calibration, label: str, quantity: str, component: int) -> Panel:
    """Return one number over the load: measured, model, and the band of the model."""
    from notchflex.fit import edge, part_title

    residuals = fit.residuals
    name, unit, scale = edge(quantity)
    x, x_label = _abscissa(fit, label)
    half = fit.half_width(residuals.slopes) * scale
    items: list[Mark] = []
    drawn = np.flatnonzero(_rows_of(fit, label, quantity) & (residuals.part == component))
    for number, rows in _lines(fit, drawn, x):
        sample = fit.problem.samples.every[number].measured
        table = sample.observed[quantity]
        measured = table.reshape(len(table), -1)[residuals.row[rows], component]
        model = (measured + residuals.values[rows]) * scale
        if np.isfinite(half[rows]).all():
            ends = [np.stack([x[rows], model + way * half[rows]], axis=1) for way in (-1.0, 1.0)]
            items.append(band([np.concatenate([ends[0], ends[1][::-1]])]))
        curve = np.stack([x[rows], model], axis=1)
        items.append(Curve(curve, BLUE, group=MODEL, layer=3, hover=True))
        for pull in dict.fromkeys(residuals.pull[rows].tolist()):
            of_pull = residuals.pull[rows] == pull
            points = np.stack([x[rows][of_pull], measured[of_pull] * scale], axis=1)
            title = f"{MEASURED}, pull {sample.pull[residuals.row[rows][of_pull][0]]}"
            style: dict[str, Any] = {"marker": MARKERS[pull % len(MARKERS)], "hollow": True}
            style |= {"name": title, "group": MEASURED, "layer": 4, "hover": True}
            items.append(dots(points, GREY, 3.2, **style))
    if quantity in ("tip_position", "tip_rotation"):
        title = f"{name}, {'xyz'[component]}"
    else:
        title = part_title(quantity, 0 if quantity.startswith("total_") else component + 1)
    y_label = f"{_KINDS.get(quantity, 'position')} [{unit}]"
    return Panel(items, x_label, y_label, title=_titled(fit, label, title))


def band(polygons: Sequence[NDArray[np.float64]], name: str = "") -> Area:
    """Return the 95 % band of the model."""
    return Area(polygons, BLUE, BLUE, 0.25, 0.0, name=name, group=BAND)


def residual_panel(fit: Calibration, label: str) -> Panel:
    """Return the residuals of a robot over their noise, notches by colour.

    A total angle that is the sum of the notches has no noise of its own and is not drawn.
    """
    residuals, noise = fit.residuals, fit.noise.deviation
    x, x_label = _abscissa(fit, label)
    points = np.stack([x, residuals.values / noise], axis=1)
    angles = _rows_of(fit, label, *_NOTCHES) & np.isfinite(noise)
    others = _rows_of(fit, label) & np.isfinite(noise) & ~angles
    items: list[Mark] = [Span("y", -1.96, 1.96, GREY, opacity=0.15), Span("y", 0.0, 0.0, GREY)]
    if others.any():
        items.append(replace(_OTHERS, points=points[others], hover=True, layer=1))
    for notch, entry in _notch_entries(fit).items():
        of_notch = angles & (residuals.part == notch)
        if of_notch.any():
            items.append(replace(entry, points=points[of_notch], hover=True, layer=3))
    title = _titled(fit, label, "model less measured")
    return Panel(items, x_label, "residual / its noise [-]", title=title)


def residual_entries(fit: Calibration) -> list[Curve]:
    """Return the legend entries of the residuals: colours of notches, marks of all others."""
    notches = list(_notch_entries(fit).values())
    return [*(notches if len(notches) < MAX_NAMED else [notches[0], notches[-1]]), _OTHERS]


def _notch_entries(fit: Calibration) -> dict[int, Curve]:
    """Return the marker of every notch (from 0), the same for all robots."""
    angles = np.any([_rows_of(fit, label, *_NOTCHES) for label in fit.given], axis=0)
    notches = np.unique(fit.residuals.part[angles]).tolist()
    entries: dict[int, Curve] = {}
    for notch, colour in zip(notches, sequence_colours(len(notches)), strict=True):
        name = f"residuals of notch {notch + 1}"
        entries[notch] = dots([], colour, name=name, group=name)
    return entries


def _titled(fit: Calibration, label: str, title: str) -> str:
    return f"{label}: {title}" if len(fit.given) > 1 else title


def _rows_of(fit: Calibration, label: str, *quantities: str) -> NDArray[np.bool_]:
    """Return which residuals belong to a robot, and to some of its quantities."""
    from notchflex.fit import OBSERVED

    of_robot = fit.residuals.robot == list(fit.given).index(label)
    if not quantities:
        return of_robot
    return of_robot & np.isin(fit.residuals.quantity, [OBSERVED.index(one) for one in quantities])


def _lines(
    fit: Calibration, drawn: NDArray[np.intp], x: NDArray[np.float64]
) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Yield the sample and the residuals of each line: by load if from rest, else by pull."""
    residuals = fit.residuals
    for number in np.unique(residuals.sample[drawn]).tolist():
        rows = drawn[residuals.sample[drawn] == number]
        if fit.problem.samples.every[number].measured.from_rest:
            yield number, rows[np.argsort(x[rows], kind="stable")]
        else:
            for pull in np.unique(residuals.pull[rows]):
                yield number, rows[residuals.pull[rows] == pull]


def _abscissa(fit: Calibration, label: str) -> tuple[NDArray[np.float64], str]:
    """Return tension or stroke of a tendon at every residual of a robot, and its label."""
    residuals = fit.residuals
    x = np.full(len(residuals), np.nan)
    samples = {
        number: one.measured.load
        for number, one in enumerate(fit.problem.samples.every)
        if one.label == label
    }
    for name in ("tension", "stroke"):
        tables = {number: getattr(load, name) for number, load in samples.items()}
        count = next(iter(tables.values())).shape[1]
        for tendon in range(count):
            varied = np.concatenate([table[:, tendon] for table in tables.values()])
            if not np.isfinite(varied).all() or np.ptp(varied) == 0.0:
                continue
            for number, table in tables.items():
                of_sample = residuals.sample == number
                x[of_sample] = table[residuals.row[of_sample], tendon]
            quantity = QUANTITIES[name]
            title = quantity.title + (f" {tendon + 1}" if count > 1 else "")
            return x, quantity.label.replace(quantity.title, title, 1)
    for number in samples:
        of_sample = residuals.sample == number
        x[of_sample] = residuals.row[of_sample] + 1
    return x, "row [number]"


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
