"""The panel of a robot to scale at several loads: from the side, or in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex.plotting.curves import by_stroke, driven_by_stroke
from notchflex.plotting.shapes.outline import bending_plane, outline, project
from notchflex.plotting.shapes.robot_shape import lips, shape_at, tendon_line, walls
from notchflex.plotting.sheet import (
    BESIDE,
    FINE,
    Area,
    Arrow,
    Colour,
    Curve,
    Faces,
    Mark,
    Note,
    Panel,
    dots,
)
from notchflex.plotting.style import GREY, ORANGE, PURPLE, SKY, VERMILLION, rgb, sequence_colours

if TYPE_CHECKING:
    from notchflex import EquilibriumPath, RobotShape
    from notchflex.support import FlexureShape


DEAD, FOLLOWING, WEIGHT = "", ", following", ", weight"
COLOUR = {DEAD: PURPLE, FOLLOWING: SKY, WEIGHT: GREY}


class AppliedLoad(NamedTuple):
    """One "force" [N] or "moment" [N mm] in the frame of the base, and its point of action [mm]."""

    name: str
    kind: str  # one of `DEAD`, `FOLLOWING`, `WEIGHT`
    point: NDArray[np.float64]
    vector: NDArray[np.float64]

    @property
    def size(self) -> float:
        """Magnitude [N or N mm]."""
        return float(np.linalg.norm(self.vector))

    @property
    def label(self) -> str:
        """Legend entry."""
        unit = "N" if self.name == "force" else "N mm"
        return f"{self.name} {self.size:.3g} {unit}{self.kind}"


def applied_loads(path: EquilibriumPath, step: int, shape: RobotShape) -> list[AppliedLoad]:
    """Return the forces and moments on a robot at one step of a path; a hung mass as its weight.

    Gravity on the robot's own mass is distributed and not included.
    """
    load = path.load.external[step]
    world = path.body_rotation[step, 0]

    def carried(vector: object, body: int, following: bool) -> NDArray[np.float64]:
        stated = np.asarray(vector, float)
        return shape.rotation[body] @ stated if following else stated @ world

    kind = FOLLOWING if load.following else DEAD
    point = shape.on_body(
        -1, np.array([0.0, 0.0, path.robot.geometry.body_length[-1]]) + load.tip_point
    )
    weight = np.asarray(load.weight(load.tip_mass), float)
    loads = [
        AppliedLoad("force", kind, point, carried(load.tip_force, -1, load.following)),
        AppliedLoad("moment", kind, shape.tip, carried(load.tip_moment, -1, load.following)),
        AppliedLoad("force", WEIGHT, point, weight @ world),
    ]
    for one in load.body_forces:
        kind = FOLLOWING if one.following else DEAD
        point = shape.on_body(one.body, one.point)
        loads += [
            AppliedLoad("force", kind, point, carried(one.force, one.body, one.following)),
            AppliedLoad("moment", kind, point, carried(one.moment, one.body, one.following)),
        ]
    return [one for one in loads if one.size > 0.0]


def out_of_plane(path: EquilibriumPath, step: int, shape: RobotShape, view: float) -> float:
    """Return the largest fraction of a load that a view does not show.

    A view shows the part of a force in its plane, and the part of a moment normal to it.
    """
    normal = np.array([-np.sin(view), np.cos(view), 0.0])
    hidden = [0.0]
    for one in applied_loads(path, step, shape):
        beside = float(abs(one.vector @ normal)) / one.size
        hidden.append(beside if one.name == "force" else np.sqrt(max(0.0, 1.0 - beside**2)))
    return max(hidden)


Quads = NDArray[np.float64]

MAX_SHAPES = 5
"""More shapes than this hide each other."""

ARROW, SHORTEST = 0.18, 0.25
"""Longest arrow in lengths of the robot, and shortest arrow in lengths of the longest."""

ROUND = 32
"""Flat pieces round the tube in space."""

LIGHT = np.array([0.35, -0.75, 0.55]) / np.linalg.norm([0.35, -0.75, 0.55])

_NOTHING = 1e-6
"""A tension [N] or stroke [mm] less than this is written as 0."""


def representative_steps(
    path: EquilibriumPath, most: int = MAX_SHAPES, among: Sequence[int] | None = None
) -> list[int]:
    """Return an even selection of converged steps (`among` some), straightest to most bent.

    Of equal shapes it has the first.
    """
    converged = np.flatnonzero(np.asarray(path.converged) & np.isfinite(path.total_angle))
    if among is not None:
        converged = np.array([step for step in among if step in converged], int)
    if not len(converged):
        return []
    bend = np.abs(path.notch_angle[converged]).sum(axis=1)
    chosen: list[int] = []
    for target in np.linspace(bend.min(), bend.max(), most):
        step = int(converged[np.argmin(np.abs(bend - target))])
        near = any(
            np.abs(path.notch_angle[[step]] - path.notch_angle[c]).max() < 1e-6 for c in chosen
        )
        if step not in chosen and not (near and np.ptp(bend) < 1e-6):
            chosen.append(step)
    return chosen


def plane_of(path: EquilibriumPath) -> float | None:
    """Return the direction across the base [rad] of the plane that holds a path, if one does."""
    view = bending_plane(path.robot)
    if view is None:
        return None
    steps = representative_steps(path)
    leaves = [out_of_plane(path, step, shape_at(path, step), view) for step in steps]
    return None if max(leaves, default=0.0) > 1e-6 else view


def shape_panel(
    path: EquilibriumPath,
    steps: Sequence[int],
    view: float | None,
    *,
    title: str = "",
    colours: Sequence[Colour] | None = None,
    legend: str = BESIDE,
) -> Panel:
    """Return a robot at several steps of a path, to scale, with its loads.

    `view` is the direction across the base that is drawn to the right [rad]; None draws in space.
    Every step has a colour, by default from dark to light.
    """
    if not steps:
        view = view or 0.0
    items: list[Mark] = []
    closed: list[NDArray[np.float64]] = []
    loads: list[AppliedLoad] = []
    colours = sequence_colours(len(steps)) if colours is None else colours
    for order, (step, colour) in enumerate(zip(steps, colours, strict=True)):
        shape, label = shape_at(path, step), load_label(path, step)
        if view is None:
            items += _in_space(shape, colour, label, first=not order)
        else:
            items += _from_the_side(shape, view, colour, label, order)
        closed += [lips(shape, int(notch)) for notch in np.flatnonzero(path.closed[step])]
        loads += applied_loads(path, step, shape)
    top, bodies = 3 * len(steps) + 5, np.diff(path.body_position[0], axis=0)
    extent = float(np.linalg.norm(bodies, axis=1).sum() + path.robot.tube.outer_diameter)
    if closed:
        points = np.array(closed) if view is None else project(closed, view)
        name = "closed notch"
        items.append(dots(points, VERMILLION, 3.5, name=name, group=name, layer=top))
    items += _load_arrows(loads, view, ARROW * extent, top + 1)
    if not steps:
        items.append(Note("no step was solved"))
    legend = legend if steps else ""
    if view is None:
        labels = "x [mm]", "y [mm]", "z, along the base [mm]"
        return Panel(items, *labels, title=title, legend=legend)
    degrees = round(float(np.degrees(view)), 6) % 360
    across = {0.0: "x", 90.0: "y"}.get(degrees, f"x turned by {degrees:g}° about z")
    labels = f"across the base, {across} [mm]", "along the base, z [mm]"
    return Panel(items, *labels, title=title, legend=legend, equal=True, scale="shape")


def load_label(path: EquilibriumPath, step: int) -> str:
    """Return the name of a step in a legend: its load, and its total angle.

    The strokes where strokes are prescribed, and the tensions otherwise.
    """
    angle = round(float(np.degrees(path.total_angle[step])), 1) + 0.0  # no minus before a zero
    drawn = driven_by_stroke(path) or [
        tendon for tendon in range(path.tension.shape[1]) if by_stroke(path, tendon)
    ]
    values, unit = (path.stroke[step, drawn], "mm") if drawn else (path.tension[step], "N")
    numbers = (f"{0.0 if abs(one) < _NOTHING else one:.3g}" for one in values)
    return f"{', '.join(numbers)} {unit}, {angle:.1f}°"


def _from_the_side(
    shape: RobotShape, view: float, colour: Colour, label: str, order: int
) -> Iterator[Mark]:
    drawn, level = outline(shape, view), 3 * order
    if not order:  # the clamp does not move: it is drawn once
        yield Area([drawn.held], GREY, GREY, 0.5, layer=1)
    # Pale and nearly opaque, so that lines of shapes behind others can be seen.
    pale = tuple(1.0 - 0.3 * (1.0 - part) for part in rgb(colour))
    style: dict[str, Any] = {"group": label}
    polygons = [*drawn.flexures, *drawn.bodies]
    yield Area(polygons, pale, colour, name=label, layer=2 + level, **style)
    gap = np.full((1, 2), np.nan)
    bores = np.concatenate([part for line in drawn.bores for part in (line, gap)])
    yield Curve(bores, colour, FINE, 0.5, layer=3 + level, **style)
    for line in drawn.tendons:
        yield Curve(line, ORANGE, width=1.0, layer=4 + level, **style)


def _in_space(shape: RobotShape, colour: Colour, label: str, first: bool) -> Iterator[Mark]:
    base, *bodies = body_faces(shape)
    if first:  # the base does not move: it is drawn once
        yield Faces(base, shaded(base, rgb(GREY)), GREY)
    faces = np.concatenate([*bodies, *flexure_faces(shape)])
    yield Faces(faces, shaded(faces, colour), colour, name=label, group=label)
    for number in range(len(shape.robot.tendon)):
        yield Curve(tendon_line(shape, number), ORANGE, width=0.9, group=label, layer=5)


def _load_arrows(
    loads: Sequence[AppliedLoad], view: float | None, longest: float, layer: int
) -> Iterator[Arrow]:
    """Yield forces as arrows; moments as arcs from the side, and as thin arrows in space."""
    named: set[str] = set()
    largest = {kind: max((one.size for one in loads if one.name == kind), default=0.0)
               for kind in ("force", "moment")}  # fmt: skip
    for one in loads:
        style: dict[str, Any] = {"layer": layer, "name": "" if one.label in named else one.label}
        named.add(one.label)
        size = longest * max(one.size / largest[one.name], SHORTEST)  # never too short to see
        end = one.point + size * one.vector / one.size
        if view is None:
            if one.name == "moment" and style["name"]:
                style["name"] += ", about its arrow"
            width = 1.8 if one.name == "force" else 0.9
            yield Arrow(one.point, end, COLOUR[one.kind], width=width, **style)
        elif one.name == "force":
            yield Arrow(project(one.point, view), project(end, view), COLOUR[one.kind], **style)
        else:
            # Seen with z up and the view to the right, a moment about +normal turns z to the right.
            normal = np.array([-np.sin(view), np.cos(view), 0.0])
            turn = -1.0 if one.vector @ normal > 0.0 else 1.0
            start = project(one.point, view)
            side = 0.4 * longest * turn * np.array([1.0, 0.0])
            reach = np.array([start - longest, start + longest])
            style |= {"bend": 0.9, "reach": reach}
            yield Arrow(start - side, start + side, COLOUR[one.kind], **style)


def body_faces(shape: RobotShape) -> Iterator[Quads]:
    """Yield the outer wall of every body, (pieces, 4, 3)."""
    outer = shape.robot.tube.outer_radius
    edges = 2.0 * np.pi * np.arange(ROUND + 1) / ROUND
    rim = outer * np.stack([np.cos(edges), np.sin(edges)], axis=1)
    sides = [walls(shape.robot, float(np.degrees(angle))) for angle in edges[:-1] + np.pi / ROUND]
    for body in range(len(shape.position)):
        corners = [
            np.column_stack([rim[[i, i + 1, i + 1, i]], np.repeat(wall, 2)])
            for i in range(ROUND)
            if (wall := sides[i][body]) is not None and wall[1] > wall[0]
        ]
        if corners:
            yield shape.on_body(body, corners)


def flexure_faces(shape: RobotShape) -> Iterator[Quads]:
    """Yield every flexure: the wall at its spine, or a band with its thickness and area."""
    outer = shape.robot.tube.outer_radius
    for one, spine in zip(shape.flexures, shape.robot.geometry.has_spine, strict=True):
        half = 0.5 * one.area / (one.spine + one.near)
        band = [(-one.spine, -half), (-one.spine, half), (one.near, half), (one.near, -half)]
        lines = _spine(one, outer) if spine else [*band, band[0]]
        along = np.stack([one.fibre(across, out) for across, out in lines], axis=1)
        corners = [along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]]
        yield np.stack(corners, axis=2).reshape(-1, 4, 3)


def shaded(faces: Quads, colour: Any) -> list[Any]:
    """Return the colours of the faces by their angle to the light."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    size = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ LIGHT) / np.where(size > 0.0, size, 1.0)
    base = np.array(rgb(colour))
    base, pale = 0.8 * base, 1.0 - 0.45 * (1.0 - base)
    return [tuple(base + part * (pale - base)) for part in facing]


def _spine(one: FlexureShape, outer: float) -> list[tuple[Any, Any]]:
    axis = outer - one.spine  # from the neutral axis to the axis of the tube
    half = float(np.arccos(np.clip((axis[0] - one.near[0]) / outer, -1.0, 1.0)))
    angles = np.pi + np.linspace(-half, half, 9)
    return [(axis + outer * np.cos(angle), outer * np.sin(angle)) for angle in angles]
