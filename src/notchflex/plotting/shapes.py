"""The panel of a robot to scale at several loads: from the side, or in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from notchflex import EquilibriumPath, Load, Robot, RobotShape, solve
from notchflex.plotting.curves import evenly, prescribed
from notchflex.plotting.marks import (
    BESIDE,
    FINE,
    Area,
    Array,
    Arrow,
    Colour,
    Curve,
    Faces,
    Mark,
    Panel,
    Text,
    dots,
)
from notchflex.plotting.outline import (
    across_of,
    bending_plane,
    body_faces,
    flexure_faces,
    lips,
    outline,
    project,
    shape_at,
    tendon_line,
)
from notchflex.plotting.style import (
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    rgb,
    sequence_colours,
)

DEAD, FOLLOWING, WEIGHT = "", ", following", ", weight"
_LOAD_COLOUR = {DEAD: PURPLE, FOLLOWING: SKY, WEIGHT: GREY}

MAX_SHAPES = 5
"""More shapes than this hide each other."""

# Longest arrow in lengths of the robot, and shortest arrow in lengths of the longest.
_ARROW, _SHORTEST = 0.18, 0.25


class AppliedLoad(NamedTuple):
    """One "force" [N] or "moment" [N mm] in the frame of the base, and its point of action [mm]."""

    name: str
    kind: str  # one of `DEAD`, `FOLLOWING`, `WEIGHT`
    point: Array
    vector: Array

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
    tip = np.array([0.0, 0.0, path.robot.geometry.body_length[-1]])
    kind = FOLLOWING if load.following else DEAD
    acting: list[tuple[str, str, int, Any, Any]] = [
        ("force", kind, -1, tip + load.tip_point, load.tip_force),
        ("moment", kind, -1, tip, load.tip_moment),
        ("force", WEIGHT, -1, tip + load.tip_point, load.weight(load.tip_mass)),
    ]
    for on_body in load.body_forces:
        kind = FOLLOWING if on_body.following else DEAD
        acting.append(("force", kind, on_body.body, on_body.point, on_body.force))
        acting.append(("moment", kind, on_body.body, on_body.point, on_body.moment))
    world = path.body_rotation[step, 0].T
    return [
        AppliedLoad(
            name,
            kind,
            shape.on_body(body, point),
            (shape.rotation[body] if kind == FOLLOWING else world) @ np.asarray(vector, float),
        )
        for name, kind, body, point, vector in acting
        if np.any(vector)
    ]


def representative_steps(
    path: EquilibriumPath, most: int = MAX_SHAPES, among: Sequence[int] | None = None
) -> list[int]:
    """Return an even selection of converged steps (`among` some), straightest to most bent."""
    solved = np.flatnonzero(np.asarray(path.converged) & np.isfinite(path.total_angle))
    if among is not None:
        solved = np.intersect1d(solved, among)
    bend = np.abs(path.notch_angle[solved]).sum(axis=1)
    return solved[evenly(bend.round(6), most)].tolist()


def plane_of(path: EquilibriumPath) -> float | None:
    """Return the direction across the base [rad] of the plane that holds a path, if one does."""
    view = bending_plane(path.robot)
    if view is None:
        return None
    normal = np.array([-np.sin(view), np.cos(view), 0.0])
    for step in representative_steps(path):
        for load in applied_loads(path, step, path[step].shape.from_base()):
            # The plane shows the part of a force in it, and the part of a moment normal to it.
            out = float(load.vector @ normal) / load.size
            hidden = abs(out) if load.name == "force" else np.sqrt(max(0.0, 1.0 - out**2))
            if hidden > 1e-6:
                return None
    return view


def shape_panel(
    path: EquilibriumPath,
    steps: Sequence[int],
    *,
    title: str = "",
    colours: Sequence[Colour] | None = None,
    legend: str = BESIDE,
) -> Panel:
    """Return a robot at several steps of a path, to scale, with its loads.

    Every step has a colour, by default from dark to light.
    """
    view = plane_of(path) if steps else bending_plane(path.robot) or 0.0
    items: list[Mark] = [] if steps else [Text("no step was solved")]
    closed: list[Array] = []
    loads: list[AppliedLoad] = []
    for order, step in enumerate(steps):
        colour = (colours or sequence_colours(len(steps)))[order]
        shape, label = shape_at(path, step), load_label(path, step)
        if view is None:
            items += _in_space(shape, colour, label, order)
        else:
            items += _from_the_side(shape, view, colour, label, order)
        closed += [lips(shape, int(notch)) for notch in np.flatnonzero(path.closed[step])]
        loads += applied_loads(path, step, shape)
    top = 3 * len(steps) + 5
    if closed:
        points = np.array(closed) if view is None else project(closed, view)
        items.append(dots(points, VERMILLION, 3.5, name="closed notch", layer=top))
    items += _load_arrows(loads, view, _ARROW * path.robot.geometry.length, top + 1)
    options: dict[str, Any] = {"title": title, "legend": legend}
    if view is None:
        return Panel(items, "x [mm]", "y [mm]", "z, along the base [mm]", **options)
    degrees = round(float(np.degrees(view)), 6) % 360
    across = {0.0: "x", 90.0: "y"}.get(degrees, f"x turned by {degrees:g}° about z")
    labels = f"across the base, {across} [mm]", "along the base, z [mm]"
    return Panel(items, *labels, equal=True, shared="xy", **options)


def state_shape(path: EquilibriumPath, step: int) -> Panel:
    """Return the shape of one state, to scale, with its loads."""
    return shape_panel(path, [step] if path.converged[step] else [])


def robot_shape(robot: Robot) -> Panel:
    """Return the shape of a robot without loads."""
    free = solve(robot, Load())
    return shape_panel(free.path, [free.step], legend="")


def load_label(path: EquilibriumPath, step: int) -> str:
    """Return the name of a step in a legend: its load, and its total angle.

    The strokes where strokes are prescribed, and the tensions otherwise.
    """
    angle = round(float(np.degrees(path.total_angle[step])), 1) + 0.0  # no minus before a zero
    _, by_stroke, changing = prescribed(path)
    shown = [tendon for tendon in by_stroke if tendon in changing] or by_stroke
    values, unit = (path.stroke[step, shown], "mm") if shown else (path.tension[step], "N")
    numbers = ", ".join(f"{value:.3g}" for value in values.round(6) + 0.0)
    return f"{numbers} {unit}, {angle:.1f}°"


def _from_the_side(
    shape: RobotShape, view: float, colour: Colour, label: str, order: int
) -> Iterator[Mark]:
    seen, level = outline(shape, view), 3 * order
    if not order:  # the clamp does not move: it is drawn once
        yield Area([seen.held], GREY, 0.5, 0.8, layer=1)
    # Pale and nearly opaque, so that lines of shapes behind others can be seen.
    polygons, pale = [*seen.flexures, *seen.bodies], _pale(colour, 0.3)
    yield Area(polygons, colour, width=0.8, face=pale, name=label, layer=2 + level)
    gap = np.full((1, 2), np.nan)
    bores = np.concatenate([part for edge in seen.bores for part in (edge, gap)])
    yield Curve(bores, colour, FINE, 0.5, layer=3 + level, group=label)
    for points in seen.tendons:
        yield Curve(points, ORANGE, width=1.0, layer=4 + level, group=label)


def _in_space(shape: RobotShape, colour: Colour, label: str, order: int) -> Iterator[Mark]:
    base, *bodies = body_faces(shape)
    if not order:  # the base does not move: it is drawn once
        yield Faces(base, GREY)
    faces = np.concatenate([*bodies, *flexure_faces(shape)])
    yield Faces(faces, _pale(colour, 0.6), name=label)  # as shading darkens
    for number in range(len(shape.robot.tendon)):
        yield Curve(tendon_line(shape, number), ORANGE, width=0.9, group=label, layer=5)


def _pale(colour: Colour, part: float) -> Colour:
    return tuple(1.0 - part * (1.0 - channel) for channel in rgb(colour))


def _load_arrows(
    loads: Sequence[AppliedLoad], view: float | None, longest: float, layer: int
) -> Iterator[Arrow]:
    """Yield forces as arrows; moments as arcs from the side, and as thin arrows in space."""
    for load in loads:
        is_force = load.name == "force"
        label = load.label + ("" if is_force or view is not None else ", about its arrow")
        style: dict[str, Any] = {"layer": layer, "name": label}
        colour = _LOAD_COLOUR[load.kind]
        largest = max(other.size for other in loads if other.name == load.name)
        size = longest * max(load.size / largest, _SHORTEST)  # never too short to see
        ends = load.point + np.stack([0.0 * load.vector, size * load.vector / load.size])
        if view is None:
            yield Arrow(ends, colour, 1.8 if is_force else 0.9, **style)
        elif is_force:
            yield Arrow(project(ends, view), colour, **style)
        else:
            # Seen with z up and the view to the right, a moment about the normal turns z right.
            turn = np.sign(np.cross(across_of(view), load.vector)[2])
            angle = np.linspace(0.0, 1.2 * np.pi, 25)[:, None]
            arc = np.concatenate([-turn * np.cos(angle), np.sin(angle)], axis=1)
            yield Arrow(project(load.point, view) + 0.4 * longest * arc, colour, **style)
