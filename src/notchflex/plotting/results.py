"""The pictures of computed results, one function for each.

Batches, sweeps, tolerances, workspaces; designs, fronts, followed targets, sensed forces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from notchflex import Batch, InputError
from notchflex.plotting.curves import TIP_LABELS, entry_label, entry_lines
from notchflex.plotting.marks import (
    BELOW,
    DASHED,
    SOLID,
    Area,
    Array,
    Colour,
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
    side_by_side,
    stack,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes import plane_of, project, shape_panel
from notchflex.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    MODEL_COLOURS,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    sequence_colours,
)
from notchflex.support import AXES, CORNERS, QUANTITIES, REGISTERED, described_at, nearest

if TYPE_CHECKING:
    from polars import LazyFrame

    from notchflex.control import Following
    from notchflex.designing import Design, DesignFront, WishResult
    from notchflex.fatigue import StrainCycle
    from notchflex.sensing import SensedForce
    from notchflex.sweeping import Sweep
    from notchflex.tolerancing import ToleranceAnalysis
    from notchflex.workspaces import Workspace


_LEFT_OUT = ("converged", "reason", "iterations", "tip_position", "stable")


def batch_picture(
    batch: Batch,
    *,
    against: ArrayLike | None = None,
    label: str = "row [number]",
    title: str = "batch",
) -> Picture:
    """Describe what a batch returned.

    A panel for every quantity with one number, or one for each tendon or notch, over the rows or
    over `against`; and the positions of the tips, if the batch has them. Of a batch of paths the
    last step of each is drawn. Rows that did not converge are gaps in the curves and red tips.

    Args:
        batch: What `solve_batch` or `simulate_batch` returned.
        against: Values for the horizontal axis, (rows,), such as tensions; row numbers if None.
        label: Label of this axis, with its unit.
        title: Heading.

    Raises:
        InputError: The number of values is not that of the rows, or there is nothing to draw.

    Example:
        >>> import numpy as np
        >>> import notchflex as nf
        >>> found = nf.solve_batch(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=20))
        >>> picture = batch_picture(found, against=np.linspace(0.0, 2.0, 20), label="tension [N]")
        >>> picture.cells[-1].panel.x_label
        'tip position x [mm]'
    """
    rows = len(next(iter(batch.values()), ()))
    x = np.arange(1.0, rows + 1.0) if against is None else np.asarray(against, float)
    if x.shape != (rows,):
        raise InputError.WRONG_SHAPE(
            f"the batch has {rows} rows, and against has the shape {x.shape}; give one value a row."
        )
    last: dict[str, Any] = {}  # of paths their last step
    for name, quantity in QUANTITIES.items():
        if name in batch:
            values = np.asarray(batch[name])
            last[name] = values[:, -1] if values.ndim > 1 + len(quantity.per) else values
    converged = last.get("converged", np.ones(rows)).astype(bool)
    order, panels = np.argsort(x, kind="stable"), list[Panel]()
    for name, values in last.items():
        quantity = QUANTITIES[name]
        if name in _LEFT_OUT or values.dtype.kind not in "fi" or values.ndim > 2:
            continue
        table = values.reshape(rows, -1) * quantity.scale
        table = np.where(converged[:, None], table, np.nan)[order]
        if np.isfinite(table).any():
            items = entry_lines(x[order], table, *quantity.per, width=0.8, marker="o", size=2.0)
            panels.append(Panel(items, label, quantity.label))
    if "tip_position" in last:
        tips = last["tip_position"][:, [0, 2]]
        items = [dots(tips[converged], BLUE, 2.5, group="tip")]
        if not converged.all():
            items.append(dots(tips[~converged], VERMILLION, 2.5, name="not converged"))
        panels.append(Panel(items, *TIP_LABELS, equal=True))
    if not panels:
        raise InputError.NO_DATA(
            "the batch holds nothing that can be drawn; ask for outputs such as total_angle, "
            "notch_angle or tip_position."
        )
    return Picture(title, grid(panels, min(3, len(panels))))


MAX_ROWS = 2000
"""Rows of a sweep that are drawn as dots; of more, an even selection."""

_BINS = 24
_MIN_PER_BIN = 20
"""A bin with fewer rows has no quantiles."""


def sweep_picture(sweep: Sweep, x: str, y: str) -> Picture:
    """Describe one column of a sweep over another.

    Rows as points, rejected ones in another colour; where there are many, the median and the band
    that holds 95 % of all of them, along x. Rows without a result lie on the axis of x.

    Args:
        sweep: The sweep.
        x: A variable or a kept quantity.
        y: Another one.

    Raises:
        InputError: There is no such column, or no row.
    """
    import polars

    frame = sweep.lazy()
    columns = [name for name in frame.collect_schema().names() if name != "code"]
    for name in (x, y):
        if name not in columns:
            raise InputError.UNKNOWN_NAME(
                f'the sweep has no column "{name}"{nearest(name, columns)}; there are '
                f"{', '.join(columns)}."
            )
    across, upward = (polars.col(name).cast(polars.Float64) for name in (x, y))
    numbers = across.alias("x"), upward.alias("y")
    curves, title = _quantiles(frame.select(numbers)), f"{sweep.plan.name}: {sweep.rows} rows"
    if sweep.rows > MAX_ROWS and sweep.plan.output.rows:
        # Every k-th row would be a regular part of a grid or of a Sobol sequence.
        frame = frame.filter(polars.col("row").hash() % -(-sweep.rows // MAX_ROWS) == 0)
    table = frame.select(polars.col("code").cast(str), *numbers).collect()
    code, *both = (column.to_numpy() for column in table)
    if len(table) < sweep.rows:
        title += f", {len(table)} drawn"
    both = np.column_stack(both)
    placed, is_finite = np.isfinite(both[:, 0]), np.isfinite(both).all(axis=1)
    if not placed.any():
        raise InputError.NO_DATA(f"no row has a number of {x}.")
    items: list[Mark] = [
        dots(points, colour, 1.6, name=name)
        for name, colour in (("accepted", BLUE), ("rejected", ORANGE))
        if len(points := both[is_finite & (code == name)])
    ]
    items += curves
    if len(lost := both[placed & ~is_finite]):
        lost[:, 1] = both[is_finite, 1].min() if is_finite.any() else 0.0
        items.append(dots(lost, VERMILLION, 4.0, name="no result", marker="X"))
    panel = Panel(items, sweep_label(sweep, x), sweep_label(sweep, y))
    return Picture(title, grid([panel], 1), column_width=5.4, row_height=4.2)


def _quantiles(rows: LazyFrame) -> list[Mark]:
    """Return the median and the band of 95 % in bins along x: one for each value if these are few.

    Otherwise as many rows are in each bin.
    """
    import polars

    x, y = polars.col("x"), polars.col("y")
    rows = rows.filter(x.is_finite() & y.is_finite())
    parts = np.linspace(0.0, 1.0, _BINS + 1).tolist()
    ends = rows.select(x.quantile(part).alias(f"{part}") for part in parts).collect().row(0)
    edges = polars.Series(sorted(set(ends) - {None}), dtype=polars.Float64)
    bins = (
        rows.group_by(polars.lit(edges).search_sorted(x, side="right").alias("bin"))
        .agg(
            x.median(),
            y.quantile(0.025, "linear").alias("low"),
            y.median(),
            y.quantile(0.975, "linear").alias("high"),
            polars.len().alias("count"),
        )
        .filter(polars.col("count") >= _MIN_PER_BIN)
        .sort("bin")
        .collect()
    )
    if len(bins) < 3:
        return []
    middle, low, half, high = (bins[name].to_numpy() for name in ("x", "low", "y", "high"))
    return [
        band(middle, low, high, BLUE, 0.15, name="95 % of rows", layer=3),
        line(middle, half, "black", name="median", layer=4),
    ]


def sweep_label(sweep: Sweep, name: str) -> str:
    """Return the label of the axis of a column of a sweep, with its unit."""
    if name in [variable.value for variable in sweep.plan.variable]:
        unit = described_at(sweep.robot, name).unit
        return f"{name} [{unit}]" if unit else name
    kept = [keep.quantity for keep in sweep.plan.keep if f"{name}_".startswith(f"{keep.quantity}_")]
    if not kept:
        return name
    quantity = REGISTERED[max(kept, key=len)]
    words = name.removeprefix(quantity.name).strip("_").split("_")
    entry = " ".join(
        word if axis == "axis" else f"{axis} {word}"
        for axis, word in zip(quantity.per, words, strict=False)
    )
    where = " ".join(words[len(quantity.per) + bool(quantity.unit) :])
    return ", ".join(filter(None, [entry_label(quantity, entry), where]))


MAX_LIMITS, MAX_BARS = 4, 12
"""Limits, and bars of dimensions, that are drawn of a tolerance analysis."""


def tolerance_picture(found: ToleranceAnalysis) -> Picture:
    """Describe what tolerances do to a robot.

    For every limit, of many those that reject most, the histogram of drawn robots with the limits,
    the value of the drawing and the worst case; bars of the parts of the variance, and of the yield
    if one dimension were exact.

    Args:
        found: The analysis.
    """
    outside, order = found.below + found.above, found.order[:MAX_BARS]
    shown = np.sort(np.argsort(-outside, kind="stable")[:MAX_LIMITS])
    panels = [_histogram(found, int(index)) for index in shown]
    worst, sources = int(np.argmax(outside)), [found.sources[index] for index in order]
    parts = np.nan_to_num(found.sobol.total[worst])[order]
    label = f"part of the variance of {found.criteria[worst].name.replace('_', ' ')} [-]"
    panels.append(bar_panel(parts, sources, label, title="total Sobol index"))
    levels = [(found.accepted_fraction, GREEN), (found.wanted_yield, PURPLE)]
    marks = [_level(100.0 * level, colour) for level, colour in levels if level is not None]
    exact, title = 100.0 * found.control.exact[order], "yield if one dimension were exact"
    panels.append(bar_panel(exact, sources, "yield [%]", marks, title=title))
    low, high = (100.0 * end for end in found.interval)
    title = (
        f"{found.robot.name}: yield {100.0 * found.accepted_fraction:.1f} % "
        f"({low:.1f} to {high:.1f} %) of {found.draws} robots"
    )
    legend: list[Curve | Area] = [
        Area([], BLUE, name="within the limits"),
        Area([], ORANGE, name="outside"),
        Curve([], VERMILLION, name="limit"),
        Curve([], GREEN, name="drawing; yield as it is"),
        Curve([], GREY, DASHED, name="worst case"),
    ]
    if found.wanted_yield is not None:
        legend.append(Curve([], PURPLE, name="wanted yield"))
    return Picture(title, grid(panels, min(3, len(panels))), legend)


def _level(level: float, colour: Colour) -> Span:
    return Span("x", level, colour, width=1.4, layer=4)


def _histogram(analysis: ToleranceAnalysis, index: int) -> Panel:
    limit = analysis.criteria[index]
    scale, unit = limit.quantity.scale, limit.quantity.unit
    edges, count = analysis.drawn.histogram(index, 60)
    edges, tops = edges * scale, 100.0 * count / analysis.draws
    label = limit.name.replace("_", " ") + (f" [{unit}]" if unit else "")
    if not len(count):
        return Panel([Note("no robot has a result")], label, "robots [%]")
    lower, upper = limit.lower * scale, limit.upper * scale
    bars = {"within": list[Array](), "outside": list[Array]()}
    for left, right, top in zip(edges, edges[1:], tops, strict=False):
        bars["within" if lower <= left and right <= upper else "outside"].append(
            box(left, 0.0, right, top)
        )
    items: list[Mark] = [
        Area(bars[name], colour, group=name)
        for name, colour in (("within", BLUE), ("outside", ORANGE))
    ]
    nominal = analysis.linear.nominal[index] * scale
    levels = (lower, VERMILLION), (upper, VERMILLION), (nominal, GREEN)
    items += [_level(level, colour) for level, colour in levels if np.isfinite(level)]
    for end in analysis.linear.worst_case[index] * scale:
        items.append(Span("x", end, GREY, DASHED, layer=3))
    return Panel(items, label, "robots [%]", from_zero=True)


MAX_POINTS = 4000
"""Tips that are drawn of one workspace; of more, an even selection."""

_CLASSES = 6
_LABELS: tuple[str, str, str] = ("x [mm]", "y [mm]", "z [mm]")


def workspace_picture(found: Workspace) -> Picture:
    """Describe a workspace.

    The convex hull and the tips in space, and below the voxels seen from the side (x or y, the
    wider, over z), coloured by tension, peak strain, error by hysteresis, dexterity and, where it
    was computed, stiffness.

    Args:
        found: The workspace.

    Raises:
        InputError: No state is left.

    Example:
        >>> import notchflex as nf
        >>> picture = workspace_picture(nf.workspace(nf.load_robot("pacheco2021-a"), states=512))
        >>> picture.cells[1].panel.title
        'largest tension [N]'
    """
    voxels, across = found.voxels(), int(np.ptp(found.extent[:, :2], axis=0).argmax())
    values = voxels.values
    maps = {
        "largest tension [N]": values["tension"],
        "peak strain [%]": 100.0 * values["strain"],
        "largest error by hysteresis [mm]": values["hysteresis"],
        "dexterity [% of directions]": 100.0 * voxels.dexterity,
        "softest stiffness of the tip [N/mm]": values["stiffness"],
    }
    panels = [_cloud(found, across)]
    for name, shown in maps.items():
        finite = np.isfinite(shown)
        if not finite.any():
            continue
        points, shown = voxels.centre[finite][:, [across, 2]], shown[finite]
        ends, items = np.linspace(shown.min(), shown.max(), _CLASSES + 1), list[Mark]()
        number = np.digitize(shown, ends[1:-1])
        for order, colour in enumerate(sequence_colours(_CLASSES)):
            if len(mine := points[number == order]):
                label = f"{ends[order]:.3g} to {ends[order + 1]:.3g}"
                group = f"{name} {order}"
                items.append(dots(mine, colour, 2.5, name=label, group=group, layer=2 + order))
        panels.append(Panel(items, _LABELS[across], _LABELS[2], title=name, equal=True))
    return Picture(f"Workspace of {found.robot.name}", grid(panels, 3))


def cycle_picture(cycle: StrainCycle) -> Picture:
    """Describe mean and amplitude of the strain at all points of all notches, and the limit line.

    Args:
        cycle: The strain cycle.
    """
    facts = cycle.limit.facts
    scales = 100.0 * np.where(CORNERS, cycle.corner_factor[:, None], 1.0)
    items: list[Mark] = []
    for number, (colour, scale) in enumerate(
        zip(sequence_colours(len(scales)), scales, strict=True)
    ):
        points = np.stack([scale * cycle.mean[number], scale * cycle.amplitude[number]], axis=-1)
        items.append(dots(points.reshape(-1, 2), colour, 3.0, name=f"notch {number + 1}"))
    if facts:
        mean, amplitude = (100.0 * np.array(facts[key]) for key in ("mean", "amplitude"))
        name = f"limit line {cycle.limit.line or ''}".rstrip()
        items.append(line(mean, amplitude, VERMILLION, width=2.0, name=name))
        # A mean in compression counts by its size.
        items.append(line(-mean, amplitude, VERMILLION, DASHED, group=name))
    panel = Panel(items, "mean strain [%]", "strain amplitude [%]", from_zero=True)
    return Picture(f"Strain cycle of {cycle.robot.name}", grid([panel], 1))


def workspaces_picture(found: Mapping[str, Workspace]) -> Picture:
    """Describe several workspaces in the same axes, seen from the front and from the side.

    Args:
        found: Workspaces by label.
    """
    panels: list[Panel] = []
    flat = all(np.ptp(workspace.extent[:, 1]) < 1e-9 for workspace in found.values())
    for across in (0,) if flat else (0, 1):
        items: list[Mark] = []
        for (label, workspace), colour in zip(found.items(), MODEL_COLOURS, strict=False):
            name = f"{label}: convex hull {workspace.hull.size:.3g} {workspace.hull.unit}"
            points = workspace.tip[_thinned(workspace)][:, [across, 2]]
            items.append(dots(points, colour, 2.0, name=name))
        legend = BELOW if across or flat else ""
        panels.append(Panel(items, _LABELS[across], _LABELS[2], equal=True, legend=legend))
    *others, last = found
    title = f"Workspaces of {', '.join(others)} and {last}"
    return Picture(title, grid(panels, 2), column_width=5.0, row_height=5.0)


def _thinned(workspace: Workspace) -> slice:
    """Return which tips are drawn: an even selection."""
    return slice(None, None, -(-len(workspace) // MAX_POINTS))


def _cloud(workspace: Workspace, across: int) -> Panel:
    """Return the tips and their convex hull: in space, or in the plane that holds them."""
    hull, some = workspace.hull, _thinned(workspace)
    axes = [0, 1, 2] if hull.dimension == 3 else [across, 2]
    tips, rising = workspace.tip[some][:, axes], workspace.loading[some]
    items: list[Mark] = [
        dots(tips[rising], BLUE, 1.5, name="loading"),
        dots(tips[~rising], ORANGE, 1.5, name="unloading"),
    ]
    if hull.dimension == 3:
        # Some corners alone, one for each cell of a coarse grid: all of them are too many lines.
        cells = np.round(hull.corners / (0.1 * np.ptp(hull.corners, axis=0)))
        few = ConvexHull(hull.corners[np.unique(cells, axis=0, return_index=True)[1]])
        gap = np.full((len(few.simplices), 1, 3), np.nan)
        edges = np.concatenate([few.points[few.simplices], gap], axis=1).reshape(-1, 3)
        items.append(Curve(edges, SKY, width=0.5, name="convex hull"))
    elif hull.dimension == 2:
        ring = np.concatenate([hull.corners, hull.corners[:1]])[:, axes]
        items.append(Curve(ring, SKY, width=1.0, name="convex hull"))
    title = f"convex hull {hull.size:.3g} {hull.unit}"
    return Panel(items, *(_LABELS[axis] for axis in axes), title=title, equal=True)


_BEFORE, _AFTER = GREY, BLUE
MAX_VALUES = 12
"""Variables of a design that are drawn."""


def design_picture(design: Design) -> Picture:
    """Describe a design: the robot at up to three states, before and after, and its variables.

    Args:
        design: The design.
    """
    from notchflex.designing import target_points

    shapes: list[Panel] = []
    for label, path, colour in (
        ("before", design.path_before, _BEFORE),
        ("designed", design.path, _AFTER),
    ):
        if path is not None and path.converged.any():
            steps = [step for step in design.state_steps.values() if path.converged[step]][-3:]
            panel = shape_panel(path, steps, title=label, colours=[colour] * 3, legend=BELOW)
            view, items = plane_of(path), [*panel.items]
            for curve in design.spec.curve:  # the points that the robot was designed for
                points = target_points(curve)
                points = points if view is None else project(points, view)
                items.append(dots(points, VERMILLION, 2.5, name=f"curve {curve.name}", layer=40))
            shapes.append(replace(panel, items=items))
    numbers = [_numbers(wish) for wish in design.wishes if len(wish.achieved) > 1][:1]
    cells = side_by_side([*([shape] for shape in shapes), [_variables(design), *numbers]])
    return Picture(f"{design.spec.name}: {design.before.name}", cells)


def _variables(design: Design) -> Panel:
    """Position of each variable between its limits."""
    chosen = design.variables[:MAX_VALUES]
    if not chosen:
        return Panel([Note("no variables")], "", "", title="variables")
    after, before = np.transpose(
        [(np.array([v.value, v.before]) - v.lower) / (v.upper - v.lower) for v in chosen]
    )
    names = [f"{v.name}\n{v.value:.4g} {v.unit}".rstrip() for v in chosen]
    # The values before stand below the bars, clear of the numbers at their ends.
    circles = line(before[::-1], np.arange(len(chosen)) - 0.38, BLACK, None, marker="o", size=4.0)
    extra = [Span("x", 1.0, BLACK), replace(circles, hollow=True, layer=4)]
    label = "from least (0) to greatest (1) value; circle: before"
    return bar_panel(after, names, label, extra, title="variables", x_range=(0.0, 1.15))


def _numbers(wish: WishResult) -> Panel:
    """The numbers of a wish that has several, before and after."""
    number = np.arange(1.0, len(wish.achieved) + 1.0)
    items: list[Mark] = [
        line(number, values, colour, marker="o", name=name)
        for values, colour, name in (
            (wish.before, _BEFORE, "before"),
            (wish.achieved, _AFTER, "designed"),
        )
        if len(values) == len(number)
    ]
    label = wish.title + (f" [{wish.unit}]" if wish.unit else "")
    return Panel(items, "number", label, title=wish.asked, whole="x")


def front_picture(front: DesignFront) -> Picture:
    """Describe a front: every objective over the first, points numbered by the first.

    Args:
        front: The front.
    """
    values, titles = front.objectives, front.titles
    several = values.shape[1] > 2
    pairs = [(0, 1), (0, 2), (1, 2)] if several else [(0, 1)]
    dash = None if several else SOLID
    panels = [
        Panel([Curve(values[:, [x, y]], BLUE, dash, marker="o")], titles[x], titles[y])
        for x, y in pairs
    ]
    name = f"{front.spec.name}: {len(front.points)} robots"
    return Picture(name, grid(panels, len(panels)), row_height=3.8)


_NUMBER, _READING = "target [number]", "reading [number]"


def following_picture(found: Following, *, title: str = "") -> Picture:
    """Describe targets that were followed.

    Left the path of the tip with the target positions; right the tension of every tendon over the
    targets, and how far each target was missed.

    Args:
        found: The result of `notchflex.follow`.
        title: Heading; the name of the robot where not given.

    Example:
        >>> import notchflex as nf
        >>> found = nf.follow(nf.load_robot("pacheco2021-a"), [(2.1, 0, 9.5), (2.4, 0, 9.3)])
        >>> [cell.panel.y_label for cell in following_picture(found).cells][1]
        'tendon tension $T$ [N]'
    """
    number = np.arange(1.0, len(found) + 1.0)
    tension = entry_lines(number, found.tension, "tendon")
    drives = Panel(tension, _NUMBER, QUANTITIES["tension"].label, shared="x")
    cells = side_by_side([[_tips(found)], [drives, _errors(found, number)]])
    return Picture(title or f"Targets followed by {found.robot.name}", cells, row_height=2.3)


def _tips(following: Following) -> Panel:
    """Positions of the tip and targets, in a plane if they lie in one."""
    tips, goals = following.path.tip_position, following.targets.values.get("tip_position")
    spread = np.ptp(tips, axis=0)[:2]  # below 1e-6 mm it is rounding
    axes = [axis for axis in range(3) if axis != np.argmin(spread) or spread.min() >= 1e-6]
    via = np.setdiff1d(np.arange(len(tips)), following.step)
    missed = following.tip_position[~following.reached]
    items: list[Mark] = [Curve(tips[:, axes], BLUE, name="tip")]
    for points, colour, name, style in (
        (goals, GREY, "target", {"size": 4.0, "hollow": True, "layer": 1}),
        (tips[via], ORANGE, "overshoot", {"layer": 3}),
        (missed, VERMILLION, "nearest", {"size": 4.0, "layer": 4}),
    ):
        if points is not None and len(points):
            items.append(dots(points[:, axes], colour, name=name, **style))
    if len(axes) == 2:
        x_label, y_label = (f"tip position {AXES[axis]} [mm]" for axis in axes)
        return Panel(items, x_label, y_label, equal=True, legend=BELOW)
    # In space the labels stand close to each other, and the upright one needs room beside it.
    return Panel(items, *_LABELS)


def _errors(following: Following, number: Array) -> Panel:
    items: list[Mark] = []
    for unit, error, tolerance, colour in (
        ("mm", following.error_mm, following.tolerance, BLUE),
        ("deg", following.error_deg, np.degrees(following.angle_tolerance), ORANGE),
    ):
        if unit in following.units:  # zero has no place on a logarithmic axis
            error, level = np.log10(np.maximum(error, 1e-16)), np.log10(max(tolerance, 1e-16))
            name = f"error, {unit}"
            items.append(line(number, error, colour, marker="o", size=2.0, name=name))
            items.append(Span("y", float(level), GREY, name=f"tolerance, {unit}"))
    return Panel(items, _NUMBER, "log10 of the error [mm, deg]", shared="x")


def sensed_picture(sensed: SensedForce, *, truth: Any = None) -> Picture:
    """Describe a sensed force along its readings, with the readings below.

    A panel for every component: the force, the interval that noise and stuck friction leave, the
    part of it by noise alone, and readings that show contact; below tensions and strokes.

    Args:
        sensed: The force.
        truth: The true components, N, (s, d), of a simulated history.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> touched = nf.simulate(wrist, nf.pull(0.1, 0.4, steps=3).loaded(tip_force=(0.02, 0, 0)))
        >>> picture = sensed_picture(nf.sense(wrist, touched.tension, touched.stroke))
        >>> picture.cells[0].panel.y_label
        'force along x [N]'
    """
    x = np.arange(1.0, len(sensed) + 1.0)
    panels: list[Panel] = []
    for which, name in enumerate(sensed.components):
        force, low, high = sensed.force[:, which], sensed.low[:, which], sensed.high[:, which]
        spread = np.minimum(1.96 * sensed.deviation[:, which], sensed.largest)
        marks: list[Mark] = [
            band(x, low, high, ORANGE, 0.3, name="noise and stuck friction"),
            band(x, force - spread, force + spread, BLUE, 0.25, name="noise alone, to first order"),
            line(x, force, BLUE, name="sensed", marker="o"),
        ]
        if truth is not None:
            marks.append(line(x, np.asarray(truth)[:, which], BLACK, DASHED, name="true"))
        if sensed.contact.any():
            points = np.stack([x, force], axis=1)[sensed.contact]
            marks.append(dots(points, GREEN, 5.0, name="contact shown", layer=5))
        panels.append(Panel(marks, _READING, f"force along {name} [N]", whole="x"))
    if sensed.path is not None:  # the best history
        tension = sensed.path.tension[sensed.group[sensed.converged]]
        items = entry_lines(x[: len(tension)], tension, "tendon", marker="o")
        panels.append(Panel(items, _READING, QUANTITIES["tension"].label, whole="x"))
    where = "the tip" if sensed.place is None else f"body {sensed.place}"
    title = f"Force on {where} of {sensed.robot.name}"
    return Picture(title, stack(panels), column_width=6.4, row_height=2.5)
