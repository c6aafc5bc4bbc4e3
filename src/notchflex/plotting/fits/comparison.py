"""Measured angles over the lines of the model, centre lines, and models beside each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.bent import bent_by_angles
from notchflex.plotting.shapes.outline import outline
from notchflex.plotting.sheet import (
    DASH_DOT,
    DASHED,
    DOTTED,
    MARKERS,
    MIXED,
    SOLID,
    Bars,
    Cell,
    Item,
    Line,
    Note,
    Panel,
)
from notchflex.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    sequence_colours,
)
from notchflex.results.quantities.registry import DEGREES, QUANTITIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.comparison import Comparison

MODEL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
MODEL_LINES = (SOLID, DASHED, DASH_DOT, DOTTED, MIXED)
SHAPES = 6


def comparison_figure(
    comparison: Comparison, others: Mapping[str, Comparison] | None = None
) -> Figure:
    """Draw a comparison with matplotlib; for what it shows see `comparison_picture`.

    Args:
        comparison: The model beside its measurement.
        others: Label to comparison of other models with the same measurement, drawn with it.

    Returns:
        The figure; `notchflex.plotting.save` writes it.
    """
    return comparison_picture(comparison, others).figure()


def comparison_picture(
    comparison: Comparison, others: Mapping[str, Comparison] | None = None
) -> Picture:
    """Describe a comparison: every notch, the total angle, the centre lines, and the errors.

    Measured points are open markers, one kind for each trial; lines are the model. Centre lines
    are those of the measured angles (dots) and of the model (lines) at points of one trial.

    Args:
        comparison: The model beside its measurement.
        others: Label to comparison of other models with the same measurement, drawn with it.

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    models = {"model": comparison, **(others or {})}
    panels = list(_angle_panels(comparison, models))
    panels.append(_centre_lines(comparison))
    if others:
        panels.append(_errors(models))
    columns = min(5, math.ceil(len(panels) / 2))
    rows = math.ceil(len(panels) / columns)
    cells = [
        Cell(
            panel, (index // columns, index // columns + 1), (index % columns, index % columns + 1)
        )
        for index, panel in enumerate(panels)
    ]
    title = f"{comparison.robot.name}: {_title(models)}"
    legend = _legend(models, comparison.measured.pull)
    return Picture(title, 2.9 * columns, 2.7 * rows, cells, legend)


def _title(models: Mapping[str, Comparison]) -> str:
    one = next(iter(models.values()))
    error = f"tip {one.tip_rmse:.2f} mm"
    if math.isnan(one.tip_rmse):
        error = f"total {one.rmse_total * DEGREES:.2f}°"
    return f"{error} rms over {one.points} points"


def _angle_panels(comparison: Comparison, models: Mapping[str, Comparison]) -> Iterator[Panel]:
    """Yield the angles of every notch and the total, measured and of the models."""
    measured = comparison.measured
    x, x_label = _abscissa(comparison)
    for title, given, pick, rmse in _angles(comparison):
        items: list[Item] = list(_points(x, given * DEGREES, measured.pull))
        for (label, one), colour, dash in zip(
            models.items(), MODEL_COLOURS * 9, MODEL_LINES * 9, strict=False
        ):
            for part in _lines(one, x):
                line = np.stack([x[part], pick(one)[part] * DEGREES], axis=1)
                items.append(Line(line, colour, dash, group=label, layer=3, told=True))
        drawn = np.concatenate([given, *(pick(one) for one in models.values())])
        yield Panel(
            items,
            x_label,
            f"angle [{QUANTITIES['notch_angle'].unit}]",
            title=f"{title}, error {rmse * DEGREES:.2f}° rms",
            # From 0 where nothing is bent the other way.
            y_range=(0.0, None) if np.nanmin(drawn, initial=0.0) >= 0.0 else None,
            shared_x=True,
        )


def _angles(comparison: Comparison) -> Iterator[tuple[str, NDArray[np.float64], Any, float]]:
    """Yield title, measured values, a picker of the model's values, and the error of each panel."""
    for notch in range(comparison.robot.number_of_notches):
        seen = comparison.measured_notch_angle[:, notch]
        if np.isnan(seen).all():
            continue

        def pick(one: Comparison, notch: int = notch) -> NDArray[np.float64]:
            return one.notch_angle[:, notch]

        yield f"notch {notch + 1}", seen, pick, float(comparison.rmse_notches[notch])
    seen = comparison.measured_total_angle
    if not np.isnan(seen).all():
        yield "total", seen, lambda one: one.total_angle, comparison.rmse_total


def _abscissa(comparison: Comparison) -> tuple[NDArray[np.float64], str]:
    """Return what was done to the first tendon that was measured, and the label of its axis.

    The row where tendons hang slack or are driven by force in some rows and by stroke in others.
    """
    measured = comparison.measured
    for name, values in (
        ("tension", measured.measured_tension),
        ("stroke", measured.load.stroke),
    ):
        there = ~np.isnan(values).any(axis=0)
        if there.any():
            return values[:, int(np.argmax(there))], QUANTITIES[name].label
    return np.arange(1.0, len(measured) + 1.0), "row of the table"


def _lines(comparison: Comparison, x: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Return the points of each line of the model: all by load from rest, or trial by trial."""
    good = np.flatnonzero(comparison.converged)
    if comparison.measured.from_rest:
        return [good[np.argsort(x[good], kind="stable")]]
    trial = np.array(comparison.measured.pull)
    return [good[trial[good] == label] for label in comparison.measured.pulls]


def _points(
    x: NDArray[np.float64], y: NDArray[np.float64], trial: tuple[str, ...]
) -> Iterator[Line]:
    labels = np.array(trial)
    for index, label in enumerate(dict.fromkeys(trial)):
        there = (labels == label) & np.isfinite(y)
        yield Line(
            np.stack([x[there], y[there]], axis=1),
            GREY,
            None,
            marker=MARKERS[index % len(MARKERS)],
            size=3.2,
            hollow=True,
            group=_trial_name(label, trial),
            told=True,
        )


def _trial_name(label: str, trial: tuple[str, ...]) -> str:
    return f"measured, trial {label}" if len(set(trial)) > 1 else "measured"


def _centre_lines(comparison: Comparison) -> Panel:
    """Measured and computed centre lines at some points of the longest trial."""
    robot = comparison.robot
    view = np.radians(robot.notches[0].direction_deg)
    points = _telling_points(comparison)
    items: list[Item] = [] if points else [Note("no point was solved")]
    for angles, dash, width in (
        (comparison.notch_angle, SOLID, 1.4),
        (comparison.measured_notch_angle, DOTTED, 2.4),
    ):
        for row, colour in zip(angles[points], sequence_colours(len(points)), strict=True):
            if np.isnan(row).any():
                continue
            line = outline(bent_by_angles(robot, row), view).centre_line
            items.append(Line(line, colour, dash, width))
            if dash:
                items.append(Line(line[-1:], colour, None, marker="o", size=4.0))
    return Panel(
        items,
        "across the base [mm]",
        "along the base [mm]",
        title="centre lines: model –, measured ··•" if points else "",
        equal=bool(points),
    )


def _telling_points(comparison: Comparison) -> list[int]:
    """Return points of the longest trial, evenly spread in total angle."""
    trial = np.array(comparison.measured.pull)
    longest = max(comparison.measured.pulls, key=lambda label: (trial == label).sum())
    candidates = np.flatnonzero((trial == longest) & comparison.converged)
    if not len(candidates):
        return []
    angle = comparison.total_angle[candidates]
    wanted = np.linspace(angle.min(), angle.max(), SHAPES)
    nearest = (int(candidates[np.argmin(np.abs(angle - goal))]) for goal in wanted)
    return list(dict.fromkeys(nearest))


def _errors(models: Mapping[str, Comparison]) -> Panel:
    """The tip error of every model as a bar, or that of the total angle where no tip is known."""
    tip = [one.tip_rmse for one in models.values()]
    no_tip = bool(np.isnan(tip).all())
    values = [one.rmse_total * DEGREES for one in models.values()] if no_tip else tip
    colours = [MODEL_COLOURS[index % 5] for index in range(len(values))]
    most = 1.2 * max((value for value in values if value > 0.0), default=1.0)
    return Panel(
        [Bars(values, list(models), colours)],
        f"total angle error [{QUANTITIES['total_angle'].unit}]" if no_tip else "tip error [mm]",
        "",
        title="error of the total angle, rms" if no_tip else "tip error, rms",
        x_range=(0.0, most),
    )


def _legend(models: Mapping[str, Comparison], trial: tuple[str, ...]) -> list[Line]:
    entries: list[Line] = []
    for label, marker in zip(dict.fromkeys(trial), MARKERS, strict=False):
        name = _trial_name(label, trial)
        options: dict[str, Any] = {"marker": marker, "size": 4.0, "hollow": True, "group": name}
        entries.append(Line([], GREY, None, name=name, **options))
    for label, colour, dash in zip(models, MODEL_COLOURS * 9, MODEL_LINES * 9, strict=False):
        entries.append(Line([], colour, dash, name=label, group=label))
    return entries
