"""Scale, tilt and distance of a photograph: by a number, or by a board of markers, drawn here."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import approx_fprime, least_squares

from notchflex import InputError
from notchflex.photographs.edges import Contrast, Numbers
from notchflex.photographs.outline import ViewPrior
from notchflex.support import AnyPath, check_integer, check_number, need, write_text

DICTIONARIES = (
    *(f"{bits}x{bits}_{count}" for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)),
    *("apriltag_16h5", "apriltag_25h9", "apriltag_36h10", "apriltag_36h11"),
)
"""Names of the sets of markers, as in OpenCV without `DICT_`."""

_MOST = {"columns": 40, "rows": 40, "marker": 1000.0, "gap": 1000.0}  # markers, and mm
_LENGTH = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)"
_LAYOUT = re.compile(rf"(\d+)x(\d+),marker={_LENGTH},gap={_LENGTH}(?:,dictionary=(\w+))?", re.I)


@dataclass(frozen=True)
class Board:
    """Square markers in a grid, numbered from the top left, row by row.

    Attributes:
        columns: Markers in a row.
        rows: Rows of markers.
        marker: Side of a marker, mm, as printed.
        gap: Distance between neighbouring markers, mm.
        dictionary: The set of markers, one of `DICTIONARIES`.

    Example:
        >>> import notchflex as nf
        >>> nf.Board(columns=4, rows=3, marker=5.0, gap=1.5).size
        (24.5, 18.0)
    """

    columns: int
    rows: int
    marker: float
    gap: float
    dictionary: str = "4x4_50"

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            InputError: A number is out of range, or the dictionary is unknown or too small.
        """
        for name, most in _MOST.items():
            value, what = getattr(self, name), f"{name} of a board"
            if isinstance(most, int):
                check_integer(value, what)
            if not 0.0 < check_number(value, what, "a length in mm") <= most:
                raise InputError.OUT_OF_RANGE(
                    f"{what} must be above 0 and at most {most:g}, not {value!r}"
                )
        if self.dictionary not in DICTIONARIES:
            raise InputError.UNKNOWN_NAME(
                f"there is no dictionary {self.dictionary!r} of markers; there are "
                f"{', '.join(DICTIONARIES)}"
            )
        if self.gap < self.marker / 10.0:
            raise InputError.OUT_OF_RANGE(
                f"the gap between markers must be a tenth of their side or more; got {self.gap:g} "
                f"mm for markers of {self.marker:g} mm"
            )

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of all markers, mm."""
        step = self.marker + self.gap
        return self.columns * step - self.gap, self.rows * step - self.gap

    def corners(self) -> Numbers:
        """Return the corners of every marker from the middle of the board, mm, (m, 4, 2).

        x is to the right and y down; the corners go clockwise from the top left.
        """
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * self.marker
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        first = np.stack([column, row], axis=1) * (self.marker + self.gap)
        return first[:, None] + square - np.array(self.size) / 2.0

    def opencv_dictionary(self) -> Any:
        """Return the set of markers.

        Raises:
            InputError: OpenCV is not installed, or the set has fewer markers than the board.
        """
        need("cv2", "photographs", "a board of markers")
        import cv2

        name = self.dictionary.upper().replace("H", "h")
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
        if len(dictionary.bytesList) < self.columns * self.rows:
            raise InputError.OUT_OF_RANGE(
                f"{self.dictionary} has {len(dictionary.bytesList)} markers; a board of "
                f"{self.columns} x {self.rows} needs {self.columns * self.rows}"
            )
        return dictionary

    def cells(self) -> NDArray[np.bool_]:
        """Return which cells of every marker are white, with its black border, (m, c, c)."""
        dictionary = self.opencv_dictionary()
        side = dictionary.markerSize + 2
        markers = [
            dictionary.generateImageMarker(number, side, borderBits=1)
            for number in range(self.columns * self.rows)
        ]
        return np.array(markers) > 0

    def svg(self) -> str:
        """Return a drawing in its true size, in mm, with a white border."""
        cells, side = self.cells(), self.marker
        width, height = (length + 2.0 * side for length in self.size)
        cell = side / cells.shape[1]
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
            f'viewBox="0 0 {width:g} {height:g}" shape-rendering="crispEdges">',
            f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
        ]
        middle = np.array([width, height]) / 2.0
        for white, corner in zip(cells, self.corners()[:, 0] + middle, strict=True):
            x, y = corner
            lines.append(f'<rect x="{x:.6g}" y="{y:.6g}" width="{side:g}" height="{side:g}"/>')
            lines += [
                f'<rect x="{x + column * cell:.6g}" y="{y + row * cell:.6g}" '
                f'width="{cell:.6g}" height="{cell:.6g}" fill="white"/>'
                for row, column in np.argwhere(white)
            ]
        words = f"{self.text()}  check with a calliper: marker {side:g} mm"
        lines.append(
            f'<text x="{side:g}" y="{height - 0.3 * side:.6g}" font-family="sans-serif" '
            f'font-size="{min(0.4 * side, 1.6 * (width - side) / len(words)):.4g}">{words}</text>'
        )
        return "\n".join([*lines, "</svg>", ""])

    def text(self) -> str:
        """Return the board as `--board` reads it."""
        kind = "" if self.dictionary == "4x4_50" else f",dictionary={self.dictionary}"
        return f"{self.columns}x{self.rows},marker={self.marker:g},gap={self.gap:g}{kind}"

    def write_svg(self, target: AnyPath) -> None:
        """Write a drawing in its true size as SVG, for a printer; print it at 100 %.

        Raises:
            InputError: OpenCV is not installed, or the file cannot be written.
        """
        write_text(Path(target), self.svg())


def board_of(text: str) -> Board:
    """Return the board that a text describes, lengths in mm.

    Raises:
        InputError: The text is not a board.

    Example:
        >>> board_of("4x3,marker=5,gap=1.5").text()
        '4x3,marker=5,gap=1.5'
    """
    layout = _LAYOUT.fullmatch(re.sub(r"\s", "", text))
    if layout is None:
        raise InputError.BAD_SYNTAX(
            f"{text!r} is not a board; give columns x rows, and marker and gap in mm, such as "
            "4x3,marker=5,gap=1.5 or 4x3,marker=5,gap=1.5,dictionary=apriltag_36h11"
        )
    columns, rows, marker, gap, dictionary = layout.groups("4x4_50")
    return Board(int(columns), int(rows), float(marker), float(gap), dictionary)


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
    """A board as it is seen in a photograph that was made smaller by a factor.

    Attributes:
        numbers: Place of its middle from that of the photograph (px), turn (rad), logarithm of the
            scale (px/mm), slopes (mm deeper for every mm to the right, and down), and inverse
            distance of the camera (1/mm).
        spread: Their covariance, (7, 7).
        corners: Corners of the markers that are seen, px, (m, 4, 2).
        factor: The factor.
    """

    numbers: Numbers
    spread: Numbers
    corners: Numbers
    factor: float

    def prior(self, position: Numbers) -> ViewPrior:
        """Return what the board says of a robot at a position, px from the middle."""

        def log_scale(numbers: Numbers) -> float:
            seen, slope, near = self.factor * position, numbers[4:6], numbers[6]
            # The plane there is z = slope xy deep, and seen = (first + scale xy) / (1 + near z).
            rise = slope / math.exp(numbers[3])
            depth = float(rise @ (seen - numbers[:2])) / (1.0 - near * float(rise @ seen))
            return float(numbers[3]) - math.log1p(near * depth)

        scale = log_scale(self.numbers)
        slopes: Any = approx_fprime(self.numbers, log_scale, _STEP)
        deviation = np.sqrt(np.diag(self.spread))
        away = math.exp(self.numbers[3] - scale)
        return ViewPrior(
            (
                scale - math.log(self.factor),
                math.hypot(float(slopes @ self.spread @ slopes) ** 0.5, _LAID_SCALE),
            ),
            (float(self.numbers[4]), float(self.numbers[5])),
            math.hypot(deviation[4:6].max(), _LAID_TILT),
            (float(self.numbers[6]) / away, float(deviation[6])),
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


def sight(picture: NDArray[np.uint8], board: Board, factor: float = 1.0) -> Sighting | str:
    """Find a board in a photograph, (height, width, 3); return why not if it is not found.

    Args:
        picture: The photograph.
        board: The board.
        factor: By how much the photograph was made smaller.
    """
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(board.opencv_dictionary(), parameters)
    markers: Any = detector.detectMarkers(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))
    names = np.zeros(0, int) if markers[1] is None else np.ravel(markers[1])
    is_known = names < board.columns * board.rows
    if not is_known.any():
        return NOT_SEEN
    corners = np.array(markers[0], float).reshape(-1, 4, 2)[is_known]
    middle = 0.5 * np.array(picture.shape[1::-1]) - 0.5
    points = board.corners()[names[is_known]].reshape(-1, 2)
    fitted = _fitted(points, corners.reshape(-1, 2) - middle)
    return NOT_FLAT if fitted is None else Sighting(*fitted, corners, factor)


def _fitted(points: Numbers, corners: Numbers) -> tuple[Numbers, Numbers] | None:
    """Fit a plane before a camera to corners; return its numbers and their covariance."""
    flat, complex_seen = points @ [1.0, 1.0j], corners @ [1.0, 1.0j]
    turn, first = np.linalg.lstsq(np.vander(flat, 2), complex_seen, rcond=None)[0]

    def residuals(numbers: Numbers) -> Numbers:
        off = (_projected(numbers, points) - corners).ravel() / _FIRST_NOISE
        near = (numbers[6] - _CAMERA) / _CAMERA_SPREAD
        return np.concatenate([off, numbers[4:6] / _SLOPE, [near]])

    bounds = np.array([*6 * [(-np.inf, np.inf)], (0.0, _MAX_CAMERA)]).T
    solved: Any = partial(least_squares, residuals, bounds=tuple(bounds), x_scale="jac")
    start = [first.real, first.imag, np.angle(turn), np.log(np.abs(turn)), 0.0, 0.0, _CAMERA]
    upright = solved(start)
    # Seen from far away, a plane with the opposite tilt looks the same.
    opposite = solved(upright.x * [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0])
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
    """What gives the scale of all photographs, beside the outer diameter of the robot.

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

    def read(
        self, picture: NDArray[np.uint8], contrast: Contrast
    ) -> tuple[Callable[[Numbers], ViewPrior], Contrast] | str:
        """Read the scale from a photograph, (height, width, 3); return why the board is not found.

        Returns:
            The prior of the view of a robot at a position, px from the middle, and the contrast of
            the photograph without the board.
        """
        if self.board is None:
            known = None if self.scale is None else (math.log(self.scale), _KNOWN)
            prior = ViewPrior() if known is None else ViewPrior(known)
            return lambda _: prior, contrast
        seen = sight(picture, self.board, contrast.factor)
        return seen if isinstance(seen, str) else (seen.prior, seen.hidden(contrast))


NO_RULER = Ruler()
