"""What was measured in photographs: angles or notches, as tables, documents and overlays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError, Robot
from notchflex.fit import MEASURED, deviation_header, headers
from notchflex.photographs.edges import Numbers, made_smaller
from notchflex.support import (
    AnyPath,
    document_head,
    replacing,
    robot_text,
    write_columns,
    write_text,
)

PHOTOGRAPH = "photograph"
"""Column with the name of the file; `calibrate` passes over it."""


@dataclass(frozen=True, eq=False)
class MeasuredPhotograph:
    """One photograph of a robot of n notches. Units mm, rad, px.

    Attributes:
        source: The file.
        reason: Why nothing is reported; "" if the photograph was measured.
        notch_angle: Angle of every notch, base to tip, (n,); NaN if refused.
        notch_angle_deviation: Their standard deviations, (n,).
        tip_position: Tip on the tube axis, in the frame of the base, (3,). Its y is 0: the robot
            bends in a plane.
        tip_deviation: Standard deviations of x and z, (3,); NaN for y, which is not measured.
        scale: Pixels of the photograph per mm.
        roll: Roll of the robot about the axis of its base, from the side view.
        tilt: Tilt of its base out of the photograph.
        noise: Spread of the edges about the outline, px.
        found: Share of the outline that was found, 0 to 1.
        outline: Points of the fitted outline in the photograph, px, (N, 2).
        seen: Whether an edge was found at each of them, (N,).
        chain: Points of the fitted tube axis in the photograph, px, (n + 2, 2): before the first
            notch, where it starts, and the end of every body behind a notch, the tip last.
    """

    source: str
    reason: str
    notch_angle: Numbers
    notch_angle_deviation: Numbers
    tip_position: Numbers
    tip_deviation: Numbers
    scale: float = float("nan")
    roll: float = float("nan")
    tilt: float = float("nan")
    noise: float = float("nan")
    found: float = 0.0
    outline: Numbers = field(default_factory=lambda: np.zeros((0, 2)), repr=False)
    seen: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool), repr=False)
    chain: Numbers = field(default_factory=lambda: np.zeros((0, 2)), repr=False)

    @property
    def measured(self) -> bool:
        """Whether angles are reported."""
        return not self.reason

    @classmethod
    def refused(cls, source: str, notches: int, reason: str, **view: Any) -> MeasuredPhotograph:
        """Return a photograph of which nothing is reported, with the reason."""
        nothing, nowhere = np.full(notches, np.nan), np.full(3, np.nan)
        return cls(source, reason, nothing, nothing, nowhere, nowhere, **view)

    def view(self) -> dict[str, Any]:
        """Return how the robot is seen, by the keys of the JSON document."""
        return {
            "scale_px_mm": self.scale,
            "roll_deg": math.degrees(self.roll),
            "tilt_deg": math.degrees(self.tilt),
            "edge_noise_px": self.noise,
            "outline_found": self.found,
        }

    def entry(self) -> dict[str, Any]:
        """Return the entry of the JSON document, without the loads."""
        head: dict[str, Any] = {"photograph": self.source, "measured": self.measured}
        if self.reason:
            return {**head, "reason": self.reason}
        return {
            **head,
            "notch_angle_deg": np.degrees(self.notch_angle),
            "notch_angle_sd_deg": np.degrees(self.notch_angle_deviation),
            "tip_position_mm": self.tip_position,
            "tip_position_sd_mm": self.tip_deviation,
            **self.view(),
        }


@dataclass(frozen=True, eq=False)
class MeasuredPhotographs:
    """Photographs of one robot, with the loads they were taken under.

    Attributes:
        robot: The robot.
        photographs: What was measured in each, in the order given.
        loads: Columns of a file of measurements (`tendon_force_N`, ...) with one text for each
            photograph.

    Example:
        >>> import notchflex as nf  # doctest: +SKIP
        >>> found = nf.measure(["pull_1N.jpg"], nf.load_robot("wrist.toml"))  # doctest: +SKIP
        >>> found.photographs[0].notch_angle  # doctest: +SKIP
    """

    robot: Robot
    photographs: tuple[MeasuredPhotograph, ...]
    loads: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of photographs."""
        return len(self.photographs)

    @property
    def measured(self) -> tuple[MeasuredPhotograph, ...]:
        """Those that were measured."""
        return tuple(seen for seen in self.photographs if seen.measured)

    @property
    def refused(self) -> tuple[MeasuredPhotograph, ...]:
        """Those that were refused; each has its `reason`."""
        return tuple(seen for seen in self.photographs if seen.reason)

    def columns(self) -> dict[str, list[Any]]:
        """Return the columns of the CSV that `calibrate` reads, the measured photographs only."""
        rows, is_measured = self.measured, [not seen.reason for seen in self.photographs]
        table: dict[str, list[Any]] = {PHOTOGRAPH: [seen.source for seen in rows]}
        table |= {name: list(compress(texts, is_measured)) for name, texts in self.loads.items()}
        notches = (self.robot.number_of_notches,)
        for index, header in headers(MEASURED["notch_angle"].columns, notches).items():
            for name, values in (
                (header, [seen.notch_angle[index] for seen in rows]),
                (deviation_header(header), [seen.notch_angle_deviation[index] for seen in rows]),
            ):
                table[name] = np.degrees(values).tolist()
        return table

    def document(self) -> dict[str, Any]:
        """Return the JSON document: all photographs, the refused with their reasons."""
        entries = [
            photograph.entry() | {"loads": {name: texts[row] for name, texts in self.loads.items()}}
            for row, photograph in enumerate(self.photographs)
        ]
        return {**document_head(self.robot), "photographs": entries}

    def write_csv(self, target: str) -> None:
        """Write the measured photographs as the CSV that `calibrate` reads, `-` for output.

        Raises:
            InputError: The file cannot be written.
        """
        write_columns(target, self.columns())


LENGTHS = ("height", "depth", "uncut_length")
"""The measured lengths, by their names in a robot file."""


@dataclass(frozen=True, eq=False)
class MeasuredCut:
    """The notches of a robot as they were cut, n notches. Units mm.

    Attributes:
        robot: The robot as its file describes it.
        photographs: What was seen in each photograph.
        turns: By how much the robot was turned about its axis for each photograph, rad.
        reason: Why nothing is reported; "" if the notches were measured.
        height: Height of every notch, base to tip, (n,); NaN if refused.
        depth: Depth of every notch, (n,).
        uncut_length: Length of every uncut section, that of the tip last, (n,).
        height_deviation: Standard deviations of the heights, (n,).
        depth_deviation: Standard deviations of the depths, (n,).
        uncut_length_deviation: Standard deviations of the uncut lengths, (n,).
    """

    robot: Robot
    photographs: tuple[MeasuredPhotograph, ...]
    turns: Numbers
    reason: str
    height: Numbers
    depth: Numbers
    uncut_length: Numbers
    height_deviation: Numbers
    depth_deviation: Numbers
    uncut_length_deviation: Numbers

    @property
    def measured(self) -> bool:
        """Whether lengths are reported."""
        return not self.reason

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the CSV table: one row a notch."""
        columns: dict[str, NDArray[Any]] = {"notch": np.arange(len(self.height)) + 1}
        for name in LENGTHS:
            columns[f"{name}_mm"] = getattr(self, name)
            columns[f"{name}_sd_mm"] = getattr(self, f"{name}_deviation")
        return columns

    def write_csv(self, target: str) -> None:
        """Write the lengths as CSV, one row a notch, `-` for output.

        Raises:
            InputError: The file cannot be written.
        """
        write_columns(target, self.columns())

    def document(self) -> dict[str, Any]:
        """Return the JSON document: the notches, or why they were refused."""
        photographs = [
            {"photograph": seen.source, "turn_deg": math.degrees(turn), **seen.view()}
            for seen, turn in zip(self.photographs, self.turns, strict=True)
        ]
        document: dict[str, Any] = {"measured": self.measured, "photographs": photographs}
        document |= self.columns() if self.measured else {"reason": self.reason}
        return {**document_head(self.robot), **document}

    def as_cut(self) -> Robot:
        """Return the robot with the measured heights, depths and uncut lengths.

        Raises:
            InputError: The photographs were refused, or the robot is not possible.
        """
        if self.reason:
            raise InputError.NO_DATA(f"the cut was not measured: {self.reason}")
        return self.robot.with_values(
            {
                f"notch[{number}].{name}": round(float(value), 5)
                for name in LENGTHS
                for number, value in enumerate(getattr(self, name), 1)
            }
        )

    def write_robot(self, target: AnyPath) -> None:
        """Write the robot as it was cut; comments name the photographs and standard deviations.

        Raises:
            InputError: The photographs were refused, or the file cannot be written.
        """
        robot = self.as_cut()
        sources = ", ".join(" ".join(Path(seen.source).name.split()) for seen in self.photographs)
        notes = {
            f"notch[{number}].{name}": f"photographs {sources}: standard deviation {spread:.2g} mm"
            for name in LENGTHS
            for number, spread in enumerate(getattr(self, f"{name}_deviation"), 1)
        }
        write_text(Path(target), robot_text(robot, fitted=notes))


LONGEST = 1800
"""Longer side of an overlay, px."""

_FAR = 1e4  # px: points beside the photograph by more are not drawn
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
    small = np.array(made_smaller(picture, factor))
    size = max(small.shape[:2]) / 1000.0
    within = np.abs(photograph.outline).max(axis=1, initial=0.0) < _FAR
    points = 16.0 * ((photograph.outline[within] + 0.5) * factor - 0.5)  # 1/16 px
    for point, is_seen in zip(np.rint(points).astype(int), photograph.seen[within], strict=True):
        colour = _FOUND if is_seen else _MISSED
        cv2.circle(small, point.tolist(), round(16 * 1.3 * size), colour, -1, cv2.LINE_AA, 4)
    lines = [f"refused: {photograph.reason}"] if photograph.reason else lines or _lines(photograph)
    colour, height = _REFUSED if photograph.reason else (255, 255, 255), round(26 * size)
    band = round((len(lines) + 0.4) * height)  # above the picture, so that it hides nothing
    small = cv2.copyMakeBorder(small, band, 0, 0, 0, cv2.BORDER_CONSTANT, value=(40, 40, 40))
    for number, text in enumerate(lines, 1):
        cv2.putText(
            small, text, (height // 2, number * height), cv2.FONT_HERSHEY_SIMPLEX,
            0.62 * size, colour, max(1, round(size)), cv2.LINE_AA,
        )  # fmt: skip
    with replacing(target) as path:
        path.write_bytes(cv2.imencode(".png", small)[1].tobytes())


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
