"""The robot to scale in space, for robots and loads that leave one plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from notchflex.plot.acting import COLOUR, Acting, acting_at
from notchflex.plot.bent import Bent, Sections, bent_at
from notchflex.plot.style import GREY, ORANGE, VERMILLION, sequence_colours
from notchflex.plot.wrist import ARROW, arrow_of, extent_of, load_label

if TYPE_CHECKING:
    from notchflex.statics import Path

ROUND = 32  # flat pieces round the tube
LIGHT = np.array([0.35, -0.75, 0.55])
ELEVATION, AZIMUTH = 18.0, -60.0

Faces = NDArray[np.float64]


def draw_space(axes: Any, path: Path, steps: Sequence[int]) -> None:
    """Draw a robot at several steps of a path into axes of three dimensions, with its loads.

    Args:
        axes: 3-D axes of matplotlib.
        path: Solved path.
        steps: Which of its steps.
    """
    faces: list[Faces] = []
    colours: list[Any] = []
    loads: list[Acting] = []
    everything: list[NDArray[np.float64]] = []
    any_closed = False
    for step, colour in zip(steps, sequence_colours(len(steps)), strict=True):
        shape = bent_at(path, step)
        base, *bodies = _walls(shape)
        own = np.concatenate([*bodies, *_flexures(shape)])
        if not faces:  # the base stands still: it is drawn once
            faces.append(base)
            colours += _shaded(base, to_rgb(GREY))
        faces.append(own)
        colours += _shaded(own, colour)
        everything.append(own.reshape(-1, 3))
        axes.plot([], [], [], color=colour, linewidth=5.0, label=load_label(path, step))
        for number in range(len(shape.robot.tendon)):
            axes.plot(*shape.tendon(number).T, color=ORANGE, linewidth=0.9, zorder=5)
        closed = np.flatnonzero(path.closed[step])
        if len(closed):
            points = np.array([shape.lips(int(notch)) for notch in closed])
            axes.plot(*points.T, "o", color=VERMILLION, markersize=3.0, zorder=6)
            any_closed = True
        loads += acting_at(path, step, shape)
    if faces:
        together = np.concatenate(faces)
        axes.add_collection3d(
            Poly3DCollection(together, facecolors=colours, edgecolors=colours, linewidths=0.2)
        )
        if any_closed:
            axes.plot([], [], [], "o", color=VERMILLION, markersize=3.0, label="closed notch")
        everything += _loads(axes, loads, ARROW * extent_of(path))
        _equal_scale(axes, np.concatenate(everything))
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_zlabel("z, along the base [mm]", labelpad=9.0)


def _walls(shape: Bent) -> Iterator[Faces]:
    """The wall of every body, side by side round the tube: (pieces, 4, 3)."""
    outer = shape.robot.tube.outer_radius
    edges = 2.0 * np.pi * np.arange(ROUND + 1) / ROUND
    middles = 0.5 * (edges[1:] + edges[:-1])
    sides = [shape.walls(float(np.degrees(angle))) for angle in middles]
    for body in range(len(shape.position)):
        corners = [
            [
                [outer * np.cos(at), outer * np.sin(at), z]
                for at, z in zip(edges[[i, i + 1, i + 1, i]], np.repeat(wall, 2), strict=True)
            ]
            for i in range(ROUND)
            if (wall := sides[i][body]) is not None and wall[1] > wall[0]
        ]
        if corners:
            yield shape.on_body(body, corners)


def _flexures(shape: Bent) -> Iterator[Faces]:
    """Every flexure: the wall at its spine, or a band as broad as area and thickness say."""
    outer = shape.robot.tube.outer_radius
    closes = np.asarray(shape.chain.rods.lip_closes) > 0.0
    for one, spine in zip(shape.flexures, closes, strict=True):
        lines = _spine(one, outer) if spine else _band(one)
        along = np.stack([one.fibre(across, out) for across, out in lines], axis=1)
        corners = [along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]]
        yield np.stack(corners, axis=2).reshape(-1, 4, 3)


def _spine(one: Sections, outer: float) -> list[tuple[Any, Any]]:
    axis = outer - one.spine  # from the neutral axis to the axis of the tube
    half = float(np.arccos(np.clip((axis[0] - one.near[0]) / outer, -1.0, 1.0)))
    angles = np.pi + np.linspace(-half, half, 9)
    return [(axis + outer * np.cos(angle), outer * np.sin(angle)) for angle in angles]


def _band(one: Sections) -> list[tuple[Any, Any]]:
    half = 0.5 * one.area / (one.spine + one.near)
    corners = [(-one.spine, -half), (-one.spine, half), (one.near, half), (one.near, -half)]
    return [*corners, corners[0]]


def _shaded(faces: Faces, colour: Any) -> list[Any]:
    """Colours of the faces by how they stand to the light."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ LIGHT) / np.where(size > 0.0, size, 1.0) / np.linalg.norm(LIGHT)
    base = np.array(to_rgb(colour))
    base, pale = 0.8 * base, 1.0 - 0.45 * (1.0 - base)
    return [tuple(base + part * (pale - base)) for part in facing]


def _loads(axes: Any, loads: Sequence[Acting], longest: float) -> Iterator[NDArray[np.float64]]:
    """Draw forces as arrows; moments as arrows too, along the axis that they turn about."""
    named: set[str] = set()
    largest = {
        name: max((one.size for one in loads if one.name == name), default=0.0)
        for name in ("force", "moment")
    }
    for one in loads:
        arrow = arrow_of(one, largest[one.name], longest)
        label = None if one.label in named else one.label
        named.add(one.label)
        width = 1.8 if one.name == "force" else 0.9
        if one.name == "moment" and label:
            label = f"{label}, about its arrow"
        axes.quiver(*one.point, *arrow, color=COLOUR[one.kind], linewidth=width, label=label)
        yield np.stack([one.point, one.point + arrow])


def _equal_scale(axes: Any, points: NDArray[np.float64]) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.02 * float((high - low).max())
    for name, first, last in zip("xyz", low - room, high + room, strict=True):
        getattr(axes, f"set_{name}lim")(first, last)
        axis = getattr(axes, f"{name}axis")
        part = (last - first) / (high - low).max()
        axis.set_major_locator(MaxNLocator(nbins=max(2, round(6 * part))))
    axes.set_box_aspect(high - low + 2.0 * room, zoom=0.92)
