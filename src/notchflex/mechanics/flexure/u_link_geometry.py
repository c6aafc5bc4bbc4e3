r"""The middle line of Gao's flexible link J: a strip between two slots, and its two curved ends.

Gao 2017, eq. 6-13. A slot ends in a half circle of the radius r_c. Round the end of one slot the
strip turns toward the next rigid piece, over the segment S1 (parameter t from 0 to 1, the strip's
straight part S2 beginning at t = 1); the segment S3 at the strip's other end is S1 turned by half
a turn. In the frame of S1 the origin is the centre of that half circle, y points along the strip
and z along the tube; headings are counted from y toward z.

Lengths mm, angles rad. Formulas take t of any shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

# The arc length is a smooth integral over t, a third of a turn at most.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)

_EXACT = 1e-9  # a step of Newton this small leaves an error of 1e-18


@dataclass(frozen=True)
class CurvedEnd:
    """Segment S1 of a link J.

    Args:
        slot_radius: Radius r_c of the slot's round end, half the slot's width, mm.
        strip_thickness: Thickness l_s of the strip between two slots, mm.

    Example:
        >>> end = CurvedEnd(slot_radius=0.275, strip_thickness=0.70)
        >>> print(f"{end.outer_length:.6f} mm, {end.angle:.6f} rad, {end.length():.6f} mm")
        0.525882 mm, 1.076154 rad, 0.561031 mm
    """

    slot_radius: float
    strip_thickness: float

    @property
    def outer_length(self) -> float:
        """Length d_e by which the edge N outreaches the slot's end, mm.

        It makes the middle line begin square to the cut from M to N: the root of
        d_e² + r_c d_e = (π/2) r_c (r_c + l_s).
        """
        radius = self.slot_radius
        beyond = 2.0 * np.pi * radius * (radius + self.strip_thickness)
        return 0.5 * beyond / (radius + float(np.sqrt(radius**2 + beyond)))

    @property
    def angle(self) -> float:
        """Angle alpha between the strip and the cut where S1 begins, rad (Gao 2017, eq. 10)."""
        return float(np.arctan2(self.slot_radius + self.strip_thickness, self.outer_length))

    def inner_edge(self, t: ArrayLike) -> np.ndarray:
        """Compute the points M on the slot's round end: (..., 2), (y, z) in mm."""
        turn = 0.5 * np.pi * np.asarray(t, dtype=float)
        return self.slot_radius * np.stack([-np.cos(turn), np.sin(turn)], axis=-1)

    def outer_edge(self, t: ArrayLike) -> np.ndarray:
        """Compute the points N on the other edge of the material, that of the next slot."""
        t = np.asarray(t, dtype=float)
        along = -(self.outer_length + self.slot_radius) * (1.0 - t)
        return np.stack([along, np.full_like(t, self.slot_radius + self.strip_thickness)], axis=-1)

    def middle(self, t: ArrayLike) -> np.ndarray:
        """Compute the points C of the middle line."""
        return 0.5 * (self.inner_edge(t) + self.outer_edge(t))

    def thickness(self, t: ArrayLike) -> np.ndarray:
        """Compute the thickness |N - M| of the material, mm."""
        return np.linalg.norm(self.outer_edge(t) - self.inner_edge(t), axis=-1)

    def _first_derivative(self, t: ArrayLike) -> np.ndarray:
        turn = 0.5 * np.pi * np.asarray(t, dtype=float)
        inner = 0.5 * np.pi * self.slot_radius * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        return 0.5 * (inner + np.array([self.outer_length + self.slot_radius, 0.0]))

    def _second_derivative(self, t: ArrayLike) -> np.ndarray:
        turn = 0.5 * np.pi * np.asarray(t, dtype=float)
        inward = np.stack([np.cos(turn), -np.sin(turn)], axis=-1)
        return 0.5 * (0.5 * np.pi) ** 2 * self.slot_radius * inward

    def heading(self, t: ArrayLike) -> np.ndarray:
        """Compute the direction of the middle line: from pi/2 - alpha at 0 to 0 at 1."""
        first = self._first_derivative(t)
        return np.arctan2(first[..., 1], first[..., 0])

    def curvature(self, t: ArrayLike) -> np.ndarray:
        """Compute the signed curvature, negative, 1/mm.

        |C' x C''| / |C'|³: Gao's eq. 8 leaves out the denominator, but C has not unit speed.
        """
        first, second = self._first_derivative(t), self._second_derivative(t)
        cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
        return cross / np.linalg.norm(first, axis=-1) ** 3

    def length(self, t: ArrayLike = 1.0) -> np.ndarray:
        """Compute the length of the middle line from 0 to t, mm (Gao 2017, eq. 9 for t = 1)."""
        t = np.asarray(t, dtype=float)
        return 0.5 * t * (self._speed(0.5 * t[..., None] * (1.0 + _NODES)) @ _WEIGHTS)

    def _speed(self, t: np.ndarray) -> np.ndarray:
        """Compute |C'|, written out: it is evaluated at some thousand points per link."""
        inner, outer = 0.5 * np.pi * self.slot_radius, self.outer_length + self.slot_radius
        return 0.5 * np.sqrt(inner**2 + outer**2 + 2.0 * inner * outer * np.sin(0.5 * np.pi * t))

    def at_length(self, length: ArrayLike) -> np.ndarray:
        """Find the parameter t where the middle line has a given length from its beginning."""
        target = np.asarray(length, dtype=float)
        t = target / self.length()
        for _ in range(8):  # Newton; the speed varies by a few tenths, so half do
            step = (self.length(t) - target) / self._speed(t)
            t = t - step
            if np.max(np.abs(step), initial=0.0) < _EXACT:
                break
        return t


class Course(NamedTuple):
    """The middle line at some positions.

    Attributes:
        along: Its points, along the strip from the middle of the straight part, mm.
        above: The same across the strip, along the tube, mm.
        heading: Its direction, the same at both ends, rad.
        curvature: Signed curvature, first negative, then positive, 1/mm (Gao 2017, eq. 11).
        thickness: Thickness of the material, mm.
    """

    along: np.ndarray
    above: np.ndarray
    heading: np.ndarray
    curvature: np.ndarray
    thickness: np.ndarray


@dataclass(frozen=True)
class Link:
    """The whole link: S1, the straight part S2, and S3, which is S1 turned by half a turn.

    Positions are lengths along the middle line from its start; points (along, above) are relative
    to the middle of the straight part.

    Args:
        slot_radius: Radius of the slots' round ends, mm.
        strip_thickness: Thickness of the strip, mm.
        strip_length: Length of its straight part, mm.

    Example:
        >>> link = Link(slot_radius=0.275, strip_thickness=0.70, strip_length=2.0)
        >>> start = link.course(0.0)
        >>> print(f"{link.length:.6f} mm long, begins at {start.along:.6f}, {start.above:.4f} mm")
        3.122062 mm long, begins at -1.537941, -0.1375 mm
    """

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
        return 2.0 * float(self.end.length()) + self.strip_length

    def course_at(self, positions: tuple[float, ...]) -> Course:
        """Evaluate the middle line at some positions; cached, as both hands of a link need them."""
        return _course(self, positions)

    def course(self, position: ArrayLike) -> Course:
        """Evaluate the middle line at some positions."""
        position = np.asarray(position, dtype=float)
        end, nearer = self.end, np.minimum(position, self.length - position)
        of_end = end.length()
        curved, half = nearer < of_end, np.where(position <= 0.5 * self.length, 1.0, -1.0)
        t = np.ones_like(nearer)
        t[curved] = end.at_length(nearer[curved])
        points = end.middle(t)
        along = np.where(curved, points[..., 0], nearer - of_end)
        above = points[..., 1] - self.slot_radius - 0.5 * self.strip_thickness
        return Course(
            along=half * (along - 0.5 * self.strip_length),
            above=half * np.where(curved, above, 0.0),
            heading=np.where(curved, end.heading(t), 0.0),
            curvature=np.where(curved, half * end.curvature(t), 0.0),
            thickness=np.where(curved, end.thickness(t), self.strip_thickness),
        )


@lru_cache(maxsize=16)
def _course(link: Link, positions: tuple[float, ...]) -> Course:
    course = link.course(positions)
    for values in course:
        values.setflags(write=False)
    return course
