"""The picture of a path: the robot at several loads, and curves over the load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from notchflex.plotting.bands import shaded
from notchflex.plotting.branches import LOADING, UNLOADING, driven_by_stroke, steps_by_branch
from notchflex.plotting.curves import notches_panel, strain_panel, stroke_panel, total_panel
from notchflex.plotting.output import Picture
from notchflex.plotting.shapes.panel import plane_of, representative_steps, shape_panel
from notchflex.plotting.sheet import Panel, stack
from notchflex.plotting.tendon_profiles import (
    front_panel,
    profile_panel,
    pulled_tendons,
    reverses_step_by_step,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from notchflex.analysis.uncertainty.bands import Band
    from notchflex.results import EquilibriumPath

MOST_PROFILES = 2
"""Tendons whose tension is drawn over the stroke, and from span to span."""

_TWO_ROWS = 4
"""More curves than this are drawn three to a column."""


def path_figure(path: EquilibriumPath, *, title: str | None = None) -> Figure:
    """Draw a solved path with matplotlib; see `path_picture`.

    Args:
        path: Solved path.
        title: Heading; the name of the robot if None.

    Returns:
        The figure; `notchflex.plotting.save` writes it.

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

    Returns:
        The picture; its `save` writes it as PNG, SVG, PDF or HTML.
    """
    ways = steps_by_branch(path)
    steps = {"": representative_steps(path)}
    if len(ways) > 1:
        steps = {way: representative_steps(path, among=ways[way]) for way in (LOADING, UNLOADING)}
    view = plane_of(path)
    shapes = [shape_panel(path, some, view, title=name) for name, some in steps.items()]
    panels = _curves(path, ways, bands)
    # The shapes one above the other in the first column, the curves column by column beside them.
    rows = 3 if len(panels) > _TWO_ROWS else 2
    cells = stack(shapes, height=2 * rows // len(shapes))
    for start in range(0, len(panels), rows):
        cells += stack(panels[start : start + rows], 1 + start // rows, 2)
    columns = cells[-1].column + 1
    heading = path.robot.name if title is None else title
    return Picture(heading, 2.6 + 4.0 * columns, 0.8 + 2.9 * rows, cells)


def _curves(
    path: EquilibriumPath, ways: dict[str, list[int]], bands: Mapping[str, Band] | None
) -> list[Panel]:
    if len(path) == 1:
        return []
    panels = [
        shaded(total_panel(path), path, bands, "total_angle"),
        shaded(notches_panel(path), path, bands, "notch_angle"),
    ]
    panels += [stroke_panel(path, tendon) for tendon in driven_by_stroke(path)[:MOST_PROFILES]]
    panels.append(shaded(strain_panel(path), path, bands, "peak_strain"))
    if len(ways) > 1 and pulled_tendons(path):
        panels += [profile_panel(path, tendon) for tendon in pulled_tendons(path)[:MOST_PROFILES]]
        if reverses_step_by_step(path):
            panels.append(front_panel(path))
    return panels
