"""The layout of a board of ArUco or AprilTag markers, and its drawing for a printer."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.photographs.chain.chain_table import Numbers
from notchflex.support import need, write_text

DICTIONARIES = (
    *(f"{bits}x{bits}_{count}" for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)),
    *("apriltag_16h5", "apriltag_25h9", "apriltag_36h10", "apriltag_36h11"),
)
"""Names of the sets of markers, as in OpenCV without `DICT_`."""

_MAX_SQUARES = 40
_WAYS = "such as 4x3,marker=5,gap=1.5 or 4x3,marker=5,gap=1.5,dictionary=apriltag_36h11"


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
        for name in ("columns", "rows"):
            count = getattr(self, name)
            if (
                isinstance(count, bool)
                or not isinstance(count, int)
                or not 1 <= count <= _MAX_SQUARES
            ):
                raise InputError.OUT_OF_RANGE(
                    f"{name} of a board must be a whole number from 1 to {_MAX_SQUARES}, "
                    f"not {count!r}"
                )
        for name in ("marker", "gap"):
            length = getattr(self, name)
            number = isinstance(length, (int, float)) and not isinstance(length, bool)
            if not number or not 0.0 < length <= 1000.0:
                raise InputError.OUT_OF_RANGE(
                    f"{name} of a board must be a length from 0 to 1000 mm, not {length!r}"
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

        name = self.dictionary if self.dictionary.startswith("april") else self.dictionary.upper()
        name = name.replace("apriltag", "APRILTAG")
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
        numbers = range(self.columns * self.rows)
        return (
            np.array([dictionary.generateImageMarker(one, side, borderBits=1) for one in numbers])
            > 0
        )

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

    def write_svg(self, target: str | os.PathLike[str]) -> None:
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
    grid, *others = (part.strip() for part in text.split(","))
    given: dict[str, Any] = {}
    for part in others:
        key, _, value = part.partition("=")
        given[key.strip()] = value.strip()
    columns, cross, rows = grid.partition("x")
    keys = {"marker", "gap", "dictionary"}
    if (
        not (cross and columns.isdecimal() and rows.isdecimal())
        or not {
            "marker",
            "gap",
        }
        <= set(given)
        <= keys
        or len(given) < len(others)
    ):
        raise InputError.BAD_SYNTAX(
            f"{text!r} is not a board; give columns x rows, and marker and gap in mm, {_WAYS}"
        )
    for name in ("marker", "gap"):
        try:
            given[name] = float(given[name])
        except ValueError:
            given[name] = math.nan
        if not math.isfinite(given[name]):
            raise InputError.BAD_SYNTAX(
                f"{name} of the board {text!r} is not a length in mm, {_WAYS}"
            )
    return Board(int(columns), int(rows), **given)
