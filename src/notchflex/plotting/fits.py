"""The pictures of models beside measurements: comparisons, fits and the friction rig."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from notchflex.plotting.curves import entry_label, evenly
from notchflex.plotting.marks import (
    DASH_DOT,
    DASHED,
    DOTTED,
    MARKERS,
    MIXED,
    SOLID,
    Area,
    Array,
    Curve,
    Mark,
    Note,
    Panel,
    Span,
    band,
    bar_panel,
    box,
    dots,
    grid,
    line,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes import project
from notchflex.plotting.style import (
    BLUE,
    GREY,
    MODEL_COLOURS,
    ORANGE,
    VERMILLION,
    diverging_colour,
    sequence_colours,
)
from notchflex.support import AXES, DEGREES, QUANTITIES

if TYPE_CHECKING:
    from notchflex.comparison import Comparison
    from notchflex.fit import Calibration, FrictionRig

_MODEL_LINES = (SOLID, DASHED, DASH_DOT, DOTTED, MIXED)
_AXIS_POINTS = 200  # of a centre line
_SIZES = {"column_width": 3.0, "row_height": 2.6}


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
    looks = zip(models, cycle(MODEL_COLOURS), cycle(_MODEL_LINES), strict=False)
    entries = [Curve([], colour, dash, name=name, layer=3) for name, colour, dash in looks]
    pulls = list(dict.fromkeys(comparison.measured.pull))
    trials = [
        dots([], GREY, 3.2, marker=marker, hollow=True,
             name=f"measured, trial {pull}" if len(pulls) > 1 else "measured")
        for pull, marker in zip(pulls, cycle(MARKERS), strict=False)
    ]  # fmt: skip
    measured_load = comparison.measured.measured_tension, comparison.measured.load.stroke
    x, x_label = _abscissa(*measured_load)
    trial, measured = np.array(comparison.measured.pull), _angles(comparison, "measured_")
    errors = [*comparison.rmse_notches, comparison.rmse_total]
    panels: list[Panel] = []
    for column, error in enumerate(errors):
        if np.isnan(measured[:, column]).all():
            continue
        points = np.stack([x, measured[:, column]], axis=1)
        items: list[Mark] = [
            replace(entry, points=points[trial == pull])
            for entry, pull in zip(trials, pulls, strict=True)
        ]
        for entry, model in zip(entries, models.values(), strict=True):
            computed = np.stack([x, _angles(model)[:, column]], axis=1)
            solved = np.flatnonzero(model.converged)
            runs = _runs(solved, x, trial, comparison.measured.from_rest)
            items += [replace(entry, points=computed[run]) for run in runs]
        name = f"notch {column + 1}" if column < len(errors) - 1 else "total"
        title = f"{name}, error {float(error) * DEGREES:.2f}° rms"
        panels.append(
            Panel(
                items,
                x_label,
                "angle [deg]",
                title=title,
                legend="",
                from_zero=True,
                shared="x",
            )
        )
    panels.append(_centre_lines(comparison))
    if others:
        panels.append(_errors(models, [entry.colour for entry in entries]))
    error = f"tip {comparison.rmse_tip:.2f} mm"
    if math.isnan(comparison.rmse_tip):
        error = f"total {comparison.rmse_total * DEGREES:.2f}°"
    title = f"{comparison.robot.name}: {error} rms over {comparison.points} points"
    cells = grid(panels, min(5, math.ceil(len(panels) / 2)))
    return Picture(title, cells, [*trials[: len(MARKERS)], *entries], **_SIZES)


def _angles(comparison: Comparison, prefix: str = "") -> Array:
    """Return the angles of the notches, and the total angle behind them, deg."""
    parts = [getattr(comparison, f"{prefix}{name}_angle") for name in ("notch", "total")]
    return np.column_stack(parts) * DEGREES


def _runs(rows: Any, x: Array, pull: Any, from_rest: bool) -> list[Any]:
    """Return the rows of each line of a model: all by load if from rest, else by pull."""
    if from_rest and len(rows):
        return [rows[np.argsort(x[rows], kind="stable")]]
    return [rows[pull[rows] == label] for label in dict.fromkeys(pull[rows].tolist())]


def _abscissa(tension: Any, stroke: Any) -> tuple[Array, str]:
    """Return the first tension or stroke that all rows have and that changes, and its label."""
    for name, values in (("tension", tension), ("stroke", stroke)):
        varied = np.isfinite(values).all(axis=0) & (np.ptp(values, axis=0) > 0.0)
        if varied.any():
            tendon = int(np.argmax(varied))
            entry = f"tendon {tendon + 1}" if len(varied) > 1 else ""
            return values[:, tendon], entry_label(QUANTITIES[name], entry)
    return np.arange(1.0, len(tension) + 1.0), "row [number]"


def _centre_lines(comparison: Comparison) -> Panel:
    """Return measured and computed centre lines at some points of the longest trial."""
    robot, trial = comparison.robot, np.array(comparison.measured.pull)
    longest = max(comparison.measured.pulls, key=lambda label: (trial == label).sum())
    solved = np.flatnonzero((trial == longest) & comparison.converged)
    points = solved[evenly(comparison.total_angle[solved], 6)]
    view, length = np.radians(robot.notches[0].direction_deg), robot.geometry.length
    items: list[Mark] = [] if len(points) else [Note("no point was solved")]
    title = "centre lines of the model" if len(points) else ""
    for point, colour in zip(points, sequence_colours(len(points)), strict=True):
        for angles, dash, width in (
            (comparison.notch_angle[point], SOLID, 1.4),
            (comparison.measured_notch_angle[point], DOTTED, 2.4),
        ):
            if np.isfinite(angles).all():
                shape = robot.geometry.shape(angles)
                centre = project(shape.axis(np.linspace(0.0, length, _AXIS_POINTS)), view)
                items.append(Curve(centre, colour, dash, width))
                if dash:
                    items.append(dots(centre[-1:], colour, 4.0))
                    title = "centre lines: model –, measured ··•"
    labels = "across the base [mm]", "along the base [mm]"
    return Panel(items, *labels, title=title, equal=len(points) > 0)


def _errors(models: Mapping[str, Comparison], colours: list[Any]) -> Panel:
    """Return the tip error of every model as a bar, or of the total angle if no tip is known."""
    values = np.array([model.rmse_tip for model in models.values()])
    label, title = "tip error [mm]", "tip error, rms"
    if np.isnan(values).all():
        values = np.array([model.rmse_total for model in models.values()]) * DEGREES
        label, title = "total angle error [deg]", "error of the total angle, rms"
    return bar_panel(values, list(models), label, colours=colours, title=title)


_MEASURED, _MODEL, _BAND, _END = "measured", "model", "band", "end of the interval"
_OTHERS = "residuals of others"

MAX_NOTCHES = 6
"""Of a robot with more notches some are drawn."""
MAX_NAMED = 8
"""Of so many notches a legend has the first and the last colour only."""

_NOTCHES = ("notch_angle", "edge_angle")
_MEANS = {"deg": "angle", "mm": "position", "N": "tension"}


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
    angles = fit.residuals.part[fit.residuals.are(*_NOTCHES)]
    shown = np.unique(angles).tolist()
    # The marker of every notch (from 0), the same for all robots.
    notches = {
        notch: dots([], colour, name=f"residuals of notch {notch + 1}")
        for notch, colour in zip(shown, sequence_colours(len(shown)), strict=True)
    }
    panels = [panel for label in fit.given for panel in _robot_panels(fit, label, notches)]
    panels += [_likelihood_panel(fit, name) for name in fit.intervals]
    if len(fit.names) > 1:
        panels.append(_correlation_panel(fit))
    measured = "measured, a kind of marker for each pull"
    named = list(notches.values())
    entries: list[Curve | Area] = [
        dots([], GREY, 4.0, hollow=True, name=measured, group=_MEASURED),
        Curve([], BLUE, name=_MODEL),
        Area([], BLUE, 0.25, name="95 % band of the model", group=_BAND),
        Curve([], VERMILLION, DASHED, 1.0, name="end of the 95 % interval", group=_END),
        *(named if len(named) < MAX_NAMED else [named[0], named[-1]]),
        dots([], GREY, 3.5, marker="X", name=_OTHERS),
    ]
    there = {mark.group or mark.name for panel in panels for mark in panel.items}
    legend = [entry for entry in entries if (entry.group or entry.name) in there]
    title = f"{', '.join(fit.given)}: {fit.counted} numbers"
    return Picture(title, grid(panels, min(4, len(panels))), legend, **_SIZES)


def _robot_panels(fit: Calibration, label: str, notches: Mapping[int, Curve]) -> Iterator[Panel]:
    """Yield every measured number of a robot over the load, some of many, and the residuals."""
    from notchflex.fit import OBSERVED, edge, part_title

    residuals, prefix = fit.residuals, f"{label}: " if len(fit.given) > 1 else ""
    of_robot = residuals.robot == list(fit.given).index(label)
    loads = [sample.measured.load for sample in fit.problem.samples.every]
    rows = list(zip(residuals.sample[of_robot], residuals.row[of_robot], strict=True))
    tension, stroke = (
        np.array([getattr(loads[sample], name)[row] for sample, row in rows])
        for name in ("tension", "stroke")
    )
    x = np.full(len(residuals), np.nan)
    x[of_robot], x_label = _abscissa(tension, stroke)
    for quantity in OBSERVED:
        if quantity == "axis_points":  # thirty points and more: only their residuals
            continue
        of_quantity, (name, unit, _) = of_robot & residuals.are(quantity), edge(quantity)
        parts = np.unique(residuals.part[of_quantity])
        for part in parts[evenly(range(len(parts)), MAX_NOTCHES)].tolist():
            title = part_title(quantity, 0 if quantity.startswith("total_") else part + 1)
            if quantity in ("tip_position", "tip_rotation"):
                title = f"{name}, {AXES[part]}"
            items = list(_data_marks(fit, quantity, of_quantity & (residuals.part == part), x))
            y_label = f"{_MEANS[unit]} [{unit}]"
            yield Panel(items, x_label, y_label, title=prefix + title, legend="")
    # A total angle that is the sum of the notches has no noise of its own and is not drawn.
    points = np.stack([x, residuals.values / fit.noise.deviation], axis=1)
    noisy, angles = of_robot & np.isfinite(fit.noise.deviation), residuals.are(*_NOTCHES)
    items: list[Mark] = [Span("y", -1.96, GREY, high=1.96, opacity=0.15), Span("y", 0.0, GREY)]
    others = dots(points[noisy & ~angles], GREY, 3.5, marker="X", name=_OTHERS, layer=1)
    of_notches = [
        replace(entry, points=points[noisy & angles & (residuals.part == notch)], layer=3)
        for notch, entry in notches.items()
    ]
    items += [mark for mark in (others, *of_notches) if len(mark.points)]
    title, y_label = f"{prefix}model less measured", "residual / its noise [-]"
    yield Panel(items, x_label, y_label, title=title, legend="")


def _data_marks(fit: Calibration, quantity: str, shown: Any, x: Array) -> Iterator[Mark]:
    """Yield some residuals of a quantity as measured, as model, and as the band of the model."""
    from notchflex.fit import edge

    residuals, (_, _, scale) = fit.residuals, edge(quantity)
    half = fit.half_width(residuals.slopes) * scale
    for number, sample in enumerate(fit.problem.samples.every):
        seen, of_sample = sample.measured, np.flatnonzero(shown & (residuals.sample == number))
        for rows in _runs(of_sample, x, residuals.pull, seen.from_rest):
            table = seen.observed[quantity].reshape(len(seen.pull), -1)
            measured = table[residuals.row[rows], residuals.part[rows]] * scale
            model = measured + residuals.values[rows] * scale
            if np.isfinite(half[rows]).all():
                ends = model - half[rows], model + half[rows]
                yield band(x[rows], *ends, BLUE, 0.25, group=_BAND)
            yield line(x[rows], model, BLUE, group=_MODEL, layer=3)
            for pull in dict.fromkeys(residuals.pull[rows].tolist()):
                of_pull = residuals.pull[rows] == pull
                name = f"{_MEASURED}, pull {seen.pull[residuals.row[rows][of_pull][0]]}"
                points = np.stack([x[rows], measured], axis=1)[of_pull]
                marker = MARKERS[pull % len(MARKERS)]
                yield dots(
                    points,
                    GREY,
                    3.2,
                    name=name,
                    group=_MEASURED,
                    layer=4,
                    marker=marker,
                    hollow=True,
                )


def _likelihood_panel(fit: Calibration, name: str) -> Panel:
    """Return the rise of twice the misfit over one constant, with all others optimal."""
    interval, level = fit.intervals[name], fit.allowed_rise(name)
    computed = interval.profile[np.isfinite(interval.profile[:, 1])]
    value, rise = computed.T
    # Interpolates the nearly linear signed roots.
    root = np.sqrt(rise) * np.sign(value - fit.values[name])
    x = np.linspace(value[0], value[-1], 200)
    ends = {"below": interval.lower, "above": interval.upper}
    items: list[Mark] = [
        Span("y", level, GREY, DOTTED, 1.2),
        line(x, np.interp(x, value, root) ** 2, BLUE),
        dots(computed, BLUE, group="profile", layer=3),
        *(
            Span("x", end, VERMILLION, DASHED, 1.0, group=_END)
            for end in ends.values()
            if end is not None
        ),
    ]
    if sides := [side for side, end in ends.items() if end is None]:
        items.append(Note(f"open {' and '.join(sides)}", (0.03, 0.95), VERMILLION, "left top"))
    return Panel(
        items,
        f"{_short(name)} [{fit.units[name] or '-'}]",
        "rise of 2 x misfit [-]",
        title=f"profile of constant {fit.names.index(name) + 1}, dotted: 95 %",
        y_range=(-0.03 * level, min(max(1.6 * level, 1.1 * rise.max()), 3.0 * level)),
    )


def _correlation_panel(fit: Calibration) -> Panel:
    """Return the correlation matrix of the constants."""
    label = "constants, numbered as their profiles"
    if not fit.intervals:
        label = "\n".join(f"{number}: {name}" for number, name in enumerate(fit.names, 1))
    count, items = len(fit.names), list[Mark]()
    numbers = [str(number + 1) for number in range(count)]
    for (row, column), value in np.ndenumerate(fit.correlation):
        x, y = column, count - 1 - row
        is_known, names = np.isfinite(value), f"{fit.names[row]}, {fit.names[column]}"
        colour = diverging_colour(value) if is_known else "white"
        items.append(Area([box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)], colour, 1.0, group=names))
        text, shade = f"{value:.2f}" if is_known else "-", "white" if abs(value) > 0.7 else "black"
        part = (x + 0.5) / count, (y + 0.5) / count
        items.append(Note(text, part, shade, size=min(8.0, 36.0 / count)))
    ticks = {"x": numbers, "y": numbers[::-1]}
    limits = (-0.5, count - 0.5)
    return Panel(items, label, "", title="correlation", ticks=ticks, x_range=limits, y_range=limits)


def _short(name: str) -> str:
    """Return a name, with the section on a line of its own if it is long."""
    head, dot, tail = name.rpartition(".")
    return f"{head}.\n{tail}" if dot and len(name) >= 24 else name


def friction_picture(rig: FrictionRig) -> Picture:
    """Describe the coefficients of all readings of the friction rig.

    Left over the wrap angle, right over the load: readings with their standard deviations where
    known, marked outliers, the estimate with its 95 % interval and the spread of the readings as
    bands, and the line of the alternative model if a constant does not fit.

    Args:
        rig: The estimate.

    Example:
        >>> import notchflex as nf
        >>> readings = nf.FrictionReadings([200.0, 300.0], [150.0, 221.0], [1.6, 1.6], [1.6, 1.6])
        >>> left, right = friction_picture(nf.friction_rig(readings)).cells
        >>> right.panel.x_label
        'weight 1 [g]'
    """
    readings, test = rig.readings, rig.constancy
    turn, load = readings.turn * DEGREES, readings.weight_1
    over_turn, over_load = _readings(rig, turn), _readings(rig, load)
    if test.enough is False:
        over_turn += _other_model(rig, turn, np.asarray, test.by_turn / DEGREES)
        over_load += _other_model(rig, load, np.log, test.by_load)
    label = r"coefficient of friction $\mu$ [-]"
    left = Panel(over_turn, "turn over both edges [deg]", label, legend="", shared="y")
    right = Panel(over_load, "weight 1 [g]", label, shared="y")
    return Picture(f"Coefficient of friction, {readings.source}", grid([left, right], 2))


def _readings(rig: FrictionRig, x: Array) -> list[Mark]:
    """Return the estimate and the readings, over what changed from reading to reading."""
    readings, mean = rig.readings, rig.coefficient
    items: list[Mark] = [
        Span("y", low, colour, high=high, opacity=opacity, name=name)
        for low, high, colour, opacity, name in (
            (mean - rig.spread, mean + rig.spread, GREY, 0.15, "spread of readings"),
            (*rig.interval, BLUE, 0.3, "95 % interval"),
        )
        if np.isfinite(low)
    ]
    items.append(Span("y", mean, BLUE, width=1.4, name=rf"$\mu$ = {mean:.4g}"))
    points = np.stack([x, readings.coefficient], axis=1)
    # A bar with a gap behind it for each reading; none where no deviation is known.
    half = np.multiply.outer(readings.coefficient_deviation, [-1.0, 1.0, np.nan])
    ends = (readings.coefficient[:, None] + half).ravel()
    items.append(line(np.repeat(x, 3), ends, "#333333", width=0.7, group="reading"))
    items.append(dots(points, "#333333", name="reading"))
    if rig.outliers:
        points = points[list(rig.outliers)]
        items.append(dots(points, VERMILLION, 8.0, hollow=True, name="outlier", layer=3))
    return items


def _other_model(rig: FrictionRig, x: Array, of: Any, slope: float) -> list[Mark]:
    """Return the alternative model, linear in a function of x, the other variable at its mean."""
    if not np.isfinite(slope):
        return []
    positions = np.linspace(x.min(), x.max(), 100)
    y = np.mean(rig.readings.coefficient) + slope * (of(positions) - np.mean(of(x)))
    return [line(positions, y, ORANGE, name="not constant", layer=3)]
