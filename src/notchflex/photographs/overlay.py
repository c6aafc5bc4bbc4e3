"""The fitted outline drawn over a photograph."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from notchflex.photographs.measure_cut import MeasuredCut
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.support import replacing

LONGEST = 1800
"""Longer side of an overlay, px."""

_FOUND, _MISSED, _REFUSED = (60, 200, 60), (40, 140, 255), (120, 160, 255)


def overlay_names(sources: Sequence[str]) -> list[str]:
    """Return a unique name for the overlay of each photograph.

    Example:
        >>> overlay_names(["a/x.jpg", "b/x.jpg", "y.png"])
        ['x-1.png', 'x-2.png', 'y.png']
    """
    stems = [Path(source).stem or "photograph" for source in sources]
    return [
        f"{stem}-{stems[: row + 1].count(stem)}.png" if stems.count(stem) > 1 else f"{stem}.png"
        for row, stem in enumerate(stems)
    ]


def write_overlay(
    target: str | Path,
    picture: NDArray[np.uint8],
    photograph: MeasuredPhotograph,
    lines: Sequence[str] = (),
) -> None:
    """Draw the fitted outline over a photograph with the angles, and write it as PNG.

    Green points lie on an edge, orange ones on none. The photograph is made smaller, and the angles
    stand above it.

    Args:
        target: The file.
        picture: The photograph, (height, width, 3).
        photograph: What was measured in it.
        lines: What is written instead of the angles.

    Raises:
        InputError: The file cannot be written.
    """
    import cv2

    factor = min(1.0, LONGEST / max(picture.shape[:2]))
    small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    size = max(small.shape[:2]) / 1000.0
    points = (photograph.outline + 0.5) * factor - 0.5
    for point, is_seen in zip(points, photograph.seen, strict=True):
        if np.abs(point).max() < 1e4:
            at = (round(16 * float(point[0])), round(16 * float(point[1])))
            colour = _FOUND if is_seen else _MISSED
            cv2.circle(small, at, round(16 * 1.3 * size), colour, -1, cv2.LINE_AA, 4)
    lines = [f"refused: {photograph.reason}"] if photograph.reason else lines or _lines(photograph)
    colour = _REFUSED if photograph.reason else (255, 255, 255)
    height = round(26 * size)
    band = round((len(lines) + 0.4) * height)  # above the picture, so that it hides nothing
    small = cv2.copyMakeBorder(small, band, 0, 0, 0, cv2.BORDER_CONSTANT, value=(40, 40, 40))
    for number, text in enumerate(lines, 1):
        cv2.putText(
            small, text, (height // 2, number * height), cv2.FONT_HERSHEY_SIMPLEX,
            0.62 * size, colour, max(1, round(size)), cv2.LINE_AA,
        )  # fmt: skip
    done, data = cv2.imencode(".png", small)
    assert done
    with replacing(target) as path:
        path.write_bytes(data.tobytes())


def cut_lines(cut: MeasuredCut) -> list[str]:
    """Return what is written over photographs of a straight robot."""
    if cut.reason:
        return [f"refused: {cut.reason}"]
    columns = (cut.height, cut.height_deviation, cut.depth, cut.depth_deviation)
    return [
        f"notch {number}: height {height:.3f} +- {of_height:.3f}, "
        f"depth {depth:.3f} +- {of_depth:.3f} mm"
        for number, (height, of_height, depth, of_depth) in enumerate(zip(*columns, strict=True), 1)
    ]


def _lines(photograph: MeasuredPhotograph) -> list[str]:
    angles = zip(photograph.notch_angle, photograph.notch_angle_deviation, strict=True)
    return [
        f"notch {number}: {math.degrees(angle):.2f} +- {math.degrees(spread):.2f} deg"
        for number, (angle, spread) in enumerate(angles, 1)
    ]
