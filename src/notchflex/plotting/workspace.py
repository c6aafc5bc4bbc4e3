"""The picture of a workspace: the cloud of tips in space, and maps of what they have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.output import Picture
from notchflex.plotting.sheet import BELOW, BESIDE, Curve, Mark, Panel, dots, grid
from notchflex.plotting.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, sequence_colours
from notchflex.workspaces import hull_of, sphere_directions

if TYPE_CHECKING:
    from notchflex.workspaces import Workspace


MAX_POINTS = 4000
"""Tips that are drawn of one workspace; of more, one for each voxel or an even selection."""

_CLASSES = 6
_LABELS = ("x [mm]", "y [mm]", "z [mm]")


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
    voxels = found.voxels()
    across = 0 if np.ptp(found.extent[:, 0]) >= np.ptp(found.extent[:, 1]) else 1
    hull = found.hull
    title = f"convex hull {hull.size:.3g} {hull.unit}"
    flat = hull.dimension < 3
    maps = {
        "largest tension [N]": voxels.values["tension"],
        "peak strain [%]": 100.0 * voxels.values["strain"],
        "largest error by hysteresis [mm]": voxels.values["hysteresis"],
        "dexterity [% of directions]": 100.0 * voxels.dexterity,
    }
    if np.isfinite(found.stiffness).any():
        maps["softest stiffness of the tip [N/mm]"] = voxels.values["stiffness"]
    first = _plane(found, across, title) if flat else _space(found, title)
    panels = [first]
    points = voxels.centre[:, [across, 2]]
    panels += [_map(points, values, name, across) for name, values in maps.items()]
    width = 4.4
    return Picture(f"Workspace of {found.robot.name}", 3 * width, 7.4, grid(panels, 3))


def workspaces_picture(found: Mapping[str, Workspace]) -> Picture:
    """Describe several workspaces in the same axes, seen from the front and from the side.

    Args:
        found: Workspaces by label.
    """
    colours = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE)
    panels: list[Panel] = []
    flat = all(np.ptp(one.extent[:, 1]) < 1e-9 for one in found.values())
    for across in (0,) if flat else (0, 1):
        items: list[Mark] = []
        for (label, one), colour in zip(found.items(), colours, strict=False):
            points = _thinned(one)[:, [across, 2]]
            name = f"{label}: convex hull {one.hull.size:.3g} {one.hull.unit}"
            items.append(dots(points, colour, 2.0, name=name, group=label))
        legend = BELOW if across or flat else ""
        panels.append(Panel(items, _LABELS[across], _LABELS[2], equal=True, legend=legend))
    *others, last = found
    title = f"Workspaces of {', '.join(others)} and {last}"
    return Picture(title, 5.2 * len(panels), 5.2, grid(panels, 2))


def _thinned(workspace: Workspace) -> NDArray[np.float64]:
    """Return tips to draw: an even selection."""
    step = -(-len(workspace) // MAX_POINTS)
    return workspace.tip[::step]


def _space(workspace: Workspace, title: str) -> Panel:
    tips, rising = _thinned(workspace), workspace.loading[:: -(-len(workspace) // MAX_POINTS)]
    items: list[Mark] = [
        dots(tips[rising], BLUE, 1.5, name="loading", group="loading"),
        dots(tips[~rising], ORANGE, 1.5, name="unloading", group="unloading"),
    ]
    # The farthest corners alone: all of them are too many lines.
    corners = workspace.hull.corners
    some = corners[np.unique((corners @ sphere_directions().T).argmax(axis=0))]
    few = hull_of(some)
    gap = np.full((len(few.faces), 1, 3), np.nan)
    edges = np.concatenate([few.corners[few.faces], gap], axis=1).reshape(-1, 3)
    items.append(Curve(edges, SKY, width=0.5, name="convex hull", group="hull"))
    return Panel(items, *_LABELS, title=title, legend=BESIDE, equal=True)


def _plane(workspace: Workspace, across: int, title: str) -> Panel:
    tips, rising = _thinned(workspace), workspace.loading[:: -(-len(workspace) // MAX_POINTS)]
    columns = [across, 2]
    items: list[Mark] = [
        dots(tips[rising][:, columns], BLUE, 1.5, name="loading", group="loading"),
        dots(tips[~rising][:, columns], ORANGE, 1.5, name="unloading", group="unloading"),
    ]
    if workspace.hull.dimension == 2:
        ring = np.concatenate([workspace.hull.corners, workspace.hull.corners[:1]])[:, columns]
        items.append(Curve(ring, SKY, width=1.0, name="convex hull", group="hull"))
    labels = (_LABELS[across], _LABELS[2])
    return Panel(items, *labels, title=title, legend=BESIDE, equal=True)


def _map(points: NDArray[np.float64], values: NDArray[np.float64], name: str, across: int) -> Panel:
    """Return voxels by value, in a few classes of equal width."""
    is_finite = np.isfinite(values)
    items: list[Mark] = []
    if is_finite.any():
        low, high = float(values[is_finite].min()), float(values[is_finite].max())
        ends = np.linspace(low, high, _CLASSES + 1)
        number = np.clip(np.searchsorted(ends, values, side="right") - 1, 0, _CLASSES - 1)
        colours = sequence_colours(_CLASSES)
        for one in range(_CLASSES):
            mine = points[is_finite & (number == one)]
            if len(mine):
                label = f"{ends[one]:.3g} to {ends[one + 1]:.3g}"
                style: dict[str, Any] = {"name": label, "group": f"{name} {one}"}
                items.append(dots(mine, colours[one], 2.5, layer=2 + one, **style))
    labels = (_LABELS[across], _LABELS[2])
    return Panel(items, *labels, title=name, legend=BESIDE, equal=True)
