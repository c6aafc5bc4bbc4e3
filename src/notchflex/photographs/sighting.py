"""Scale, tilt and distance of a photograph: from a board, a number, or the robot itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from notchflex import InputError
from notchflex.photographs.board import Board
from notchflex.photographs.camera import NO_PRIOR, ViewPrior
from notchflex.photographs.chain_table import Numbers
from notchflex.photographs.edges import Contrast
from notchflex.support import check_number

NOT_SEEN = "no marker of the board is seen; check its layout, and that all of it is sharp and lit"
NOT_FLAT = "the markers do not lie as on the board; check its layout, and that it is flat"

_LAID_SCALE, _LAID_TILT = 0.003, math.radians(2.0)
"""How well a tube lies in the plane of the board: logarithm of the scale, and rad."""
_SLOPE, _CAMERA, _CAMERA_SPREAD, _MAX_CAMERA = 0.15, 0.004, 0.006, 0.03
"""What slopes (mm/mm) and inverse distances of cameras (1/mm) usually are."""
_FIRST_NOISE, _MIN_NOISE = 0.3, 0.1  # px, of corners
_MAX_OFF = 0.05  # of the side of a marker: how far a corner may lie beside the board
_ALIKE = 6.0  # sum of squares by which a mirrored tilt must fit worse
_STEP = 1e-6


@dataclass(frozen=True)
class Sighting:
    """A board as it is seen in a photograph.

    Attributes:
        numbers: Place of its middle from that of the photograph (px), turn (rad), logarithm of the
            scale (px/mm), slopes (mm deeper for every mm to the right, and down), and inverse
            distance of the camera (1/mm).
        spread: Their covariance, (7, 7).
        corners: Corners of the markers that are seen, px, (m, 4, 2).
        middle: Middle of the photograph, px, (2,).
    """

    numbers: Numbers
    spread: Numbers
    corners: Numbers
    middle: Numbers

    def prior(self, position: Numbers) -> ViewPrior:
        """Return what the board says of a robot at a place of the photograph, px."""
        scale = self._scale(self.numbers, position)
        steps = self.numbers + _STEP * np.eye(7)
        slopes = np.array([self._scale(numbers, position) - scale for numbers in steps]) / _STEP
        scale_deviation = math.sqrt(float(slopes @ self.spread @ slopes))
        deviation = np.sqrt(np.diag(self.spread))
        away = math.exp(self.numbers[3] - scale)
        return ViewPrior(
            math.exp(scale),
            math.hypot(scale_deviation, _LAID_SCALE),
            (float(self.numbers[4]), float(self.numbers[5])),
            math.hypot(float(deviation[4:6].max()), _LAID_TILT),
            float(self.numbers[6]) / away,
            float(deviation[6]),
        )

    def hidden(self, contrast: Contrast) -> Contrast:
        """Return the contrast of the photograph without the board."""
        import cv2

        size = float(np.linalg.norm(np.diff(self.corners, axis=1), axis=-1).mean())
        hull: Any = cv2.convexHull(self.corners.reshape(-1, 2).astype(np.float32))
        value = contrast.value.copy()
        outline = np.round(hull).astype(np.int32)
        cv2.fillPoly(value, [outline], 0.0)
        cv2.polylines(value, [outline], True, 0.0, max(3, round(0.25 * size)))
        return replace(contrast, value=value)

    def _scale(self, numbers: Numbers, position: Numbers) -> float:
        """Return the logarithm of the scale where the plane of the board is seen at a place."""
        offset, scale = position - self.middle, math.exp(numbers[3])
        slope, near = numbers[4:6], numbers[6]
        # The plane there is z = slope xy deep, and seen = (first + scale xy) / (1 + near z).
        depth = float(slope @ (offset - numbers[:2])) / scale
        depth /= 1.0 - near * float(slope @ offset) / scale
        return float(numbers[3]) - math.log1p(near * depth)


def sight(picture: NDArray[np.uint8], board: Board) -> Sighting | str:
    """Find a board in a photograph, (height, width, 3); return why not if it is not found."""
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(board.opencv_dictionary(), parameters)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    markers: Any = detector.detectMarkers(grey)
    names = np.zeros(0, int) if markers[1] is None else np.ravel(markers[1])
    is_known = names < board.columns * board.rows
    if not is_known.any():
        return NOT_SEEN
    corners = np.array(markers[0], float).reshape(-1, 4, 2)[is_known]
    middle = (np.array([picture.shape[1], picture.shape[0]]) - 1.0) / 2.0
    points = board.corners()[names[is_known]].reshape(-1, 2)
    fitted = _fitted(points, corners.reshape(-1, 2) - middle)
    if fitted is None:
        return NOT_FLAT
    return Sighting(*fitted, corners, middle)


def _fitted(points: Numbers, corners: Numbers) -> tuple[Numbers, Numbers] | None:
    """Fit a plane before a camera to corners; return its numbers and their covariance."""
    flat, complex_seen = points @ [1.0, 1.0j], corners @ [1.0, 1.0j]
    first, turn = np.linalg.lstsq(
        np.stack([np.ones_like(flat), flat], axis=1), complex_seen, rcond=None
    )[0]
    start = [first.real, first.imag, math.atan2(turn.imag, turn.real), math.log(abs(turn))]

    def residuals(numbers: Numbers) -> Numbers:
        off = (_projected(numbers, points) - corners).ravel() / _FIRST_NOISE
        near = (numbers[6] - _CAMERA) / _CAMERA_SPREAD
        return np.concatenate([off, numbers[4:6] / _SLOPE, [near]])

    upright = _least(residuals, np.array([*start, 0.0, 0.0, _CAMERA]))
    # Seen from far away, a plane with the opposite tilt looks the same.
    opposite = _least(residuals, upright.x * [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
    best, mirrored = sorted((upright, opposite), key=lambda result: result.cost)
    off = np.linalg.norm(_projected(best.x, points) - corners, axis=1)
    side = float(np.linalg.norm(points[1] - points[0])) * math.exp(best.x[3])
    if off.max() > _MAX_OFF * side:
        return None
    noise = math.sqrt(float((off**2).sum()) / max(1, 2 * len(corners) - 7))
    widened = max(noise, _MIN_NOISE) / _FIRST_NOISE
    spread = np.linalg.inv(best.jac.T @ best.jac) * max(widened, 1.0) ** 2
    if 2.0 * (mirrored.cost - best.cost) / widened**2 < _ALIKE:
        both = 0.5 * (best.x - mirrored.x)[4:6]
        best.x[4:6] -= both
        spread[4:6, 4:6] += np.outer(both, both)
    return best.x, spread


def _least(residuals: Callable[[Numbers], Numbers], start: Numbers) -> Any:
    bound = np.full(7, np.inf)
    low = np.append(-bound[:6], 0.0)
    return least_squares(residuals, start, bounds=(low, [*bound[:6], _MAX_CAMERA]), x_scale="jac")


def _projected(numbers: Numbers, points: Numbers) -> Numbers:
    """Return where points of a board are seen, px from the middle of the photograph, (N, 2)."""
    cos, sin = math.cos(numbers[2]), math.sin(numbers[2])
    flat = points @ np.array([[cos, sin], [-sin, cos]])
    slope = numbers[4:6]
    steep = math.sqrt(1.0 + float(slope @ slope))
    # The least rotation that lays the board into the plane z = slope xy.
    along = (flat @ slope) / (steep * (1.0 + steep))
    position = flat - along[:, None] * slope
    away = 1.0 + numbers[6] * (position @ slope)
    return (numbers[:2] + math.exp(numbers[3]) * position) / away[:, None]


_KNOWN = 0.003
"""How well a scale that is given as a number is known, as a part of it."""


@dataclass(frozen=True)
class Ruler:
    """Information about the scale of all photographs, beside the outer diameter of the robot.

    Attributes:
        scale: Pixels of the photographs per mm, at the robot; None if it is not given.
        board: Board beside the robot, in the plane in which it bends.
    """

    scale: float | None = None
    board: Board | None = None

    def __post_init__(self) -> None:
        """Check both.

        Raises:
            InputError: Both are given, or one is not a scale or not a board.
        """
        if self.scale is not None:
            if self.board is not None:
                raise InputError.CONFLICT("a board gives the scale too; leave out scale or board")
            scale = check_number(self.scale, "scale", "a number of px/mm")
            if not 0.0 < scale < math.inf:
                raise InputError.OUT_OF_RANGE(f"scale must be above 0 px/mm, not {scale:g}")
        if self.board is not None:
            self.board.opencv_dictionary()

    def read(self, picture: NDArray[np.uint8], factor: float) -> RulerReading | str:
        """Read the scale from a photograph, (height, width, 3); return why the board is not found.

        Args:
            picture: The photograph.
            factor: By how much it was made smaller.
        """
        if self.scale is not None:
            return RulerReading(ViewPrior(self.scale * factor, _KNOWN))
        if self.board is None:
            return RulerReading()
        sighting = sight(picture, self.board)
        return sighting if isinstance(sighting, str) else RulerReading(board=sighting)


@dataclass(frozen=True)
class RulerReading:
    """What a ruler gives for one photograph: a prior of the view.

    Attributes:
        everywhere: Prior for the whole photograph.
        board: The board that is seen.
    """

    everywhere: ViewPrior = NO_PRIOR
    board: Sighting | None = None

    def prior(self, position: Numbers) -> ViewPrior:
        """Return the prior of the view of a robot at a position in the photograph, px."""
        return self.everywhere if self.board is None else self.board.prior(position)

    def hidden(self, contrast: Contrast) -> Contrast:
        """Return the contrast of the photograph without the board."""
        return contrast if self.board is None else self.board.hidden(contrast)


NO_RULER = Ruler()
