"""A robot to scale: its outline, its faces in space, the solids of its bodies, and their panel.

Shapes are in the frame of the clamped base [mm], with smooth flexures. The horizontal axis of a
view is a direction across the base, the vertical axis is the tube axis of the base. A body is drawn
as its walls on both sides and what joins them, a flexure as a bent strip as thick as its section.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

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
    Note,
    Panel,
    box,
    dots,
)
from notchflex.plotting.style import (
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    pale,
    sequence_colours,
)
from notchflex.support import FlexureShape

if TYPE_CHECKING:
    from manifold3d import Manifold

FLEXURE_POINTS = 20  # a notch bends by less than a right angle; 2 degrees look smooth
UP = np.array([0.0, 0.0, 1.0])
HELD = 0.8  # length of clamped tube drawn below the base, in outer radii
_CLAMP = 1.7  # half the width of the clamp, in outer radii

Corners = list[tuple[float, float]]


def shape_at(path: EquilibriumPath, step: int, pieces: int = FLEXURE_POINTS) -> RobotShape:
    """Return the shape of a robot at one step of a path; for `pieces` see `smooth`."""
    return smooth(path[step].shape.from_base(), pieces)


def shape_from_angles(
    robot: Robot, notch_angle: Array, pieces: int = FLEXURE_POINTS, level: str = "tendons"
) -> RobotShape:
    """Return the shape of a robot whose notches have given angles [rad], (n,).

    For `pieces` see `smooth`, for `level` `Geometry.shape`.
    """
    return smooth(robot.geometry.shape(notch_angle, level), pieces)


def smooth(shape: RobotShape, pieces: int) -> RobotShape:
    """Return a shape whose flexures have at least so many straight pieces, (n,).

    Between two sections a flexure is the arc of a constant twist.
    """
    flexures = shape.flexures
    counts = np.array([len(flexure.area) for flexure in flexures])
    parts = -(-pieces // (counts - 1))
    first, total = np.cumsum(counts) - counts, counts.sum()
    places = [
        start + np.arange((count - 1) * part + 1) / part
        for start, count, part in zip(first, counts, parts, strict=True)
    ]
    place = np.concatenate(places)
    rotation, position, *widths = (
        np.concatenate([getattr(flexure, name) for flexure in flexures])
        for name in ("rotation", "position", "spine", "near", "area")
    )
    poses = RigidTransform.from_components(position, Rotation.from_matrix(rotation))
    before = place.astype(int)
    twist = (poses[before].inv() * poses[np.minimum(before + 1, total - 1)]).as_exp_coords()
    line = poses[before] * RigidTransform.from_exp_coords((place - before)[:, None] * twist)
    columns = [line.rotation.as_matrix(), line.translation]
    columns += [np.interp(place, np.arange(total), width) for width in widths]
    ends = np.cumsum([len(part) for part in places])[:-1]
    rows = zip(*(np.split(column, ends) for column in columns), strict=True)
    return replace(shape, flexures=tuple(FlexureShape(*row) for row in rows))


def walls(robot: Robot, side_deg: float) -> list[tuple[float, float] | None]:
    """Return the ends of the wall of each body on a side [mm in its frame]; None if no wall."""
    base, *others = robot.geometry.walls(side_deg)
    assert base is not None
    # What is fixed in the last body may enter it beyond its far face.
    ends = [None if wall is None else (min(wall), max(wall)) for wall in others]
    return [(-HELD * robot.tube.outer_radius, base[1]), *ends]


def tendon_line(shape: RobotShape, number: int) -> Array:
    """Return the line of a tendon (from 0) from below the base."""
    points = shape.tendon(number)
    points[0] -= HELD * shape.robot.tube.outer_radius * UP
    return points


def lips(shape: RobotShape, notch: int, radius: float | None = None) -> Array:
    """Return the point midway between the edges of a notch (from 0) that meet when it closes.

    It lies at a radius [mm] from the tube axis, by default the outer one.
    """
    outer = shape.robot.tubes[notch + 1].outer_radius if radius is None else radius
    pairs: list[Array] = []
    for turn in (0.0, 180.0):
        side = shape.robot.notches[notch].direction_deg + turn
        ends = walls(shape.robot, side)
        if (behind := ends[notch + 1]) is not None:
            before, last = max((body, wall) for body, wall in enumerate(ends[: notch + 1]) if wall)
            edge = outer * across_of(np.radians(side))
            first = shape.on_body(before, edge + last[1] * UP)
            pairs.append(np.stack([first, shape.on_body(notch + 1, edge + behind[0] * UP)]))
    return min(pairs, key=lambda pair: float(np.linalg.norm(pair[1] - pair[0]))).mean(axis=0)


@dataclass(frozen=True)
class ShapeOutline:
    """Polygons and lines in the plane of a view [mm], each (k, 2)."""

    bodies: list[Array]  # base first
    bores: list[Array]  # inner wall of every body, one for each side with a wall
    flexures: list[Array]  # the strip of every notch
    tendons: list[Array]
    held: Array  # the clamp below the base


def across_of(view: float) -> Array:
    """Return the direction across the base that a view [rad] has on the right."""
    return np.array([np.cos(view), np.sin(view), 0.0])


def project(points: Any, view: float) -> Array:
    """Return points (..., 3) as a view shows them: across the base and along it, (..., 2)."""
    points = np.asarray(points)
    return np.stack([points @ across_of(view), points[..., 2]], axis=-1)


def bending_plane(robot: Robot, offset: float = 1e-9) -> float | None:
    """Return the direction [rad] of the plane in which all notches bend, up to an offset [rad]."""
    sides = [notch.direction_deg for notch in robot.notches]
    for tendon in robot.tendon if any(notch.is_round for notch in robot.notches) else ():
        sides += tendon.holes[1] if tendon.holes else [tendon.direction_deg]
    directions = np.radians(sides)
    first = float(directions[0])
    return first if np.all(np.abs(np.sin(directions - first)) < offset) else None


def outline(shape: RobotShape, view: float) -> ShapeOutline:
    """Return the outline of a robot, with a direction [rad] of the base drawn to the right."""
    outer, tubes = shape.robot.tube.outer_radius, shape.robot.tubes

    def place(body: int, corners: Any) -> Array:
        local = np.asarray(corners, float)
        return project(
            shape.on_body(body, local[:, :1] * across_of(view) + local[:, 1:] * UP), view
        )

    bodies = range(len(shape.position))
    side, below = _CLAMP * outer, -HELD * outer
    return ShapeOutline(
        bodies=[place(body, body_corners(shape, body, view)) for body in bodies],
        bores=[
            place(body, [(sign * tubes[body].inner_radius, end) for end in wall])
            for body in bodies
            for sign, wall in zip((1.0, -1.0), _sides(shape, body, view), strict=True)
            if wall is not None
        ],
        flexures=[
            project(strip(flexure, across_of(view) if notch.is_round else None), view)
            for flexure, notch in zip(shape.flexures, shape.robot.notches, strict=True)
        ],
        tendons=[project(tendon_line(shape, i), view) for i in range(len(shape.robot.tendon))],
        held=place(0, box(-side, below, side, 0.0)),
    )


def strip(flexure: FlexureShape, across: Array | None = None) -> Array:
    """Return the outline of a flexure: along its spine and back along its other edge, (k, 3).

    A round one is seen from all sides alike, by the direction that a view has across.
    """
    if across is not None:
        along = flexure.rotation[..., 2] @ np.stack([across, UP], axis=1)
        size = np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
        aside = flexure.spine[:, None] * (along[:, 1:] * across - along[:, :1] * UP) / size
        return np.concatenate([flexure.position - aside, (flexure.position + aside)[::-1]])
    return np.concatenate([flexure.fibre(-flexure.spine), flexure.fibre(flexure.near)[::-1]])


def body_corners(shape: RobotShape, body: int, view: float) -> Corners:
    """Return the outline of a body (0 is the base): corners (across, along) in its frame [mm].

    A body with wall on one side reaches from there to the flexures that are attached to it.
    """
    tube, (right, left) = shape.robot.tubes[body], _sides(shape, body, view)
    outer = tube.outer_radius
    if right and left:
        return [(outer, right[0]), (outer, right[1]), (-outer, left[1]), (-outer, left[0])]
    sign, (low, high) = (1.0, right) if right else (-1.0, left or (0.0, 0.0))
    joined = [(shape.flexures[body - 1], -1)]
    joined += [(flexure, 0) for flexure in shape.flexures[body : body + 1]]
    edges = [
        flexure.fibre(across)[end]
        for flexure, end in joined
        for across in (-flexure.spine, flexure.near)
    ]
    across = (np.array(edges) - shape.position[body]) @ shape.rotation[body] @ across_of(view)
    inside = max(min(tube.inner_radius, float(np.min(sign * across))), 0.0)
    ring = [(outer, low), (outer, high), (inside, high), (inside, low)]
    return [(sign * across, along) for across, along in ring]


def _sides(shape: RobotShape, body: int, view: float) -> list[tuple[float, float] | None]:
    """Return the ends of the wall of a body on the right and the left; None if no wall."""
    return [walls(shape.robot, np.degrees(view) + turn)[body] for turn in (0.0, 180.0)]


_ROUND = 32  # flat pieces round the tube in space


def body_faces(shape: RobotShape) -> Iterator[Array]:
    """Yield the outer wall of every body, (pieces, 4, 3)."""
    edges = 2.0 * np.pi * np.arange(_ROUND + 1) / _ROUND
    circle = np.stack([np.cos(edges), np.sin(edges)], axis=1)
    sides = [walls(shape.robot, float(np.degrees(angle))) for angle in edges[:-1] + np.pi / _ROUND]
    for body, tube in enumerate(shape.robot.tubes):
        rim = tube.outer_radius * circle
        corners = [
            np.column_stack([rim[[i, i + 1, i + 1, i]], np.repeat(wall, 2)])
            for i in range(_ROUND)
            if (wall := sides[i][body]) is not None and wall[1] > wall[0]
        ]
        if corners:
            yield shape.on_body(body, corners)


def flexure_faces(shape: RobotShape) -> Iterator[Array]:
    """Yield every flexure: the wall at its spine, or a band with its thickness and area."""
    robot = shape.robot
    kinds = zip(
        shape.flexures, robot.geometry.has_spine, robot.notches, robot.tubes[1:], strict=True
    )
    for flexure, spine, notch, tube in kinds:
        outer = tube.outer_radius
        if notch.is_round:
            angles = np.linspace(0.0, 2.0 * np.pi, 13)
            edges = [*(flexure.spine[0] * np.column_stack([np.cos(angles), np.sin(angles)]))]
        elif spine:
            axis = outer - flexure.spine  # from the neutral axis to the axis of the tube
            half = float(np.arccos(np.clip((axis[0] - flexure.near[0]) / outer, -1.0, 1.0)))
            angles = np.pi + np.linspace(-half, half, 9)
            edges = [(axis + outer * np.cos(angle), outer * np.sin(angle)) for angle in angles]
        else:
            half = 0.5 * flexure.area / (flexure.spine + flexure.near)
            edges = [*box(-flexure.spine, -half, flexure.near, half)[::-1]]
            edges.append(edges[0])
        along = np.stack([flexure.fibre(across, out) for across, out in edges], axis=1)
        corners = [along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]]
        yield np.stack(corners, axis=2).reshape(-1, 4, 3)


def ring_solid(radii: tuple[float, float], ends: tuple[float, float], sides: int) -> Manifold:
    """Return a tube along z, as large in volume as the round one.

    Args:
        radii: Its outer and inner radius [mm]; an inner one of 0 is a solid.
        ends: Its lower and its upper end [mm].
        sides: Flat sides of each surface, which lie half inside and half outside the round one.
    """
    from manifold3d import Manifold

    outer, inner = (
        Manifold.cylinder(ends[1] - ends[0], fair_growth(sides) * radius, circular_segments=sides)
        if radius
        else Manifold()
        for radius in radii
    )
    return (outer - inner).translate((0.0, 0.0, ends[0]))


def fair_growth(sides: int) -> float:
    """Return the factor by which a polygon's corners lie outside the circle of equal area."""
    part = 2.0 * math.pi / sides
    return math.sqrt(part / math.sin(part))


def prism(polygon: Any, view: float, depth: float) -> Manifold:
    """Return the prism of a polygon (across, along) seen from the side.

    Args:
        polygon: Corners [mm], (k, 2): across toward the direction `view`, and along z.
        view: Direction about z that the first coordinate has [rad].
        depth: Length of the prism across that plane, half of it on each side [mm].
    """
    from manifold3d import CrossSection, FillRule, Manifold

    solid = Manifold.extrude(CrossSection([polygon], FillRule.NonZero), depth)
    return solid.translate((0.0, 0.0, -0.5 * depth)).rotate((90.0, 0.0, np.degrees(view)))


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
    load, world = path.load.external[step], path.body_rotation[step, 0].T
    tip = np.array([0.0, 0.0, path.robot.geometry.body_length[-1]])
    kind = FOLLOWING if load.following else DEAD
    acting: list[tuple[str, str, int, Any, Any]] = [
        ("force", kind, -1, tip + load.tip_point, load.tip_force),
        ("moment", kind, -1, tip, load.tip_moment),
        ("force", WEIGHT, -1, tip + load.tip_point, load.weight(load.tip_mass)),
    ]
    for on_body in load.body_forces:
        kind = FOLLOWING if on_body.following else DEAD
        for name in ("force", "moment"):
            acting.append((name, kind, on_body.body, on_body.point, getattr(on_body, name)))
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
    items: list[Mark] = [] if steps else [Note("no step was solved")]
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
    polygons, face = [*seen.flexures, *seen.bodies], pale(colour, 0.3)
    yield Area(polygons, colour, width=0.8, face=face, name=label, layer=2 + level)
    gap = np.full((1, 2), np.nan)
    bores = np.concatenate([part for edge in seen.bores for part in (edge, gap)])
    yield Curve(bores, colour, FINE, 0.5, layer=3 + level, group=label)
    for points in seen.tendons:
        yield Curve(points, ORANGE, width=1.0, layer=4 + level, group=label)


def _in_space(shape: RobotShape, colour: Colour, label: str, order: int) -> Iterator[Mark]:
    base, *bodies = body_faces(shape)
    if not order:  # the base does not move: it is drawn once
        yield Faces(base, pale(GREY, 0.6))
    faces = np.concatenate([*bodies, *flexure_faces(shape)])
    yield Faces(faces, pale(colour, 0.6), name=label)  # as shading darkens
    for number in range(len(shape.robot.tendon)):
        yield Curve(tendon_line(shape, number), ORANGE, width=0.9, group=label, layer=5)


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
