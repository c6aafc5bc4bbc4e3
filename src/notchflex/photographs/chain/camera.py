"""The camera, and what is known of its view before a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.chain.chain_table import Numbers

VIEW = ("x", "y", "direction", "log_scale", "roll", "tilt", "perspective", "kerf", "cut")
"""Numbers of a view, before the angles: place of the start of the first notch from the middle of
the photograph (px), direction of the base (rad), logarithm of the scale (px/mm), roll about the
tube axis and tilt out of the photograph (rad), inverse distance of the camera (1/mm), and what the
notches are higher and deeper than in the robot file (mm). The angles of the n notches follow (rad).
Where every notch is measured too, 3 n + 1 lengths follow these (mm): what each is higher and deeper
than the others, how far each lies nearer to the tip than in the robot file, and the tip."""
NUMBERS = len(VIEW)


class View:
    """The numbers of b views of a robot of n notches."""

    def __init__(self, numbers: Numbers, notches: int) -> None:
        one = dict(zip(VIEW, numbers.T, strict=False))
        self.angles = numbers[:, NUMBERS : NUMBERS + notches]
        own = numbers[:, NUMBERS + notches :]
        if not own.size:
            own = np.zeros((len(numbers), 3 * notches + 1))
        kerf, cut, self.moved = np.split(own, [notches, 2 * notches], axis=1)
        self.scale = np.exp(one["log_scale"])
        self.place = numbers[:, :2]
        self.perspective = one["perspective"]
        self.kerf, self.cut = one["kerf"][:, None] + kerf, one["cut"][:, None] + cut
        rotation = _rotation(one["direction"], one["roll"], one["tilt"])
        self.x, self.y, self.z = rotation[..., 0], rotation[..., 1], rotation[..., 2]

    def seen(self, point: Numbers) -> Numbers:
        """Project points of camera axes, mm from the start of the first notch, (b, N, 3)."""
        scale, near = self.scale[:, None, None], self.perspective[:, None, None]
        return (self.place[:, None] + scale * point[..., :2]) / (1.0 + near * point[..., 2:])

    def ray(self, point: Numbers) -> Numbers:
        """Return unit vectors from the camera to points, (b, N, 3)."""
        near = self.perspective[:, None]
        ray = np.empty_like(point)
        ray[..., :2] = near[..., None] * (
            point[..., :2] + (self.place / self.scale[:, None])[:, None]
        )
        ray[..., 2] = 1.0 + near * point[..., 2]
        return _unit(ray)


class Frame:
    """Frames of points on bodies, in camera axes."""

    def __init__(self, view: View, start: Numbers, turned: Numbers, ring: NDArray[np.int_]) -> None:
        self._set(view, start[:, ring], turned[:, ring])

    @classmethod
    def of(cls, view: View, start: Numbers, turned: Numbers) -> Frame:
        """Return frames at points of the plane (x, z), (b, N, 2), turned by angles, (b, N)."""
        frame = cls.__new__(cls)
        frame._set(view, start, turned)
        return frame

    def _set(self, view: View, start: Numbers, turned: Numbers) -> None:
        x, z = view.x[:, None], view.z[:, None]
        cos, sin = np.cos(turned)[..., None], np.sin(turned)[..., None]
        self.view = view
        self.origin = start[..., :1] * x + start[..., 1:] * z
        self.axis = cos * z + sin * x
        self.x = cos * x - sin * z

    def at(self, along: Numbers) -> Numbers:
        """Return points on the tube axis, at lengths from the start of the body, mm."""
        return self.origin + along[..., None] * self.axis

    def lateral(self, centre: Numbers) -> tuple[Numbers, Numbers]:
        """Return unit vectors across the axis: across the line of sight too, and toward the eye."""
        ray = self.view.ray(centre)
        across = _unit(_cross(self.axis, ray))
        across *= np.where(dot(across, self.x) < 0.0, -1.0, 1.0)[..., None]
        toward = dot(ray, self.axis)[..., None] * self.axis - ray
        return across, _unit(toward)


def dot(one: Numbers, other: Numbers) -> Numbers:
    """Return the scalar products of vectors, (..., 3)."""
    return np.einsum("...i,...i->...", one, other)


def _unit(vector: Numbers) -> Numbers:
    return vector / np.sqrt(dot(vector, vector))[..., None]


def _cross(one: Numbers, other: Numbers) -> Numbers:
    """Return the vector products; `np.cross` takes three times as long."""
    ax, ay, az = one[..., 0], one[..., 1], one[..., 2]
    bx, by, bz = other[..., 0], other[..., 1], other[..., 2]
    product = np.empty(np.broadcast_shapes(one.shape, other.shape))
    product[..., 0], product[..., 1], product[..., 2] = (
        ay * bz - az * by,
        az * bx - ax * bz,
        ax * by - ay * bx,
    )
    return product


def _rotation(direction: Numbers, roll: Numbers, tilt: Numbers) -> Numbers:
    """Return the axes of the base in camera axes (right, down, forward), as columns, (b, 3, 3)."""
    zero, one = np.zeros_like(roll), np.ones_like(roll)
    cos, sin = np.cos(roll), np.sin(roll)
    rolled = _matrix([[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]])
    # z of the base to the right, x down, y forward
    laid = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    cos, sin = np.cos(tilt), np.sin(tilt)
    tilted = _matrix([[cos, zero, -sin], [zero, one, zero], [sin, zero, cos]])
    cos, sin = np.cos(direction), np.sin(direction)
    turned = _matrix([[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]])
    return turned @ tilted @ laid @ rolled


def _matrix(rows: list[list[Numbers]]) -> Numbers:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@dataclass(frozen=True)
class ViewPrior:
    """Prior of the view at one position of a photograph, from a board or a ruler.

    Attributes:
        scale: Pixels per mm there; NaN if it is not known.
        scale_deviation: Standard deviation of its logarithm.
        slope: How a plane through the robot leads away from the camera along the axes of the
            photograph, (2,): mm deeper for every mm to the right, and down.
        slope_deviation: Standard deviation of the tilt that follows from it, rad; infinite if it
            is not known.
        perspective: Inverse distance of the camera, 1/mm.
        perspective_deviation: Its standard deviation; infinite if it is not known.
    """

    scale: float = math.nan
    scale_deviation: float = math.inf
    slope: tuple[float, float] = (0.0, 0.0)
    slope_deviation: float = math.inf
    perspective: float = 0.0
    perspective_deviation: float = math.inf

    @property
    def has_scale(self) -> bool:
        """Whether the scale is known."""
        return math.isfinite(self.scale_deviation)

    def tilt(self, direction: float) -> float:
        """Return the tilt of a tube that lies in the plane, by its direction, rad."""
        return math.atan(self.slope[0] * math.cos(direction) + self.slope[1] * math.sin(direction))

    def smaller(self, factor: float) -> ViewPrior:
        """Return the same for a photograph that was made smaller by a factor."""
        return replace(self, scale=self.scale * factor)

    def contradicted(self, numbers: Numbers) -> bool:
        """Whether a fit has another scale."""
        return (
            self.has_scale
            and abs(numbers[3] - math.log(self.scale)) > _APART * self.scale_deviation
        )


NO_PRIOR = ViewPrior()
_APART = 3.0  # standard deviations
