"""Options that several verbs share."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

from notchflex.cli import terminal
from notchflex.errors import InputError
from notchflex.robot import Robot, load_robot
from notchflex.robot.value_names import parse_assignment, set_values

OUTPUT = Group("Output", sort_key=9)

RobotName = Annotated[
    str,
    Parameter(help="A ready robot (`notchflex robots` lists them) or the path of a robot file."),
]
Settings = Annotated[
    tuple[str, ...],
    Parameter(
        name="--set",
        negative=(),
        show_default=False,
        help="Change a value of the robot, such as `material.elastic_modulus=9000`, "
        "`notch[2].depth=1.3` (the second notch from the base), `notch.depth=1.38` (every notch) "
        "or `material.kind=linear`. May be given several times, in any order.",
    ),
]
JsonFile = Annotated[
    str | None,
    Parameter(
        name="--json",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help="Write the result as JSON to this file; `-` prints it and nothing else.",
    ),
]
CsvFile = Annotated[
    str | None,
    Parameter(
        name="--csv",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help="Write the result as a CSV table to this file; `-` prints it and nothing else.",
    ),
]
NetcdfFile = Annotated[
    str | None,
    Parameter(
        name="--nc",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help="Write the whole result as NetCDF to this file (extra `data`); "
        "`notchflex.read_path` reads it back.",
    ),
]
ParquetFile = Annotated[
    str | None,
    Parameter(
        name="--parquet",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help="Write the columns of the CSV as a Parquet table to this file (extra `data`).",
    ),
]
_PICTURE = "Draw a picture to this .png, .svg or .pdf file, or to an .html file to look into"
PlotFile = Annotated[
    str | None,
    Parameter(
        name="--plot",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help=f"{_PICTURE}.",
    ),
]
MovingPlotFile = Annotated[
    str | None,
    Parameter(
        name="--plot",
        group=OUTPUT,
        allow_leading_hyphen=True,
        help=f"{_PICTURE}, or to a .gif file that moves.",
    ),
]
Quiet = Annotated[
    bool,
    Parameter(
        name="--quiet",
        group=OUTPUT,
        negative=(),
        show_default=False,
        help="Print no tables, notes or progress: only warnings, errors, and what `-` asks for.",
    ),
]

_MOST_CHANGES = 4
"""More values of `--set` than this are only counted in a title."""


def chosen_robot(name: str, settings: Sequence[str]) -> Robot:
    """Return the robot a user asked for, with the values of `--set`; say what a new kind drops.

    Raises:
        InputError: No such robot, a file that cannot be used, a bad `--set`.
    """
    robot = load_robot(name)
    if settings:
        robot, dropped = set_values(robot, [parse_assignment(text) for text in settings])
        if dropped:
            terminal.note(f"the new kind has no {', '.join(dropped)}; dropped.")
    return robot


def changed_title(robot: Robot, settings: Sequence[str]) -> str:
    """Return the name of a robot with what `--set` changed, for heads of tables and pictures.

    Example:
        >>> from notchflex.robot import load_robot
        >>> changed_title(load_robot("pacheco2021-a"), ["notch.depth=1.38"])
        'Pacheco 2021, wrist A with notch.depth = 1.38'
    """
    pairs = [parse_assignment(text) for text in settings]
    changes = [f"{path} = {value}" for path, value in pairs if path != "name"]
    more = len(changes) - _MOST_CHANGES
    if more > 0:
        changes = [*changes[:_MOST_CHANGES], f"{more} more"]
    return f"{robot.name} with {', '.join(changes)}" if changes else robot.name


def variant(text: str, other: str = "") -> tuple[str, list[tuple[str, object]]]:
    """Read `LABEL: PATH=VALUE, PATH=VALUE`.

    Args:
        text: What was given.
        other: What else may be given, as the message begins.

    Raises:
        InputError: Not of this form.

    Example:
        >>> variant("slick: friction.coefficient=0")
        ('slick', [('friction.coefficient', 0)])
    """
    label, colon, values = text.partition(":")
    if not colon or not label.strip():
        raise InputError.BAD_SYNTAX(
            f'--beside {text}: give {other}"LABEL: PATH=VALUE, PATH=VALUE", for example '
            '"linear: material.kind=linear".'
        )
    return label.strip(), [parse_assignment(part) for part in values.split(",")]


def robot_files(name: str) -> list[Path]:
    """Return the file that a robot is read from, if it is one: outputs must not replace it."""
    path = Path(name)
    return [path] if path.suffix and os.path.exists(path) else []
