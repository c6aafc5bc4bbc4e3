"""The picture of a comparison: measured angles with the models, centre lines, and errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.outline import outline
from notchflex.plotting.shapes.robot_shape import shape_from_angles
from notchflex.plotting.sheet import (
    DASH_DOT,
    DASHED,
    DOTTED,
    MARKERS,
    MIXED,
    SOLID,
    Bars,
    Curve,
    Mark,
    Note,
    Panel,
    dots,
    grid,
)
from notchflex.plotting.style import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, sequence_colours
from notchflex.support import DEGREES, QUANTITIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.comparison import Comparison

MODEL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
MODEL_LINES = (SOLID, DASHED, DASH_DOT, DOTTED, MIXED)
SHAPES = 6


def comparison_figure(
    comparison: Comparison, others: Mapping[str, Comparison] | None = None
) -> Figure:
    """Draw a comparison with matplotlib; see `comparison_picture` for the arguments."""
    return comparison_picture(comparison, others).figure()


def comparison_picture(
    comparison: Comparison, others: Mapping[str, Comparison] | None = None
) -> Picture:
    """Describe a comparison: every notch, the total angle, the centre lines, and the errors.

    Measured points are open markers, one kind for each trial; lines are the models. Centre lines
    are those of the measured angles (dotted) and of the model (lines) at points of one trial.

    Args:
        comparison: The model and its measurement.
        others: Label to comparison of other models with the same measurement.
    """
    models = {"model": comparison, **(others or {})}
    panels = [*_angle_panels(comparison, models), _centre_lines(comparison)]
    if others:
        panels.append(_errors(models))
    columns = min(5, math.ceil(len(panels) / 2))
    error = f"tip {comparison.rmse_tip:.2f} mm"
    if math.isnan(comparison.rmse_tip):
        error = f"total {comparison.rmse_total * DEGREES:.2f}°"
    legend = list(_trials(comparison).values())[: len(MARKERS)]
    legend += [
        Curve([], colour, dash, name=one, group=one) for one, colour, dash in _styles(models)
    ]
    title = f"{comparison.robot.name}: {error} rms over {comparison.points} points"
    size = 2.9 * columns, 2.7 * math.ceil(len(panels) / columns)
    return Picture(title, *size, grid(panels, columns), legend)


def _styles(models: Mapping[str, Any]) -> Iterator[tuple[str, str, tuple[float, ...]]]:
    """Yield label, colour and dashes of every model."""
    for index, label in enumerate(models):
        yield label, MODEL_COLOURS[index % 5], MODEL_LINES[index % 5]


def _angle_panels(comparison: Comparison, models: Mapping[str, Comparison]) -> Iterator[Panel]:
    """Yield the angles of every notch and the total angle, measured and of the models."""
    x, x_label = _abscissa(comparison)
    trial = np.array(comparison.measured.pull)
    for notch in (*range(comparison.robot.number_of_notches), None):
        if notch is None:
            measured = comparison.measured_total_angle
        else:
            measured = comparison.measured_notch_angle[:, notch]
        if np.isnan(measured).all():
            continue
        items: list[Mark] = []
        for label, entry in _trials(comparison).items():
            of_trial = (trial == label) & np.isfinite(measured)
            points = np.stack([x[of_trial], measured[of_trial] * DEGREES], axis=1)
            items.append(replace(entry, points=points, size=3.2, name="", hover=True))
        for label, colour, dash in _styles(models):
            angles = _computed(models[label], notch) * DEGREES
            for part in _lines(models[label], x):
                line = np.stack([x[part], angles[part]], axis=1)
                items.append(Curve(line, colour, dash, group=label, layer=3, hover=True))
        drawn = np.concatenate([measured, *(_computed(one, notch) for one in models.values())])
        error = comparison.rmse_total if notch is None else comparison.rmse_notches[notch]
        title = "total" if notch is None else f"notch {notch + 1}"
        yield Panel(
            items,
            x_label,
            f"angle [{QUANTITIES['notch_angle'].unit}]",
            title=f"{title}, error {float(error) * DEGREES:.2f}° rms",
            # From 0 if no angle is negative.
            y_range=(0.0, None) if np.nanmin(drawn, initial=0.0) >= 0.0 else None,
            shared="x",
        )


def _computed(one: Comparison, notch: int | None) -> NDArray[np.float64]:
    return one.total_angle if notch is None else one.notch_angle[:, notch]


def _abscissa(comparison: Comparison) -> tuple[NDArray[np.float64], str]:
    """Return the first tension or stroke that all rows have, and its label; else the row."""
    measured = comparison.measured
    tables = {"tension": measured.measured_tension, "stroke": measured.load.stroke}
    for name, values in tables.items():
        is_known = ~np.isnan(values).any(axis=0)
        if is_known.any():
            return values[:, int(np.argmax(is_known))], QUANTITIES[name].label
    return np.arange(1.0, len(measured) + 1.0), "row of the table"


def _lines(comparison: Comparison, x: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Return the points of each line of the model: all by load if from rest, else by trial."""
    converged = np.flatnonzero(comparison.converged)
    if comparison.measured.from_rest:
        return [converged[np.argsort(x[converged], kind="stable")]]
    trial = np.array(comparison.measured.pull)
    return [converged[trial[converged] == label] for label in comparison.measured.pulls]


def _trials(comparison: Comparison) -> dict[str, Curve]:
    """Return the legend entry of every trial."""
    labels = list(dict.fromkeys(comparison.measured.pull))
    entries: dict[str, Curve] = {}
    for index, label in enumerate(labels):
        name = f"measured, trial {label}" if len(labels) > 1 else "measured"
        marker = MARKERS[index % len(MARKERS)]
        entries[label] = dots([], GREY, 4.0, marker=marker, hollow=True, name=name, group=name)
    return entries


def _centre_lines(comparison: Comparison) -> Panel:
    """Return measured and computed centre lines at some points of the longest trial."""
    robot = comparison.robot
    view = np.radians(robot.notches[0].direction_deg)
    points = _representative_points(comparison)
    items: list[Mark] = [] if points else [Note("no point was solved")]
    for angles, dash, width in (
        (comparison.notch_angle, SOLID, 1.4),
        (comparison.measured_notch_angle, DOTTED, 2.4),
    ):
        for row, colour in zip(angles[points], sequence_colours(len(points)), strict=True):
            if np.isnan(row).any():
                continue
            line = outline(shape_from_angles(robot, row), view).centre_line
            items.append(Curve(line, colour, dash, width))
            if dash:
                items.append(dots(line[-1:], colour, 4.0))
    measured = any(isinstance(item, Curve) and item.dash == DOTTED for item in items)
    title = "centre lines: model –, measured ··•" if measured else "centre lines of the model"
    return Panel(
        items,
        "across the base [mm]",
        "along the base [mm]",
        title=title if points else "",
        equal=bool(points),
    )


def _representative_points(comparison: Comparison) -> list[int]:
    """Return points of the longest trial, evenly spread in total angle."""
    trial = np.array(comparison.measured.pull)
    longest = max(comparison.measured.pulls, key=lambda label: (trial == label).sum())
    candidates = np.flatnonzero((trial == longest) & comparison.converged)
    if not len(candidates):
        return []
    angle = comparison.total_angle[candidates]
    targets = np.linspace(angle.min(), angle.max(), SHAPES)
    nearest = (int(candidates[np.argmin(np.abs(angle - goal))]) for goal in targets)
    return list(dict.fromkeys(nearest))


def _errors(models: Mapping[str, Comparison]) -> Panel:
    """Return the tip error of every model as a bar, or of the total angle if no tip is known."""
    values = [one.rmse_tip for one in models.values()]
    label, title = "tip error [mm]", "tip error, rms"
    if np.isnan(values).all():
        values = [one.rmse_total * DEGREES for one in models.values()]
        label = f"total angle error [{QUANTITIES['total_angle'].unit}]"
        title = "error of the total angle, rms"
    colours = [colour for _, colour, _ in _styles(models)]
    most = 1.2 * max((value for value in values if value > 0.0), default=1.0)
    bars = Bars(values, list(models), colours)
    return Panel([bars], label, "", title=title, x_range=(0.0, most))
