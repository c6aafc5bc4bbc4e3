"""The link J of a robot with slots from two sides: a strip with two curved ends (Gao 2017).

Gao 2017, eq. 6-13. A slot ends in a half circle of the radius r_c. Round the end of one slot the
strip turns toward the next rigid piece, over the segment S1 (parameter t from 0 to 1, the strip's
straight part S2 beginning at t = 1); the segment S3 at the strip's other end is S1 turned by half
a turn. In the frame of S1 the origin is the centre of that half circle, y points along the strip
and z along the tube; headings are counted from y toward z.

Lengths mm, angles rad. Formulas take t of any shape.

The rod follows the strip's middle line from the wall piece on one side of the tube to that on the
other: curved end, straight part, curved end (eq. 6-13). Its section is that of two walls, as thick
as the strip there and as wide as the wall of the tube at that distance from the axis; the paper
prints b h for the area of both, which must be 2 b h.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array

from notchflex._arrays import plain_number, xp
from notchflex._jax import scan
from notchflex.mechanics.ends import Dimension, left_ranges
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    about_neutral_axis,
    course_poses,
    course_rod,
    rod_quadrature,
)
from notchflex.mechanics.flexure.rod import Rod, Site, rod, validity_warnings
from notchflex.mechanics.flexure.roots import (
    STRIP_UNCHECKED,
    rooted_strip_rod,
    round_strip,
    wall_ranges,
    walls_at,
)
from notchflex.mechanics.section import clamped_torsion_constant, gauss_on, two_walls
from notchflex.robot import Tube, ULink


@dataclass(frozen=True)
class CurvedEnd:
    """Segment S1 of a link J."""

    slot_radius: float
    strip_thickness: float

    @property
    def outer_length(self) -> float:
        """Length d_e by which the edge N outreaches the slot's end, mm."""
        # It makes the middle line begin square to the cut from M to N: the root of
        # d_e² + r_c d_e = (π/2) r_c (r_c + l_s).
        radius = self.slot_radius
        beyond = 2.0 * np.pi * radius * (radius + self.strip_thickness)
        return 0.5 * beyond / (radius + plain_number(xp.sqrt(radius**2 + beyond)))

    @property
    def angle(self) -> float:
        """Angle alpha between the strip and the cut where S1 begins, rad (Gao 2017, eq. 10)."""
        return plain_number(xp.arctan2(self.slot_radius + self.strip_thickness, self.outer_length))

    def inner_edge(self, t: Any) -> Array:
        """Compute the points M on the slot's round end: (..., 2), (y, z) in mm."""
        turn = 0.5 * np.pi * xp.asarray(t)
        return self.slot_radius * xp.stack([-xp.cos(turn), xp.sin(turn)], axis=-1)

    def outer_edge(self, t: Any) -> Array:
        """Compute the points N on the other edge of the material, that of the next slot."""
        along = -(self.outer_length + self.slot_radius) * (1.0 - xp.asarray(t))
        above = xp.full_like(along, self.slot_radius + self.strip_thickness)
        return xp.stack([along, above], axis=-1)

    def middle(self, t: Any) -> Array:
        """Compute the points C of the middle line, mm."""
        return 0.5 * (self.inner_edge(t) + self.outer_edge(t))

    def thickness(self, t: Any) -> Array:
        """Compute the thickness |N - M| of the material, mm."""
        return xp.linalg.norm(self.outer_edge(t) - self.inner_edge(t), axis=-1)

    def _first_derivative(self, t: Any) -> Array:
        turn = 0.5 * np.pi * xp.asarray(t)
        inner = 0.5 * np.pi * self.slot_radius * xp.stack([xp.sin(turn), xp.cos(turn)], axis=-1)
        return 0.5 * (inner + xp.array([self.outer_length + self.slot_radius, 0.0]))

    def heading(self, t: Any) -> Array:
        """Compute the direction of the middle line: from pi/2 - alpha at 0 to 0 at 1."""
        first = self._first_derivative(t)
        return xp.arctan2(first[..., 1], first[..., 0])

    def curvature(self, t: Any) -> Array:
        """Compute the signed curvature, negative, 1/mm."""
        # |C' x C''| / |C'|³: Gao's eq. 8 leaves out the denominator, but C has not unit speed.
        turn, first = 0.5 * np.pi * xp.asarray(t), self._first_derivative(t)
        second = 0.5 * (0.5 * np.pi) ** 2 * self.slot_radius
        second = second * xp.stack([xp.cos(turn), -xp.sin(turn)], axis=-1)
        cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
        return cross / self._speed(t) ** 3

    def length(self, t: Any = 1.0) -> Array:
        """Compute the length of the middle line from 0 to t, mm (Gao 2017, eq. 9 for t = 1)."""
        # Ten nodes are exact for this smooth integral, a third of a turn at most.
        parts, weights = gauss_on(0.0, xp.asarray(t, float)[..., None], 10)
        return xp.sum(self._speed(parts) * weights, axis=-1)

    def _speed(self, t: Any) -> Array:
        """Compute |C'|, written out: it is evaluated at some thousand points per link."""
        inner, outer = 0.5 * np.pi * self.slot_radius, self.outer_length + self.slot_radius
        return 0.5 * xp.sqrt(inner**2 + outer**2 + 2.0 * inner * outer * xp.sin(0.5 * np.pi * t))

    def at_length(self, length: Any) -> Array:
        """Find the parameter t where the middle line has a given length from its beginning."""

        def closer(t: Any, _: Any) -> tuple[Any, tuple[()]]:
            return t - (self.length(t) - length) / self._speed(t), ()

        # The speed varies by a few tenths: the fourth step is below 1e-16.
        return scan(closer, length / self.length(), (np.zeros(4),))[0]


class Course(NamedTuple):
    """The middle line at some positions."""

    along: Array  # Its points, along the strip from the middle of the straight part, mm
    above: Array  # The same across the strip, along the tube, mm
    heading: Array  # Its direction, the same at both ends, rad
    # Signed curvature, first negative, then positive, 1/mm (Gao 2017, eq. 11)
    curvature: Array
    thickness: Array  # Thickness of the material, mm


@dataclass(frozen=True)
class Link:
    """The whole link: S1, the straight part S2, and S3, which is S1 turned by half a turn."""

    # Positions are lengths along the middle line from its start; points (along, above) are relative
    # to the middle of the straight part.

    slot_radius: float
    strip_thickness: float
    strip_length: float

    @cached_property
    def end(self) -> CurvedEnd:
        """Its curved end."""
        return CurvedEnd(self.slot_radius, self.strip_thickness)

    @cached_property
    def length(self) -> float:
        """Length of the middle line, mm."""
        return 2.0 * plain_number(self.end.length()) + self.strip_length

    def course(self, part: Any) -> Course:
        """Evaluate the middle line at parts of it: 0 to 1 on S1, to 2 on S2 and to 3 on S3."""
        place, end = np.asarray(part, dtype=float), self.end
        curved, half = (place < 1.0) | (place > 2.0), np.where(place <= 1.5, 1.0, -1.0)
        nearer = np.minimum(place, 3.0 - place)
        # Each place once: S3 has those of S1, and S2 begins where these end.
        on_end, back = np.unique(np.round(np.clip(nearer, 0.0, 1.0), 14), return_inverse=True)
        t = end.at_length(on_end * end.length())[back]
        points = end.middle(t)
        straight = (nearer - 1.0) * self.strip_length
        along = xp.where(curved, points[..., 0], straight)
        above = points[..., 1] - self.slot_radius - 0.5 * self.strip_thickness
        return Course(
            along=half * (along - 0.5 * self.strip_length),
            above=half * xp.where(curved, above, 0.0),
            heading=xp.where(curved, end.heading(t), 0.0),
            curvature=xp.where(curved, half * end.curvature(t), 0.0),
            thickness=xp.where(curved, end.thickness(t), self.strip_thickness),
        )


@rod.register
def _(notch: ULink, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    if site is not None:
        return rooted_strip_rod(
            round_strip(notch, tube),
            tube,
            notch.height,
            refinement,
            site.poisson_ratio,
            direction_deg=notch.direction_deg,
        )
    nodes = 6 + 3 * refinement
    return u_link_rod(notch, tube, 3 + 3 * refinement, 1 + 2 * refinement, (nodes, nodes))


def u_link_rod(
    notch: ULink,
    tube: Tube,
    moment_modes: int = 3,
    force_modes: int = 1,
    nodes: tuple[int, int] = (6, 6),
    poisson_ratio: float = 0.33,
) -> Rod:
    """Build the rod of a link, from the proximal wall piece to the distal one."""
    # `nodes` are Gauss's in each curved end and in the straight part. Poisson's ratio only affects
    # the shape of the modes and the restraint of warping; the stiffness is that of the material.
    link = Link(notch.slot_radius, notch.strip_thickness, notch.strip_length)
    curved = link.length - link.strip_length
    ends = (0.0, 0.5 * curved, link.length - 0.5 * curved, link.length)
    counts = (nodes[0], nodes[1], nodes[0])
    # One node less moves the tip of 27 links by 4e-8 mm, modes left out by 1e-5 mm.
    points = rod_quadrature(ends, counts, tuple(count - 1 for count in counts))
    course = link.course(np.append(points.unit.positions, [0.0, 3.0]))
    width, apart = walls_at(course.along[:-2], tube)
    walls = two_walls(width, course.thickness[:-2], apart)
    torsion = clamped_torsion_constant(walls, apart, link.length, poisson_ratio)
    section = about_neutral_axis(walls, torsion)
    # A slot cut from the side away from the bend leaves the wall on the bend's side, where the
    # link then begins; over the slot that follows stands its mirror image.
    hand = 1.0 if notch.proximal_slot == "away" else -1.0
    # The strip lies above its proximal slot, whose lower edge is the proximal face.
    middle = xp.array([0.0, 0.0, 2.0 * notch.slot_radius + 0.5 * notch.strip_thickness])
    free = STRAIGHT + (hand * course.curvature[:-2])[:, None] * np.eye(6)[1]
    # The distal body's frame: level with the strip's lower edge, on the tube axis.
    distal, modes = 2.0 * notch.slot_radius, (moment_modes, force_modes)
    poses = course_poses(course.along, course.above, course.heading, middle, hand)
    options: dict[str, Any] = {"free": free, "direction_deg": notch.direction_deg}
    return course_rod(points, poses, section, middle, modes, distal, poisson_ratio, **options)


@validity_warnings.register
def _(notch: ULink, tube: Tube, site: Site) -> list[str]:
    thickness, length = notch.strip_thickness, notch.strip_length
    outer, radius = tube.outer_diameter, notch.slot_radius
    wide = "stretch and shear were found up to 10 % off"
    ranges: list[Dimension] = [
        ("strip length / strip thickness", length / thickness, [(1.7, 5.8, STRIP_UNCHECKED)]),
        ("strip length / outer diameter", length / outer, [(0.2, 0.5, STRIP_UNCHECKED)]),
        ("slot radius / strip thickness", radius / thickness, [(0.2, 0.8, STRIP_UNCHECKED)]),
        ("slot width / outer diameter", notch.height / outer, [(0.05, 0.16, wide)]),
    ]
    return left_ranges(wall_ranges(thickness, tube) + ranges)
