"""The camera, and what is known of its view before a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from notchflex.photographs.chain_table import Numbers

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
        named = dict(zip(VIEW, numbers.T, strict=False))
        self.angles = numbers[:, NUMBERS : NUMBERS + notches]
        lengths = numbers[:, NUMBERS + notches :]
        if not lengths.size:
            lengths = np.zeros((len(numbers), 3 * notches + 1))
        kerf, cut, self.moved = np.split(lengths, [notches, 2 * notches], axis=1)
        self.scale = np.exp(named["log_scale"])
        self.place = numbers[:, :2]
        self.perspective = named["perspective"]
        self.kerf, self.cut = named["kerf"][:, None] + kerf, named["cut"][:, None] + cut
        # Axes of the base in camera axes (right, down, forward). At first z points right, x down.
        turns = np.stack([named["direction"], -named["tilt"], named["roll"]], axis=1)
        axes = Rotation.from_euler("ZYX", turns).as_matrix()
        self.z, self.x, self.y = np.moveaxis(axes, -1, 0)

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
    """Frames of points in the plane (x, z), (b, N, 2), turned by angles, (b, N); camera axes."""

    def __init__(self, view: View, start: Numbers, turned: Numbers) -> None:
        x, z = view.x[:, None], view.z[:, None]
        cos, sin = np.cos(turned)[..., None], np.sin(turned)[..., None]
        self.view = view
        self.origin = start[..., :1] * x + start[..., 1:] * z
        self.axis = cos * z + sin * x
        self.x = cos * x - sin * z

    def on_axis(self, along: Numbers) -> Numbers:
        """Return points on the tube axis, at lengths from the start of the body, mm."""
        return self.origin + along[..., None] * self.axis

    def lateral(self, centre: Numbers) -> tuple[Numbers, Numbers]:
        """Return unit vectors across the axis: across the line of sight too, and toward the eye."""
        ray = self.view.ray(centre)
        across = _unit(np.cross(self.axis, ray))
        across *= np.where(dot(across, self.x) < 0.0, -1.0, 1.0)[..., None]
        toward = dot(ray, self.axis)[..., None] * self.axis - ray
        return across, _unit(toward)


def dot(left: NDArray[Any], right: NDArray[Any]) -> Numbers:
    """Return the scalar products of vectors, (..., 3)."""
    return np.einsum("...i,...i->...", left, right)


def _unit(vector: NDArray[Any]) -> Numbers:
    return vector / np.sqrt(dot(vector, vector))[..., None]


@dataclass(frozen=True)
class ViewPrior:
    """Prior of the view at one position of a photograph, from a board or a number.

    Attributes:
        scale: Pixels per mm there; NaN if it is not known.
        scale_deviation: Standard deviation of its logarithm; infinite if it is not known.
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

    def tilt(self, direction: float) -> float:
        """Return the tilt of a tube that lies in the plane, by its direction, rad."""
        return math.atan(self.slope[0] * math.cos(direction) + self.slope[1] * math.sin(direction))

    def smaller(self, factor: float) -> ViewPrior:
        """Return the same for a photograph that was made smaller by a factor."""
        return replace(self, scale=self.scale * factor)


NO_PRIOR = ViewPrior()
