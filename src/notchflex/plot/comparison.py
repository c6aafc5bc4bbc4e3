"""Measured angles over the lines of the model, centre lines, and models beside each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from notchflex.plot.bent import bent_by_angles
from notchflex.plot.outline import outline
from notchflex.plot.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    house_style,
    new_figure,
    sequence_colours,
)
from notchflex.results.quantities import DEGREES, QUANTITIES

if TYPE_CHECKING:
    from notchflex.compare import Comparison

MODEL_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
MODEL_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)))
TRIAL_MARKERS = "osD^vP*X"
SHAPES = 6


def comparison_figure(
    comparison: Comparison, others: Mapping[str, Comparison] | None = None
) -> Figure:
    """Draw a comparison: every notch, the total angle, the centre lines, and the errors.

    Measured points are open markers, one kind for each trial; lines are the model. Centre lines
    are those of the measured angles (dots) and of the model (lines) at points of one trial.

    Args:
        comparison: The model beside its measurement.
        others: Label to comparison of other models with the same measurement, drawn with it.

    Returns:
        The figure; `notchflex.plot.save` writes it.
    """
    models = {"model": comparison, **(others or {})}
    panels = comparison.robot.number_of_notches + 2 + (1 if others else 0)
    columns = min(5, math.ceil(panels / 2))
    rows = math.ceil(panels / columns)
    measured = comparison.measured
    with house_style():
        figure = new_figure(2.9 * columns, 2.7 * rows, f"{comparison.robot.name}: {_title(models)}")
        grid = figure.add_gridspec(rows, columns)
        cells = iter(grid[row, column] for row in range(rows) for column in range(columns))
        x, x_label = _abscissa(comparison)
        first: Axes | None = None
        for title, given, pick, rmse in _angle_panels(comparison):
            axes = figure.add_subplot(next(cells), sharex=first)
            first = first or axes
            _draw_points(axes, x, given * DEGREES, measured.trial)
            for colour, line, one in zip(
                MODEL_COLOURS * 9, MODEL_LINES * 9, models.values(), strict=False
            ):
                for part in _lines(one, x):
                    axes.plot(
                        x[part], pick(one)[part] * DEGREES, color=colour, linestyle=line, zorder=3
                    )
            axes.set_title(f"{title}, error {rmse * DEGREES:.2f}° rms", loc="left")
            axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            axes.set_xlabel(x_label)
            axes.set_ylabel(f"angle [{QUANTITIES['notch_angle'].unit}]")
        _draw_centre_lines(figure.add_subplot(next(cells)), comparison)
        if others:
            _draw_errors(figure.add_subplot(next(cells)), models)
        _legend(figure, models, measured.trial)
    return figure


def _title(models: Mapping[str, Comparison]) -> str:
    one = next(iter(models.values()))
    return f"tip {one.tip_rmse:.2f} mm rms over {one.points} points"


def _angle_panels(comparison: Comparison) -> Iterator[tuple[str, NDArray[np.float64], Any, float]]:
    """Yield title, measured values, a picker of the model's values, and the error of each panel."""
    measured = comparison.measured
    for notch in range(comparison.robot.number_of_notches):

        def pick(one: Comparison, notch: int = notch) -> NDArray[np.float64]:
            return one.notch_angle[:, notch]

        error = float(comparison.rmse_notches[notch])
        yield f"notch {notch + 1}", measured.notch_angle[:, notch], pick, error
    yield "total", measured.total_angle, lambda one: one.total_angle, comparison.rmse_total


def _abscissa(comparison: Comparison) -> tuple[NDArray[np.float64], str]:
    """Return what was done to the first tendon that was measured, and the label of its axis."""
    measured = comparison.measured
    for name, values in (("tension", measured.tension), ("stroke", measured.stroke)):
        there = ~np.isnan(values).all(axis=0)
        if there.any():
            return values[:, int(np.argmax(there))], QUANTITIES[name].label
    raise AssertionError("a measurement has a tension or a stroke")


def _lines(comparison: Comparison, x: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Return the points of each line of the model: all by load from rest, or trial by trial."""
    good = np.flatnonzero(comparison.converged)
    if comparison.from_rest:
        return [good[np.argsort(x[good], kind="stable")]]
    trial = np.array(comparison.measured.trial)
    return [good[trial[good] == label] for label in dict.fromkeys(comparison.measured.trial)]


def _draw_points(
    axes: Axes, x: NDArray[np.float64], y: NDArray[np.float64], trial: tuple[str, ...]
) -> None:
    labels = np.array(trial)
    for index, label in enumerate(dict.fromkeys(trial)):
        there = labels == label
        axes.plot(
            x[there],
            y[there],
            linestyle="",
            marker=TRIAL_MARKERS[index % len(TRIAL_MARKERS)],
            markersize=3.2,
            markerfacecolor="none",
            markeredgecolor=GREY,
            markeredgewidth=0.8,
        )


def _draw_centre_lines(axes: Axes, comparison: Comparison) -> None:
    """Draw measured and computed centre lines at some points of the longest trial."""
    measured, robot = comparison.measured, comparison.robot
    view = np.radians(robot.notches[0].direction_deg)
    points = _telling_points(comparison)
    colours = sequence_colours(len(points))
    if not points:
        axes.text(0.5, 0.5, "no point was solved", transform=axes.transAxes, ha="center")
        return
    for angles, style in ((comparison.notch_angle, "-"), (measured.notch_angle, (0, (1, 1.2)))):
        for row, colour in zip(angles[points], colours, strict=True):
            line = outline(bent_by_angles(robot, row), view).centre_line
            axes.plot(
                *line.T, color=colour, linestyle=style, linewidth=1.4 if style == "-" else 2.4
            )
            if style != "-":
                axes.plot(*line[-1], "o", color=colour, markersize=4.0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("centre lines: model –, measured ··•", loc="left")
    axes.set_xlabel("across the base [mm]")
    axes.set_ylabel("along the base [mm]")


def _telling_points(comparison: Comparison) -> list[int]:
    """Return points of the longest trial, evenly spread in total angle."""
    trial = np.array(comparison.measured.trial)
    longest = max(
        dict.fromkeys(comparison.measured.trial), key=lambda label: (trial == label).sum()
    )
    candidates = np.flatnonzero((trial == longest) & comparison.converged)
    if not len(candidates):
        return []
    angle = comparison.measured.total_angle[candidates]
    wanted = np.linspace(angle.min(), angle.max(), SHAPES)
    nearest = (int(candidates[np.argmin(np.abs(angle - goal))]) for goal in wanted)
    return list(dict.fromkeys(nearest))


def _draw_errors(axes: Axes, models: Mapping[str, Comparison]) -> None:
    """Draw the tip error of every model as a bar, with its number."""
    values = [one.tip_rmse for one in models.values()]
    places = np.arange(len(values))
    bars = axes.barh(places, values, color=[MODEL_COLOURS[i % 5] for i in places], height=0.6)
    axes.bar_label(bars, fmt="%.2f", padding=3, fontsize=8.0)
    axes.set_yticks(places, list(models))
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.2 * max((v for v in values if v > 0.0), default=1.0))
    axes.grid(visible=False, axis="y")
    axes.set_title("tip error, rms", loc="left")
    axes.set_xlabel("mm")


def _legend(figure: Figure, models: Mapping[str, Comparison], trial: tuple[str, ...]) -> None:
    from matplotlib.lines import Line2D

    trials = list(dict.fromkeys(trial))
    entries = [
        Line2D(
            [],
            [],
            linestyle="",
            marker=TRIAL_MARKERS[index % len(TRIAL_MARKERS)],
            markerfacecolor="none",
            markeredgecolor=GREY,
            markersize=4.0,
            label=f"measured, trial {label}" if len(trials) > 1 else "measured",
        )
        for index, label in enumerate(trials[: len(TRIAL_MARKERS)])
    ]
    entries += [
        Line2D([], [], color=colour, linestyle=line, label=label)
        for colour, line, label in zip(MODEL_COLOURS * 9, MODEL_LINES * 9, models, strict=False)
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=min(8, len(entries)))
