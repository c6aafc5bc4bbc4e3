"""All forces on the bodies of a solved robot, put together in NumPy from what a result reports.

External loads, tendons and closed edges: `State` holds them with the point and the body they
act on, so that `beyond` adds up what acts beyond a notch. Nothing is taken from the solver but
poses, tensions along the tendons and contact forces; where a tendon leaves and enters bodies
follows from the notches' openings and the holes of the disks. Tendons on an arc of the wall and the
lips opposite a spine act on their own flexure alone and are no part of this (see arcs.py).

World frame; mm, N, N mm.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import notchflex as nf

from .sections import at_temperature

_Z = np.array([0.0, 0.0, 1.0])
# An edge this near to a face touches it, as a part of the height of the notch.
_TOUCHES = 1e-6


class Stop(NamedTuple):
    """A body on the way of a line along the wall: where it is entered and left, mm on the axis."""

    body: int
    enters: float
    leaves: float
    faces: bool


class Hole(NamedTuple):
    """A hole of a tendon through a body, in the body's frame.

    Attributes:
        enters: Where it begins in a section of the tube, mm.
        leaves: Where it ends in another, mm.
        along: Its direction.
    """

    enters: np.ndarray
    leaves: np.ndarray
    along: np.ndarray


class Force(NamedTuple):
    """A force at a point of a body, and a moment."""

    body: int
    point: np.ndarray
    force: np.ndarray
    moment: np.ndarray


class Span(NamedTuple):
    """A straight piece of tendon over a gap: its length, and how it turns at either end (rad)."""

    length: float
    exit_turning: float
    entry_turning: float


class State:
    """A solved state, the only one of its path, with all forces on its bodies.

    Attributes:
        forces: Force by force, but for tendons on the wall and lips opposite a spine.
        external: Those of them that act from outside, but for tendons.
        gap: Narrowest opening between edges of pieces at every notch, mm; inf where there is none.
        node_length: Length that each node of every notch stands for, mm; 0 for none.
        fibres: Those that the solver sums up, of every notch and node; None without.
        undecided: Whether a contact force is reported that may stand on either of two edges.
        tubes: The tube of every body, base first.
        materials: Their materials, at the temperature of the load.
        pull: Tension of every tendon at the base, behind its sheath, N.
        drawn: Tendon drawn out there, mm.
    """

    def __init__(self, robot: nf.Robot, load: nf.Load, path: nf.EquilibriumPath) -> None:
        self.robot, self.load, self.path, self.now = robot, load, path, path[0]
        self.origin, self.rotation = self.now.body_position, self.now.body_rotation
        self.node_length = path.chain.rods.length
        self.fibres = path.chain.rods.section.fibres
        self.tension = self.now.span_tension
        self.tubes = [robot.tube, *(one.tube or robot.tube for one in robot.notches)]
        made = [robot.material, *(one.material or robot.material for one in robot.notches)]
        self.materials = [at_temperature(one, load.temperature) for one in made]
        behind_sheaths = any(tendon.sheath_length for tendon in robot.tendon)
        self.pull = self.now.base_tension if behind_sheaths else self.now.tension
        self.drawn = self.now.base_stroke if behind_sheaths else self.now.stroke
        around = [*robot.notches[1:], None]
        behind = [one.spacing(after) for one, after in zip(robot.notches, around, strict=True)]
        self.length = np.array([robot.tube.base_length, *behind])
        self.tip = self.point(len(behind), behind[-1] * _Z)
        self.external = list(self._external())
        self.forces = list(self.external)
        self.spans = [self._tendon(number) for number in range(robot.number_of_tendons)]
        self.gap = np.full(len(behind), np.inf)
        self.undecided = False
        self._edges(self.now.contact_force)

    @property
    def height(self) -> float:
        """Height of all notches together, mm."""
        return sum(map(height_of, self.robot.notches))

    @property
    def reach(self) -> float:
        """Largest coordinate of any body, mm: what rounding of poses goes by."""
        return float(max(np.abs(self.origin).max(), np.abs(self.tip).max()))

    @property
    def rounding(self) -> float:
        """What of a force is rounding, N: 1e-13 of what would stretch the tube to twice its length.

        A tendon let go, and an edge that just does not touch, have so much instead of nothing.
        """
        bodies = zip(self.materials, self.tubes, strict=True)
        return 1e-13 * max(one.elastic_modulus * tube.outer_radius**2 for one, tube in bodies)

    def point(self, body: int, inside: np.ndarray) -> np.ndarray:
        """A point of a body in the world."""
        return self.origin[body] + self.rotation[body] @ inside

    def way(self, side: float, radius: float | None = None) -> list[Stop]:
        """The bodies that a line along the wall passes through, the base first.

        Args:
            side: Its direction, deg.
            radius: Its distance from the tube axis, mm: edges may lean. None is on the surface.
        """
        around = (None, *self.robot.notches, None)
        stops = [Stop(0, 0.0, self.length[0], False)]
        for body in range(1, len(around) - 1):
            for opening in around[body].openings(around[body - 1], around[body + 1]):
                if opening.admits(side):
                    last, inside = stops[-1], 0.0
                    if radius is not None and opening.side_deg is not None:
                        turn = np.radians(side - opening.side_deg)
                        inside = self.robot.tube.outer_radius - radius * np.cos(turn)
                    leaves = last.leaves + opening.leaves + inside * opening.leaves_rise
                    stops[-1] = last._replace(leaves=leaves)
                    enters = opening.enters + inside * opening.enters_rise
                    faces = opening.faces(side)
                    stops.append(Stop(body, enters, self.length[body], faces))
        return stops

    def stops(self, number: int) -> list[Stop]:
        """The bodies that a tendon passes through."""
        tendon = self.robot.tendon[number]
        way = self.way(tendon.direction_deg, tendon.radius)
        return [one for one in way if one.body <= self.end_body(number)]

    def beyond(
        self, body: int, about: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        """Sum up what acts on a body and those beyond it: force, moment about a point, sizes.

        The sizes are the sums of the magnitudes of forces and of moments.
        """
        chosen = [one for one in self.forces if one.body >= body]
        if not chosen:
            return np.zeros(3), np.zeros(3), (0.0, 0.0)
        _, points, forces, moments = (np.array(part) for part in zip(*chosen, strict=True))
        levers = np.cross(points - about, forces)
        sizes = [np.linalg.norm(part, axis=1).sum() for part in (forces, levers, moments)]
        return forces.sum(0), (levers + moments).sum(0), (sizes[0], sizes[1] + sizes[2])

    def tendon_place(self, number: int) -> np.ndarray:
        """Where a tendon crosses a section of the tube, mm."""
        tendon = self.robot.tendon[number]
        return tendon.radius * about_z(tendon.direction_deg)[:, 0]

    def end_body(self, number: int) -> int:
        """Body in which a tendon ends."""
        return self.robot.tendon[number].end_body or len(self.robot.notches)

    def holes(self, number: int) -> list[Hole]:
        """Holes of a tendon through the base and all bodies up to its end.

        That of a disk lies in the middle of its thickness, at the place of that disk, and halves
        the angle between the spans on its two sides in the straight robot. In the base it is
        parallel to the tube; where the tendon ends it goes on along the last span.
        """
        tendon, end = self.robot.tendon[number], self.end_body(number)
        base = self.tendon_place(number)
        radii = (tendon.radius, *(tendon.disk_radius or (tendon.radius,) * end))
        side = tendon.direction_deg
        sides = (side, *(tendon.disk_direction_deg or (side,) * end))
        if tendon.disk_radius is None and tendon.disk_direction_deg is None:
            return [Hole(base, base, _Z)] * (end + 1)
        middle = [r * about_z(turn)[:, 0] for r, turn in zip(radii, sides, strict=True)]
        spans = []
        for body in range(1, end + 1):
            rise = height_of(self.robot.notches[body - 1])
            rise += 0.5 * (self.length[body - 1] + self.length[body])
            span = middle[body] - middle[body - 1] + rise * _Z
            spans.append(span / np.linalg.norm(span))
        holes = [Hole(base, base, _Z)]
        for body in range(1, end + 1):
            along = spans[body - 1] + (spans[body] if body < end else 0.0)
            aside = along * (0.5 * self.length[body] / along[2])
            aside = aside - aside[2] * _Z
            along = along / np.linalg.norm(along)
            holes.append(Hole(middle[body] - aside, middle[body] + aside, along))
        return holes

    def _external(self):
        """External loads, as the load tells them."""
        load, last, none = self.load, len(self.origin) - 1, np.zeros(3)
        for one in load.body_forces:
            turn = self.rotation[one.body] if one.following else np.eye(3)
            at = self.point(one.body, np.array(one.point))
            yield Force(one.body, at, turn @ one.force, turn @ one.moment)
        turn = self.rotation[last] if load.following else np.eye(3)
        hangs = self.tip + self.rotation[last] @ load.tip_point
        yield Force(last, hangs, turn @ load.tip_force, turn @ load.tip_moment)
        down = 1e-3 * np.array(load.gravity or (0.0, 0.0, -9.81))  # N/g
        yield Force(last, hangs, load.tip_mass * down, none)
        if load.gravity is not None:
            for body, (mass, centre) in enumerate(
                zip(self.path.chain.body_mass, self.path.chain.body_centre, strict=True)
            ):
                yield Force(body, self.point(body, np.asarray(centre)), mass * down, none)

    def _tendon(self, number: int) -> list[Span]:
        """Pull of a straight tendon on the bodies it leaves and enters; its spans, base to tip."""
        tendon = self.robot.tendon[number]
        if tendon.path == "wall-arc":
            return []
        none, spans = np.zeros(3), []
        stops, holes = self.stops(number), self.holes(number)
        for i, (before, behind) in enumerate(pairwise(stops)):
            out, into = holes[before.body], holes[behind.body]
            leaves = self.point(before.body, out.leaves + before.leaves * _Z)
            enters = self.point(behind.body, into.enters + behind.enters * _Z)
            channel = self.rotation[before.body] @ out.along
            onward = self.rotation[behind.body] @ into.along
            length = float(np.linalg.norm(enters - leaves))
            along = (enters - leaves) / length if length else channel
            # Read as dead or follower the pull stands on the entry, whatever way the span goes.
            at = leaves if tendon.path == "straight" else enters
            pulls = {"straight": along, "straight-dead": channel, "straight-follower": onward}
            pull = self.tension[number, 2 * i + 1] * pulls[tendon.path]
            self.forces += [
                Force(before.body, at, pull, none),
                Force(behind.body, enters, -pull, none),
            ]
            spans.append(Span(length, angle(channel, along), angle(along, onward)))
        return spans

    def _edges(self, reported: np.ndarray) -> None:
        """Gaps between edges of pieces, and the forces where they touch."""
        around = (None, *self.robot.notches, None)
        sides = {
            opening.side_deg % 360.0
            for body in range(1, len(around) - 1)
            for opening in around[body].openings(around[body - 1], around[body + 1])
            if opening.side_deg is not None
        }
        touching: dict[int, list[tuple[int, np.ndarray, np.ndarray]]] = {}
        for side in sides:
            out = self.robot.tube.outer_radius * about_z(side)[:, 0]
            for before, behind in pairwise(self.way(side)):
                if not behind.faces:
                    continue
                normal = self.rotation[before.body] @ _Z
                edge = self.point(behind.body, out + behind.enters * _Z)
                gap = (edge - self.point(before.body, out + before.leaves * _Z)) @ normal
                notch = behind.body - 1
                self.gap[notch] = min(self.gap[notch], gap)
                if gap < _TOUCHES * height_of(self.robot.notches[notch]):
                    touching.setdefault(notch, []).append((before.body, edge, normal))
        for notch in np.flatnonzero(np.isfinite(self.gap) & (reported > 0.0)):
            places = touching.get(int(notch), [])
            self.undecided |= len(places) != 1
            for body, edge, normal in places[:1]:
                push = reported[notch] * normal
                self.forces += [
                    Force(int(notch) + 1, edge, push, np.zeros(3)),
                    Force(body, edge, -push, np.zeros(3)),
                ]


def height_of(notch: nf.ArcNotch | nf.RodGap | nf.TableNotch) -> float:
    """Length of the gap of a notch along the tube, mm."""
    return notch.length if isinstance(notch, nf.RodGap | nf.TableNotch) else notch.height


@lru_cache(maxsize=4096)
def about_z(degrees: float) -> np.ndarray:
    """Rotation about the tube axis; its first column is a direction across the tube."""
    return Rotation.from_euler("z", degrees, degrees=True).as_matrix()


def angle(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions, exact for small ones too."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), one @ other))
