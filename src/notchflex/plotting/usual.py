"""The usual picture of anything that can be drawn, and drawing on axes of matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes

from notchflex import Equilibrium, EquilibriumPath, InputError, Robot
from notchflex.plotting.curves import quantities_panel
from notchflex.plotting.fits import calibration_picture, comparison_picture, friction_picture
from notchflex.plotting.output import Picture
from notchflex.plotting.path import beside_picture, path_picture, robot_picture, state_picture
from notchflex.plotting.results import (
    batch_picture,
    design_picture,
    following_picture,
    front_picture,
    sensed_picture,
    tolerance_picture,
    workspace_picture,
)
from notchflex.plotting.shapes import robot_shape, state_shape
from notchflex.plotting.style import house_style
from notchflex.plotting.with_matplotlib import draw_panel, projection

# The class of a result, and what describes its picture: a class is loaded by who makes one.
_KINDS: dict[str, Any] = {
    "Robot": robot_picture,
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
