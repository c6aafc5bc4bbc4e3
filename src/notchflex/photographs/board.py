"""The layout of a board of ArUco or AprilTag markers, and its drawing for a printer."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.photographs.chain_table import Numbers
from notchflex.support import check_integer, check_number, need, write_text

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
            count = check_integer(getattr(self, name), f"{name} of a board")
            if not 1 <= count <= _MAX_SQUARES:
                raise InputError.OUT_OF_RANGE(
                    f"{name} of a board must be a whole number from 1 to {_MAX_SQUARES}, "
                    f"not {count!r}"
                )
        for name in ("marker", "gap"):
            length = check_number(getattr(self, name), f"{name} of a board", "a length in mm")
            if not 0.0 < length <= 1000.0:
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
    grid, *assignments = (part.strip() for part in text.split(","))
    values = dict(re.findall(r"(\w+)\s*=\s*([^\s,]+)", text))
    counts = re.fullmatch(r"(\d+)x(\d+)", grid)
    number = r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?"
    lengths = [values.pop(name, "") for name in ("marker", "gap")]
    is_number = all(re.fullmatch(number, length, re.IGNORECASE) for length in lengths)
    is_complete = len(values) + 2 == len(assignments) and set(values) <= {"dictionary"}
    if counts is None or not is_number or not is_complete:
        raise InputError.BAD_SYNTAX(
            f"{text!r} is not a board; give columns x rows, and marker and gap in mm, {_WAYS}"
        )
    columns, rows = map(int, counts.groups())
    marker, gap = map(float, lengths)
    return Board(columns, rows, marker, gap, **values)
