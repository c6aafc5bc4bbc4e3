"""Dimensions of notches measured in photographs of a straight robot."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from notchflex.errors import InputError
from notchflex.photographs.chain.chain_table import Numbers
from notchflex.photographs.measured import MeasuredPhotograph
from notchflex.results.files.csv import write_columns
from notchflex.results.files.writing import write_text
from notchflex.robot import Robot, robot_text
from notchflex.robot.robot import source_of

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

    def columns(self) -> dict[str, Numbers]:
        """Return the columns of the CSV table: one row a notch."""
        columns: dict[str, Numbers] = {"notch": np.arange(1.0, len(self.height) + 1)}
        for name in LENGTHS:
            columns[f"{name}_mm"] = getattr(self, name)
            columns[f"{name}_sd_mm"] = getattr(self, f"{name}_deviation")
        return columns

    def write_csv(self, target: str) -> None:
        """Write the lengths as CSV, one row a notch, `-` for output.

        Raises:
            InputError: The file cannot be written.
        """
        columns = self.columns()
        notches = columns["notch"].astype(int)
        write_columns(target, {**columns, "notch": notches})

    def as_cut(self) -> Robot:
        """Return the robot with the measured heights, depths and uncut lengths.

        Raises:
            InputError: The photographs were refused, or the robot is not possible.
        """
        return self.robot.with_values(self._values())

    def write_robot(self, target: str | os.PathLike[str]) -> None:
        """Write the robot as it was cut; comments name the photographs and standard deviations.

        Raises:
            InputError: The photographs were refused, or the file cannot be written.
        """
        robot = self.as_cut()
        sources = ", ".join(" ".join(Path(one.source).name.split()) for one in self.photographs)
        notes: dict[str, str] = {}
        for name in LENGTHS:
            for number, spread in enumerate(getattr(self, f"{name}_deviation"), 1):
                path = f"notch[{number}].{name}"
                notes[path] = f"photographs {sources}: standard deviation {spread:.2g} mm"
        write_text(Path(target), robot_text(robot, source_of(self.robot), notes))

    def _values(self) -> dict[str, float]:
        if self.reason:
            raise InputError.NO_DATA(f"the cut was not measured: {self.reason}")
        return {
            f"notch[{number}].{name}": round(float(value), 5)
            for name in LENGTHS
            for number, value in enumerate(getattr(self, name), 1)
        }
