"""What was measured over the load, with the model and its band, and what is left between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.sheet import MARKERS, Area, Item, Level, Line, Panel, Stripe
from notchflex.plotting.style import BLUE, GREY, sequence_colours
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.fit import Calibration

MEASURED, MODEL, BAND = "measured", "model", "band"
"""What shows and hides lines of all panels together."""

MOST_NOTCHES = 6
"""Of a robot with more notches some are drawn."""

MOST_TOLD = 8
"""Of so many notches a legend tells the first and the last colour."""


class Part(NamedTuple):
    """A measured number of every row: robot, quantity, and its component as residuals have it."""

    label: str
    quantity: str
    component: int
    title: str


class _Line(NamedTuple):
    """The rows of one pull, or of all pulls from rest of one file, in the order of a line."""

    x: NDArray[np.float64]
    measured: NDArray[np.float64]
    model: NDArray[np.float64]
    half: NDArray[np.float64]
    pulls: NDArray[np.intp]
    names: list[str]
    """What the measurements call the pull of every row."""


def parts_shown(found: Calibration, label: str) -> list[Part]:
    """What is drawn of a robot: some notches, and one panel for each other number."""
    from notchflex.fit.measurements.measurements import OBSERVED

    residuals = found.residuals
    own = residuals.robot == list(found.given).index(label)
    parts: list[Part] = []
    for number, quantity in enumerate(OBSERVED):
        there = np.unique(residuals.part[own & (residuals.quantity == number)])
        if quantity == "axis_points":  # thirty points and more: their residuals tell
            continue
        if len(there) > MOST_NOTCHES:
            spread = np.linspace(0, len(there) - 1, MOST_NOTCHES).round().astype(int)
            there = there[spread]
        parts += [Part(label, quantity, int(one), _title(quantity, int(one))) for one in there]
    return parts


def data_panel(found: Calibration, part: Part) -> Panel:
    """Return one number over the load: measured, model, and the band of the model."""
    from notchflex.fit.assessment.errors_of_parts import edge

    _, unit, scale = edge(part.quantity)
    items: list[Item] = []
    for line in _lines(found, part):
        measured, model, half = (one * scale for one in (line.measured, line.model, line.half))
        if np.isfinite(half).all():
            ends = [np.stack([line.x, model + way * half], axis=1) for way in (-1.0, 1.0)]
            items.append(band([np.concatenate([ends[0], ends[1][::-1]])]))
        curve = np.stack([line.x, model], axis=1)
        items.append(Line(curve, BLUE, group=MODEL, layer=3, told=True))
        for pull, name in dict.fromkeys(zip(line.pulls.tolist(), line.names, strict=True)):
            mine = line.pulls == pull
            points = np.stack([line.x[mine], measured[mine]], axis=1)
            mark: dict[str, Any] = {"marker": MARKERS[pull % len(MARKERS)], "size": 3.2}
            mark |= {"name": f"{MEASURED}, pull {name}", "group": MEASURED, "layer": 4}
            items.append(Line(points, GREY, None, hollow=True, told=True, **mark))
    return Panel(
        items,
        _abscissa(found, part.label)[1],
        f"{_kind(part.quantity)} [{unit}]",
        title=f"{part.label}: {part.title}" if len(found.given) > 1 else part.title,
    )


def band(polygons: Sequence[NDArray[np.float64]], name: str = "") -> Area:
    """Return where the model lies with 95 %."""
    return Area(polygons, BLUE, BLUE, 0.25, 0.0, name=name, group=BAND)


def residual_panel(found: Calibration, label: str) -> Panel:
    """Return what is left of every number of a robot over its noise; notches by colour.

    A total angle that is the sum of the notches has no noise of its own and is not drawn.
    """
    own, angles = (one & np.isfinite(found.noise.deviation) for one in _own(found, label))
    notch = found.residuals.part
    points = np.stack(
        [_abscissa(found, label)[0], found.residuals.values / found.noise.deviation], axis=1
    )
    items: list[Item] = [Stripe(-1.96, 1.96, GREY, 0.15), Level(0.0, GREY)]
    if (own & ~angles).any():
        items.append(replace(_OTHERS, points=points[own & ~angles], told=True, layer=1))
    for one, entry in _notch_entries(found).items():
        mine = points[angles & (notch == one)]
        if len(mine):
            items.append(replace(entry, points=mine, told=True, layer=3))
    title = "model less measured"
    return Panel(
        items,
        _abscissa(found, label)[1],
        "residual / its noise [-]",
        title=f"{label}: {title}" if len(found.given) > 1 else title,
    )


def residual_entries(found: Calibration) -> list[Line]:
    """Return what a legend tells of the residuals: colours of notches, marks of all others."""
    every = list(_notch_entries(found).values())
    told = every if len(every) < MOST_TOLD else [every[0], every[-1]]
    return [*told, _OTHERS]


_OTHERS = Line([], GREY, None, marker="X", size=3.5, name="residuals of others", group="others")


def _notch_entries(found: Calibration) -> dict[int, Line]:
    """Every notch (from 0) with its mark, the same for all robots."""
    angles = np.any([_own(found, label)[1] for label in found.given], axis=0)
    notches = np.unique(found.residuals.part[angles]).tolist()
    colours = sequence_colours(len(notches))
    names = [f"residuals of notch {notch + 1}" for notch in notches]
    return {
        notch: Line([], colour, None, marker="o", size=3.0, name=name, group=name)
        for notch, colour, name in zip(notches, colours, names, strict=True)
    }


def _own(found: Calibration, label: str) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which residuals are those of a robot, and which of these are angles of notches."""
    from notchflex.fit.measurements.measurements import OBSERVED

    own = found.residuals.robot == list(found.given).index(label)
    return own, own & (found.residuals.quantity == OBSERVED.index("notch_angle"))


def _lines(found: Calibration, part: Part) -> list[_Line]:
    """The rows of a part as lines: all from rest of a file by load, or pull by pull in order."""
    from notchflex.fit.measurements.measurements import OBSERVED

    residuals = found.residuals
    own = (
        (residuals.robot == list(found.given).index(part.label))
        & (residuals.quantity == OBSERVED.index(part.quantity))
        & (residuals.part == part.component)
    )
    x = _abscissa(found, part.label)[0]
    half = found.half_width(found.residuals.slopes)
    lines: list[_Line] = []
    for number in np.unique(residuals.sample[own]):
        measured = found.problem.samples.every[number].measured
        mine = np.flatnonzero(own & (residuals.sample == number))
        groups = [mine[np.argsort(x[mine], kind="stable")]]
        if not measured.from_rest:
            groups = [mine[residuals.pull[mine] == one] for one in np.unique(residuals.pull[mine])]
        for rows in groups:
            model = _model(found, rows, part, measured)
            values = model - residuals.values[rows]
            names = [str(measured.pull[row]) for row in residuals.row[rows]]
            lines.append(_Line(x[rows], values, model, half[rows], residuals.pull[rows], names))
    return lines


def _model(
    found: Calibration, rows: NDArray[np.intp], part: Part, measured: Any
) -> NDArray[np.float64]:
    """The model's number at some residuals: what was measured, and what the model is more."""
    table = measured.observed[part.quantity]
    seen = table.reshape(len(table), -1)[found.residuals.row[rows], part.component]
    return seen + found.residuals.values[rows]


def _abscissa(found: Calibration, label: str) -> tuple[NDArray[np.float64], str]:
    """What was done to a tendon at every residual of a robot, and the label of its axis."""
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
    if quantity in ("notch_angle", "total_angle", "tip_rotation"):
        return "angle"
    return "tension" if quantity == "tip_tension" else "position"


def _title(quantity: str, component: int) -> str:
    from notchflex.fit.assessment.errors_of_parts import edge, part_title

    if quantity in ("tip_position", "tip_rotation"):
        return f"{edge(quantity)[0]}, {'xyz'[component]}"
    return part_title(quantity, 0 if quantity == "total_angle" else component + 1)
