"""The pictures of paths, states and robots, and the usual one of anything that can be drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from notchflex import Band, Equilibrium, EquilibriumPath, InputError, Robot
from notchflex.plotting.curves import (
    LINE,
    LOADING,
    NOTCH_LABEL,
    SLACK,
    TIP_LABELS,
    UNLOADING,
    abscissa,
    branch_lines,
    evenly,
    failures,
    notches_panel,
    path_panels,
    quantities_panel,
    scaled,
    span_line,
    span_panel,
    steps_by_branch,
    total_panel,
)
from notchflex.plotting.fits import calibration_picture, comparison_picture, friction_picture
from notchflex.plotting.marks import (
    BELOW,
    Colour,
    Curve,
    Mark,
    Note,
    Panel,
    dots,
    line,
    side_by_side,
    stack,
)
from notchflex.plotting.output import Picture
from notchflex.plotting.results import (
    batch_picture,
    cycle_picture,
    design_picture,
    following_picture,
    front_picture,
    sensed_picture,
    tolerance_picture,
    workspace_picture,
)
from notchflex.plotting.shapes import (
    load_label,
    representative_steps,
    robot_shape,
    shape_panel,
    state_shape,
)
from notchflex.plotting.style import (
    BLACK,
    BLUE,
    GREY,
    MODEL_COLOURS,
    VERMILLION,
    house_style,
    pale,
    sequence_colours,
)
from notchflex.plotting.with_matplotlib import draw_panel, figure_of, projection
from notchflex.support import MOVING, QUANTITIES, check_picture, replacing

MAX_TENDONS = 8
"""Tendons of one state whose tension is drawn."""


def path_figure(path: EquilibriumPath, *, title: str | None = None) -> Figure:
    """Draw a solved path with matplotlib; see `path_picture` for the arguments.

    Example:
        >>> import notchflex as nf
        >>> from notchflex.plotting import path_figure
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=5).release())
        >>> len(path_figure(path).axes)
        6
    """
    return path_picture(path, title=title).figure()


def path_picture(
    path: EquilibriumPath, *, title: str | None = None, bands: Mapping[str, Band] | None = None
) -> Picture:
    """Describe the picture of a solved path, for paper and for a browser.

    The robot to scale at up to five loads: in its plane of bending, or in space if it bends in
    several planes or a load leaves the plane. Arrows are external loads. A path of more than one
    step has curves: the total angle, the angle and the peak strain of every notch with the allowed
    strain, and the tension over the stroke where strokes are prescribed. A path with loading and
    unloading shows the shapes of both, the tension along the tendon, and the contacts with
    reversed friction if the reversal takes several steps.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.
        bands: Bands of tolerances by quantity, shaded behind angles and strains.
    """
    ways = steps_by_branch(path)
    if len(ways) > 1:
        shapes = [
            shape_panel(path, representative_steps(path, among=ways[way]), title=way)
            for way in (LOADING, UNLOADING)
        ]
    else:
        shapes = [shape_panel(path, representative_steps(path))]
    panels = path_panels(path, bands) if len(path) > 1 else []
    # The shapes one above the other in the first column, the curves column by column beside them.
    rows = 3 if len(panels) > 4 else 2
    cells = stack(shapes, height=2 * rows // len(shapes))
    for start in range(0, len(panels), rows):
        cells += stack(panels[start : start + rows], 1 + start // rows, 2)
    heading = path.robot.name if title is None else title
    return Picture(heading, cells, row_height=1.5)


def state_picture(path: EquilibriumPath, step: int, *, title: str | None = None) -> Picture:
    """Describe the picture of one state of a path.

    The robot to scale with its loads, the angle of every notch with closed notches marked, and the
    tension of every pulled tendon from span to span.

    Args:
        path: Solved path.
        step: Index of the step, from 0.
        title: Heading; the name of the robot if None.
    """
    angles: list[Mark] = [Note("not converged")]
    tensions: list[Mark] = [Note("not converged")]
    if path.converged[step]:
        angles = [curve := _angle_curve(path, step, BLUE, size=4.0)]
        if np.any(closed := np.asarray(path.closed[step])):
            angles.append(dots(curve.rows[closed], VERMILLION, 5.0, name="closed notch", layer=3))
        pulled = np.flatnonzero(path.tension[step] > SLACK)[:MAX_TENDONS].tolist()
        tensions = [] if pulled else [Note("all tendons are slack")]
        for tendon, colour in zip(pulled, sequence_colours(len(pulled)), strict=True):
            name = f"tendon {tendon + 1}" if path.tension.shape[1] > 1 else ""
            tensions.append(span_line(path, step, tendon, colour, size=2.2, name=name))
    cells = side_by_side([[state_shape(path, step)], [_notches_of(angles), span_panel(tensions)]])
    return Picture(path.robot.name if title is None else title, cells)


def _angle_curve(path: EquilibriumPath, step: int, colour: Colour, **style: Any) -> Curve:
    """Return the angle of every notch in one state, base to tip."""
    angle = scaled(path, "notch_angle", path.notch_angle)[step]
    return line(np.arange(1, len(angle) + 1), angle, colour, marker="o", **style)


def _notches_of(items: list[Mark], **options: Any) -> Panel:
    return Panel(items, NOTCH_LABEL, QUANTITIES["notch_angle"].label, whole="x", **options)


def beside_picture(paths: Mapping[str, EquilibriumPath], *, title: str = "") -> Picture:
    """Describe several solved paths: different robots, or different models of one robot.

    Every robot to scale at a few loads, in the colour of its curves: total angle and position of
    the tip over the loads, and for the most bent state the angle of every notch and the tension
    along the first pulled tendon. Solid lines are loading, dashed ones unloading.

    Args:
        paths: Label to path, two to five of them.
        title: Heading.

    Raises:
        InputError: Too few or too many paths.

    Example:
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> loop = nf.pull(0.0, 2.0, steps=5).release()
        >>> slick = wrist.with_value("friction.coefficient", 0.0)
        >>> paths = {"mu 0.13": nf.simulate(wrist, loop), "mu 0": nf.simulate(slick, loop)}
        >>> [cell.panel.title for cell in beside_picture(paths).cells[:2]]
        ['mu 0.13', 'mu 0']
    """
    if not 2 <= len(paths) <= len(MODEL_COLOURS):
        raise InputError.OUT_OF_RANGE(
            f"a picture shows 2 to {len(MODEL_COLOURS)} robots beside each other; got {len(paths)}."
        )
    shapes: list[Panel] = []
    total, tips, angles, tensions = (list[Mark]() for _ in range(4))
    labels, total_label = set[str](), QUANTITIES["total_angle"].label
    for (name, path), colour in zip(paths.items(), MODEL_COLOURS, strict=False):
        steps = representative_steps(path, most=3)
        shades = [pale(colour, part) for part in np.linspace(0.45, 1.0, len(steps))]
        shapes.append(shape_panel(path, steps, title=name, colours=shades, legend=BELOW))
        x, label = abscissa(path)
        labels.add(label)
        angle = scaled(path, "total_angle", path.total_angle)[:, 0]
        total += [*branch_lines(path, x, angle, colour, "", group=name), *failures(path, x)]
        tip = path.tip_position[:, [0, 2]]
        tips += branch_lines(path, tip[:, 0], tip[:, 1], colour, "", group=name)
        for step in steps[-1:]:  # the most bent
            tips.append(dots(tip[[step]], colour, 4.0, group=name))
            angles.append(_angle_curve(path, step, colour, group=name))
            pulled = np.flatnonzero(path.tension[step] > SLACK)[:1].tolist()
            tensions += [span_line(path, step, tendon, colour, group=name) for tendon in pulled]
    # One label for all, if they are drawn against the same quantity.
    x_label = labels.pop() if len(labels) == 1 else "load of each"
    bent = "most bent state"
    notches = angles or [Note("no step was solved")]
    tension = span_panel(tensions or [Note("no tendon is pulled")])
    columns = [
        *([shape] for shape in shapes),
        [Panel(total, x_label, total_label), _notches_of(notches, title=bent, from_zero=True)],
        [Panel(tips, *TIP_LABELS, equal=True), replace(tension, title=f"{bent}, first tendon")],
    ]
    legend = [
        Curve([], colour, name=name) for name, colour in zip(paths, MODEL_COLOURS, strict=False)
    ]
    if any(len(steps_by_branch(path)) > 1 for path in paths.values()):
        legend += [Curve([], GREY, LINE[way], name=way) for way in (LOADING, UNLOADING)]
    heading = title or "; ".join(dict.fromkeys(path.robot.name for path in paths.values()))
    return Picture(heading, side_by_side(columns), legend, column_width=3.7)


MAX_FRAMES = 48
"""Steps of a long path that are shown."""

DOTS_PER_INCH = 80

SECONDS, STANDING_SECONDS = 4.2, 0.9
"""Shortest duration of the whole, and of the first and the last frame [s]."""


def save_animation(
    path: EquilibriumPath,
    target: str | FilePath,
    *,
    title: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a path as a GIF: the robot moves, and dots run along its curves.

    It takes four seconds or more; the first and the last frame are shown longer.

    Args:
        path: Solved path; of a long one an even selection of steps is shown.
        target: Name of a file that ends in .gif; it is written completely or not at all.
        title: Heading; the name of the robot if None.
        progress: Called with the number of finished frames and of all frames.

    Raises:
        InputError: Another suffix, nothing to show, or the file cannot be written.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=3).release())
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     save_animation(path, f"{folder}/loop.gif")
    """
    check_picture(str(target), "the animation", kinds=MOVING)
    steps = frames_of(path)
    if len(steps) < 2:
        raise InputError.TOO_FEW_DATA(
            f"an animation needs two steps that were solved; this path has {len(steps)}. "
            "Draw a picture instead."
        )
    # Legends would jump, as they change from frame to frame.
    widest = shape_panel(path, representative_steps(path), title=" ", legend="")
    panels = [total_panel(path), notches_panel(path)]
    heading = path.robot.name if title is None else title
    figure = figure_of(Picture(heading, side_by_side([[widest], panels])))
    figure.draw_without_rendering()  # arranges the axes, once for all frames
    figure.set_layout_engine("none")
    robot, *curves = figure.axes
    limits = {f"{name}_range": getattr(robot, f"get_{name}lim")() for name in widest.axes}
    balls = [axes.plot([], [], "o", color=BLACK, markersize=5.0, zorder=9)[0] for axes in curves]
    x = abscissa(path)[0]
    heights = [scaled(path, name, getattr(path, name)) for name in ("total_angle", "notch_angle")]
    # A frame lasts longer if there are fewer; the first and the last one last several.
    frame = min(max(0.1, SECONDS / 1.5 / len(steps)), 0.4)
    rest = SECONDS - (len(steps) - 2) * frame
    standing = math.ceil(max(STANDING_SECONDS, rest / 2.0) / frame)
    writer = PillowWriter(fps=1.0 / frame)  # pyright: ignore[reportArgumentType]
    with (
        replacing(target) as temporary,
        house_style(),
        writer.saving(figure, str(temporary), DOTS_PER_INCH),
    ):
        for number, step in enumerate(steps):
            panel = shape_panel(path, [step], colours=[BLUE], legend="")
            robot.clear()
            draw_panel(robot, replace(panel, title=load_label(path, step), **limits))
            for ball, height in zip(balls, heights, strict=True):
                ball.set_data(np.full(height.shape[1], x[step]), height[step])
            for _ in range(standing if number in (0, len(steps) - 1) else 1):
                writer.grab_frame()
            if progress:
                progress(number + 1, len(steps))


def frames_of(path: EquilibriumPath) -> list[int]:
    """Return an even selection of the converged steps, with the first and the last."""
    solved = np.flatnonzero(np.asarray(path.converged))
    return solved[evenly(range(len(solved)), MAX_FRAMES)].tolist()


# The class of a result, and what describes its picture: a class is loaded by who makes one.
_KINDS: dict[str, Any] = {
    "Robot": lambda robot: Picture(robot.name, stack([robot_shape(robot)]), row_height=6.0),
    "EquilibriumPath": path_picture,
    "Equilibrium": lambda state: state_picture(state.path, state.step),
    "Batch": batch_picture,
    "Bands": lambda bands: path_picture(bands.path, bands=bands),
    "Comparison": comparison_picture,
    "Calibration": calibration_picture,
    "FrictionRig": friction_picture,
    "Design": design_picture,
    "DesignFront": front_picture,
    "ToleranceAnalysis": tolerance_picture,
    "Following": following_picture,
    "SensedForce": sensed_picture,
    "StrainCycle": cycle_picture,
    "Workspace": workspace_picture,
}


def picture(result: Any, *, title: str | None = None) -> Picture:
    """Describe the picture of a result, whatever its kind.

    Args:
        result: A robot, a path, a state, a batch, bands, a comparison, a calibration or any other
            result that the library can draw, or a dict of label to path for several beside each
            other.
        title: Heading; that of its kind if None.

    Returns:
        The picture: `save` writes it as PNG, SVG, PDF or HTML, `figure` gives that of matplotlib,
        `interactive` that of plotly.

    Raises:
        InputError: It is not one of these results.

    Example:
        >>> import tempfile
        >>> import notchflex as nf
        >>> from notchflex.plotting import picture
        >>> state = nf.solve(nf.load_robot("pacheco2021-a"), nf.Load(tension=1.0))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     picture(state).save(f"{folder}/wrist.svg")
    """
    described = _usual(result)
    return described if title is None else replace(described, title=title)


def _usual(result: Any) -> Picture:
    for kind in type(result).__mro__:
        if kind.__name__ in _KINDS and kind.__module__.startswith("notchflex."):
            return _KINDS[kind.__name__](result)
    if isinstance(result, Mapping) and all(
        isinstance(path, EquilibriumPath) for path in result.values()
    ):
        return beside_picture(result)
    raise InputError.WRONG_TYPE(
        f"a picture is made of one of these: {', '.join(_KINDS)}, or of a dict of paths; got "
        f"{type(result).__name__}."
    )


def plot_on_axes(thing: Any, x: str | None, y: str | None, ax: Axes | None) -> Axes:
    """Draw one quantity y of a path over another x, or the shape of a state or a robot.

    Without axes to draw into it makes new ones of pyplot.

    Raises:
        InputError: It can't be drawn on one pair of axes, or the quantity is unknown.
    """
    if isinstance(thing, EquilibriumPath):
        if x is None or y is None:
            raise InputError.MISSING_VALUE(
                "a path is drawn on axes as one quantity over another; give both, such as "
                "plot('stroke', 'tension')"
            )
        panel = quantities_panel(thing, x, y)
    elif x is not None or y is not None:
        raise InputError.WRONG_TYPE(
            "one quantity is drawn over another for a path; "
            f"got a {type(thing).__name__}, which is drawn by plot(it)"
        )
    elif isinstance(thing, Equilibrium):
        panel = state_shape(thing.path, thing.step)
    elif isinstance(thing, Robot):
        panel = robot_shape(thing)
    else:
        raise InputError.WRONG_TYPE(
            "axes can be given for a path, a state or a robot; the picture of a "
            f"{type(thing).__name__} has axes of its own: plot(it)"
        )
    figure: Any = None
    if ax is None:
        # Made outside our style: pyplot chooses its backend, and with it whether figures show
        # themselves, when it makes the first figure, and leaving the style would undo that.
        from matplotlib import pyplot

        size = (5.6, 5.6) if panel.equal or panel.z_label else (6.0, 4.0)
        figure = pyplot.figure(figsize=size, layout="constrained")
    with house_style():
        axes: Any = ax or figure.add_subplot(**projection(panel))
        if panel.z_label and axes.name != "3d":
            raise InputError.UNSUPPORTED(
                "this robot bends out of one plane; give axes made with projection='3d'"
            )
        draw_panel(axes, panel)
    return axes
