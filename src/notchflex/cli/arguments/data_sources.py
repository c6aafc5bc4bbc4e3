"""Robots with their files of measurements, as arguments of `notchflex calibrate`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, NamedTuple

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli.arguments.conversion import converted
from notchflex.cli.arguments.robots import chosen_robot, robot_files, robot_label

if TYPE_CHECKING:
    from pathlib import Path

    from notchflex import Robot


PAIR = "ROBOT=DATA.csv or LABEL=ROBOT=DATA.csv"


class DataSource(NamedTuple):
    """A robot, by name or file, under its label, with a file of measurements."""

    label: str
    robot: str
    data: str


def _read_source(text: str) -> DataSource:
    words = [word.strip() for word in text.split("=")]
    if len(words) not in (2, 3) or not all(words):
        raise InputError.BAD_SYNTAX(f"give a robot with its data: {PAIR}.")
    robot, data = words[-2:]
    label = words[0] if len(words) == 3 else robot_label(robot)
    if ":" in label or os.sep in label:
        raise InputError.BAD_SYNTAX(f"a label must not contain `:` or `{os.sep}`; choose another.")
    if label in ("each", "offset", "factor"):
        raise InputError.CONFLICT(
            f"the label `{label}` has a meaning before names of constants; choose another."
        )
    return DataSource(label, robot, data)


Sources = Annotated[
    DataSource,
    converted(_read_source, "[LABEL=]ROBOT=DATA.csv", allow_leading_hyphen=False),
    Parameter(
        help=f"{PAIR}: a robot (ready, or a file) and its measurements (the columns of "
        "`notchflex.read_measurements`). The same robot again adds more data; a label "
        "distinguishes two robots of one file."
    ),
]


class DataSources(NamedTuple):
    """By label, the name or file of each robot and its files of measurements.

    Example:
        >>> DataSources.of([DataSource("a", "a.toml", "1.csv"), DataSource("a", "a.toml", "2.csv")])
        DataSources(robots={'a': 'a.toml'}, data={'a': ['1.csv', '2.csv']})
    """

    robots: dict[str, str]
    data: dict[str, list[str]]

    @classmethod
    def of(cls, sources: Sequence[DataSource]) -> DataSources:
        """Gather the files of each robot."""
        if not sources:
            raise InputError.MISSING_VALUE(f"Give a robot with its data: {PAIR}.")
        gathered = cls({}, {})
        for label, robot, data in sources:
            other = gathered.robots.setdefault(label, robot)
            if other != robot:
                raise InputError.CONFLICT(
                    f"{other} and {robot} are both called {label}; give one of them another "
                    f"label: LABEL={robot}={data}."
                )
            files = gathered.data.setdefault(label, [])
            if data in files:
                raise InputError.CONFLICT(f"{data} is given twice for {label}; give it once.")
            files.append(data)
        return gathered

    @property
    def files(self) -> list[str | Path]:
        """All files that are read."""
        data = [file for files in self.data.values() for file in files]
        return [*data, *(file for name in self.robots.values() for file in robot_files(name))]

    def load(self, settings: Sequence[str]) -> dict[str, Robot]:
        """Load the robots with the values of `--set`: of all, or of one whose label precedes."""
        of_robot: dict[str, list[str]] = {label: [] for label in self.robots}
        for text in settings:
            label, colon, rest = text.partition(":")
            labelled = colon and "=" not in label
            if labelled:
                self.check_label(label, f"--set {text}")
            for one in [label] if labelled else of_robot:
                of_robot[one].append(rest if labelled else text)
        return {label: chosen_robot(name, of_robot[label]) for label, name in self.robots.items()}

    def check_label(self, label: str, source: str) -> None:
        """Raise if no robot has a label."""
        if label not in self.robots:
            labels = ", ".join(self.robots)
            raise InputError.UNKNOWN_NAME(
                f"{source}: no robot of this fit is called {label}; allowed: {labels}."
            )
