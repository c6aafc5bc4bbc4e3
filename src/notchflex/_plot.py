"""`notchflex.plot`: the usual picture of a result; matplotlib is imported when it is called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

from notchflex._imports import need

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from notchflex.plotting import Picture


@overload
def plot(thing: Any) -> Picture: ...
@overload
def plot(
    thing: Any, x: str | None = None, y: str | None = None, *, ax: Axes | None
) -> Picture | Axes: ...
@overload
def plot(thing: Any, x: str, y: str, *, ax: Axes | None = None) -> Axes: ...
def plot(
    thing: Any, x: str | None = None, y: str | None = None, *, ax: Axes | None = None
) -> Picture | Axes:
    """Draw a robot, a path, a state or another result with matplotlib.

    Without further arguments the usual picture of its kind, which a notebook shows and
    `.save("wrist.png")` writes. With `x` and `y` one quantity of a path over another, loading and
    unloading apart, with the units of files and pictures (mm, N, deg).

    Args:
        thing: A robot, a path, a state, a batch, bands, a comparison, a calibration or any other
            result that the library can draw, or a dict of label to path.
        x: Of a path, what is drawn along the horizontal axis: the name of a quantity such as
            "stroke", a CSV column such as "notch_3_deg", or "step".
        y: The same for the vertical axis; a quantity with several entries, such as "notch_angle",
            has one line for each.
        ax: Axes of matplotlib to draw into; for x and y new ones of pyplot if None. A state or a
            robot draws its shape into them.

    Returns:
        The picture, or the axes where x and y or axes are given.

    Raises:
        InputError: It can't be drawn, there is no such quantity, or matplotlib is not installed.

    Example:
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 2.0, steps=5).release())
        >>> nf.plot(path).save("loop.png")
        >>> nf.plot(path, "stroke", "tension").get_xlabel()
        'tendon stroke $u$ [mm]'
    """
    need("matplotlib", "plot", "plot")
    from notchflex.plotting import picture, plot_on_axes

    if x is None and y is None and ax is None:
        return picture(thing)
    return plot_on_axes(thing, x, y, ax)
