"""Panels of the measurements of a fit over the load: model, its band, and residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.sheet import MARKERS, Area, Line, Mark, Panel, Span, dots
from notchflex.plotting.style import BLUE, GREY, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.fit import Calibration

MEASURED, MODEL, BAND = "measured", "model", "band"
"""Groups of marks in all panels."""

MOST_NOTCHES = 6
"""Of a robot with more notches some are drawn."""

MOST_NAMED = 8
"""Of so many notches a legend has the first and the last colour only."""


class MeasuredPart(NamedTuple):
    """A measured number of every row: robot, quantity, and component in the residuals."""

    label: str
    quantity: str
    component: int
    title: str


class _ModelLine(NamedTuple):
    """The rows of one pull, or of all pulls from rest of one file, in the order of a line."""

    x: NDArray[np.float64]
    measured: NDArray[np.float64]
    model: NDArray[np.float64]
    half: NDArray[np.float64]
    pulls: NDArray[np.intp]
    names: list[str]
    """Names of the pulls of the rows."""


def parts_shown(found: Calibration, label: str) -> list[MeasuredPart]:
    """Return what is drawn of a robot: some notches, and every other number."""
    from notchflex.fit.measurements.measurements import OBSERVED

    residuals = found.residuals
    own = residuals.robot == list(found.given).index(label)
    parts: list[MeasuredPart] = []
    for number, quantity in enumerate(OBSERVED):
        there = np.unique(residuals.part[own & (residuals.quantity == number)])
        if quantity == "axis_points":  # thirty points and more: only their residuals
            continue
        if len(there) > MOST_NOTCHES:
            spread = np.linspace(0, len(there) - 1, MOST_NOTCHES).round().astype(int)
            there = there[spread]
        parts += [
            MeasuredPart(label, quantity, int(one), _title(quantity, int(one))) for one in there
        ]
    return parts


def data_panel(found: Calibration, part: MeasuredPart) -> Panel:
    """Return one number over the load: measured, model, and the band of the model."""
    from notchflex.fit.assessment.errors_of_parts import edge

    _, unit, scale = edge(part.quantity)
    items: list[Mark] = []
    for line in _lines(found, part):
        measured, model, half = (one * scale for one in (line.measured, line.model, line.half))
        if np.isfinite(half).all():
            ends = [np.stack([line.x, model + way * half], axis=1) for way in (-1.0, 1.0)]
            items.append(band([np.concatenate([ends[0], ends[1][::-1]])]))
        curve = np.stack([line.x, model], axis=1)
        items.append(Line(curve, BLUE, group=MODEL, layer=3, hover=True))
        for pull, name in dict.fromkeys(zip(line.pulls.tolist(), line.names, strict=True)):
            mine = line.pulls == pull
            points = np.stack([line.x[mine], measured[mine]], axis=1)
            look: dict[str, Any] = {"marker": MARKERS[pull % len(MARKERS)], "hollow": True}
            look |= {"name": f"{MEASURED}, pull {name}", "group": MEASURED, "layer": 4}
            items.append(dots(points, GREY, 3.2, hover=True, **look))
    return Panel(
        items,
        _abscissa(found, part.label)[1],
        f"{_kind(part.quantity)} [{unit}]",
        title=f"{part.label}: {part.title}" if len(found.given) > 1 else part.title,
    )


def band(polygons: Sequence[NDArray[np.float64]], name: str = "") -> Area:
    """Return the 95 % band of the model."""
    return Area(polygons, BLUE, BLUE, 0.25, 0.0, name=name, group=BAND)


def residual_panel(found: Calibration, label: str) -> Panel:
    """Return the residuals of a robot over their noise, notches by colour.

    A total angle that is the sum of the notches has no noise of its own and is not drawn.
    """
    own, angles = (one & np.isfinite(found.noise.deviation) for one in _own(found, label))
    notch = found.residuals.part
    points = np.stack(
        [_abscissa(found, label)[0], found.residuals.values / found.noise.deviation], axis=1
    )
    items: list[Mark] = [
        Span("y", -1.96, 1.96, GREY, opacity=0.15),
        Span("y", 0.0, 0.0, GREY),
    ]
    if (own & ~angles).any():
        items.append(replace(_OTHERS, points=points[own & ~angles], hover=True, layer=1))
    for one, entry in _notch_entries(found).items():
        mine = points[angles & (notch == one)]
        if len(mine):
            items.append(replace(entry, points=mine, hover=True, layer=3))
    title = "model less measured"
    return Panel(
        items,
        _abscissa(found, label)[1],
        "residual / its noise [-]",
        title=f"{label}: {title}" if len(found.given) > 1 else title,
    )


def residual_entries(found: Calibration) -> list[Line]:
    """Return the legend entries of the residuals: colours of notches, marks of all others."""
    every = list(_notch_entries(found).values())
    return [*(every if len(every) < MOST_NAMED else [every[0], every[-1]]), _OTHERS]


_OTHERS = dots([], GREY, 3.5, marker="X", name="residuals of others", group="others")


def _notch_entries(found: Calibration) -> dict[int, Line]:
    """Return the marker of every notch (from 0), the same for all robots."""
    angles = np.any([_own(found, label)[1] for label in found.given], axis=0)
    notches = np.unique(found.residuals.part[angles]).tolist()
    colours = sequence_colours(len(notches))
    names = [f"residuals of notch {notch + 1}" for notch in notches]
    return {
        notch: dots([], colour, name=name, group=name)
        for notch, colour, name in zip(notches, colours, names, strict=True)
    }


def _own(found: Calibration, label: str) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which residuals belong to a robot, and which of them are notch angles."""
    from notchflex.fit.measurements.measurements import OBSERVED

    own = found.residuals.robot == list(found.given).index(label)
    notches = [OBSERVED.index(name) for name in ("notch_angle", "edge_angle")]
    return own, own & np.isin(found.residuals.quantity, notches)


def _lines(found: Calibration, part: MeasuredPart) -> list[_ModelLine]:
    """Return the rows of a part as lines: by load if measured from rest, else pull by pull."""
    from notchflex.fit.measurements.measurements import OBSERVED

    residuals = found.residuals
    own = (
        (residuals.robot == list(found.given).index(part.label))
        & (residuals.quantity == OBSERVED.index(part.quantity))
        & (residuals.part == part.component)
    )
    x = _abscissa(found, part.label)[0]
    half = found.half_width(found.residuals.slopes)
    lines: list[_ModelLine] = []
    for number in np.unique(residuals.sample[own]):
        measured = found.problem.samples.every[number].measured
        mine = np.flatnonzero(own & (residuals.sample == number))
        groups = [mine[np.argsort(x[mine], kind="stable")]]
        if not measured.from_rest:
            groups = [mine[residuals.pull[mine] == one] for one in np.unique(residuals.pull[mine])]
        for rows in groups:
            table = measured.observed[part.quantity]
            seen = table.reshape(len(table), -1)[residuals.row[rows], part.component]
            names = [str(measured.pull[row]) for row in residuals.row[rows]]
            model = seen + residuals.values[rows]
            lines.append(_ModelLine(x[rows], seen, model, half[rows], residuals.pull[rows], names))
    return lines


def _abscissa(found: Calibration, label: str) -> tuple[NDArray[np.float64], str]:
    """Return tension or stroke of a tendon at every residual of a robot, and its label."""
    residuals = found.residuals
    x = np.full(len(residuals), np.nan)
    samples = found.problem.samples.every
    mine = [(number, one) for number, one in enumerate(samples) if one.label == label]
    for name in ("tension", "stroke"):
        tables = {number: getattr(one.measured.load, name) for number, one in mine}
        first = next(iter(tables.values()))
        for tendon in range(first.shape[1]):
            columns = {number: table[:, tendon] for number, table in tables.items()}
            varied = np.concatenate(list(columns.values()))
            if not np.isfinite(varied).all() or np.ptp(varied) == 0.0:
                continue
            for number, column in columns.items():
                there = residuals.sample == number
                x[there] = column[residuals.row[there]]
            one_of_many = f" {tendon + 1}" if first.shape[1] > 1 else ""
            row = QUANTITIES[name]
            return x, row.label.replace(row.title, row.title + one_of_many, 1)
    for number, _ in mine:
        there = residuals.sample == number
        x[there] = residuals.row[there] + 1
    return x, "row [number]"


def _kind(quantity: str) -> str:
    if quantity.endswith(("_angle", "_rotation")):
        return "angle"
    return "tension" if quantity == "tip_tension" else "position"


def _title(quantity: str, component: int) -> str:
    from notchflex.fit.assessment.errors_of_parts import edge, part_title

    if quantity in ("tip_position", "tip_rotation"):
        return f"{edge(quantity)[0]}, {'xyz'[component]}"
    return part_title(quantity, 0 if quantity.startswith("total_") else component + 1)
