"""The robot to scale in space, for robots and loads that leave one plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.shapes.acting import COLOUR, Acting, acting_at
from notchflex.plotting.shapes.bent import Bent, Sections, bent_at
from notchflex.plotting.shapes.wrist import ARROW, arrow_of, extent_of, load_label
from notchflex.plotting.sheet import BESIDE, Arrow, Colour, Faces, Item, Line, Note, Panel
from notchflex.plotting.style import GREY, ORANGE, VERMILLION, rgb, sequence_colours

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

ROUND = 32  # flat pieces round the tube
LIGHT = np.array([0.35, -0.75, 0.55])

Pieces = NDArray[np.float64]


def space_panel(
    path: EquilibriumPath,
    steps: Sequence[int],
    *,
    title: str = "",
    colours: Sequence[Colour] | None = None,
    legend: str = BESIDE,
) -> Panel:
    """Return a robot at several steps of a path in space, with its loads.

    Args:
        path: Solved path.
        steps: Which of its steps.
        title: What stands above it.
        colours: One for each step; from dark to light if None.
        legend: Where its legend stands.
    """
    items: list[Item] = []
    closed: list[NDArray[np.float64]] = []
    loads: list[Acting] = []
    colours = sequence_colours(len(steps)) if colours is None else colours
    for order, (step, colour) in enumerate(zip(steps, colours, strict=True)):
        shape = bent_at(path, step)
        base, *bodies = _walls(shape)
        own = np.concatenate([*bodies, *_flexures(shape)])
        if not order:  # the base stands still: it is drawn once
            items.append(Faces(base, _shaded(base, rgb(GREY)), GREY))
        label = load_label(path, step)
        items.append(Faces(own, _shaded(own, colour), colour, label, label))
        for number in range(len(shape.robot.tendon)):
            line = shape.tendon(number)
            items.append(Line(line, ORANGE, width=0.9, group=label, layer=5))
        closed += [shape.contact_pairs(int(notch)) for notch in np.flatnonzero(path.closed[step])]
        loads += acting_at(path, step, shape)
    if closed:
        dots = np.array(closed)
        mark: dict[str, Any] = {"dash": None, "marker": "o", "group": "closed notch", "layer": 6}
        items.append(Line(dots, VERMILLION, name="closed notch", **mark))
    items += _arrows(loads, ARROW * extent_of(path))
    if not steps:
        items.append(Note("no step was solved"))
    return Panel(
        items,
        "x [mm]",
        "y [mm]",
        "z, along the base [mm]",
        title=title,
        legend=legend if steps else "",
    )


def _walls(shape: Bent) -> Iterator[Pieces]:
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


def _flexures(shape: Bent) -> Iterator[Pieces]:
    """Every flexure: the wall at its spine, or a band as broad as area and thickness say."""
    outer = shape.robot.tube.outer_radius
    closes = np.asarray(shape.chain.rods.has_closure) > 0.0
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


def _shaded(faces: Pieces, colour: Any) -> list[Any]:
    """Colours of the faces by how they stand to the light."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ LIGHT) / np.where(size > 0.0, size, 1.0) / np.linalg.norm(LIGHT)
    base = np.array(rgb(colour))
    base, pale = 0.8 * base, 1.0 - 0.45 * (1.0 - base)
    return [tuple(base + part * (pale - base)) for part in facing]


def _arrows(loads: Sequence[Acting], longest: float) -> Iterator[Arrow]:
    """Forces as arrows; moments as arrows too, along the axis that they turn about."""
    named: set[str] = set()
    largest = {
        name: max((one.size for one in loads if one.name == name), default=0.0)
        for name in ("force", "moment")
    }
    for one in loads:
        arrow = arrow_of(one, largest[one.name], longest)
        label = "" if one.label in named else one.label
        named.add(one.label)
        width = 1.8 if one.name == "force" else 0.9
        if one.name == "moment" and label:
            label = f"{label}, about its arrow"
        yield Arrow(one.point, one.point + arrow, COLOUR[one.kind], width=width, name=label)
