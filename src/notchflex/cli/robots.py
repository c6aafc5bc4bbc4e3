"""Robots and measurements on the command line: by name or file, with changed values, variants."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.options import named_columns, texts
from notchflex.support import load_changed, parse_assignment

if TYPE_CHECKING:
    from notchflex import Robot
    from notchflex.fit import Measurements

_MAX_BESIDE = 4
"""Robots beside the first: five can be distinguished by colour."""

RobotName = Annotated[
    str,
    Parameter(help="A ready robot (`notchflex robots` lists them) or the path of a robot file."),
]
Settings = Annotated[
    tuple[str, ...],
    texts(
        "--set",
        "PATH=VALUE",
        help="Change a value of the robot, such as `material.elastic_modulus=9000`, "
        "`notch[2].depth=1.3` (the second from the base), `notch.depth=1.38` (every notch) or "
        "`material.kind=linear`.",
    ),
]
OnePath = Annotated[
    bool | None,
    Parameter(
        name="--path",
        negative="--from-rest",
        help="Take the rows of each pull as one loading path with friction history, or each row as "
        "loaded from rest. Without either the column `from_rest` decides, else the order of the "
        "rows: a force that falls within a pull makes it a path.",
    ),
]
MeasuredAs = Annotated[
    Literal["ring", "edge"],
    Parameter(
        help="What columns such as `notch_1_deg` hold: the angle between the uncut pieces beside a "
        "notch, or between its two faces (`notch_1_edge_deg`). They differ with elastic ends."
    ),
]


def chosen_robot(name: str, settings: Sequence[str] = ()) -> Robot:
    """Load a robot with the values of `--set`; write its warnings, and keys that a kind drops."""
    robot, dropped = load_changed(name, list(map(parse_assignment, settings)))
    if dropped:
        terminal.note(f"the new kind has no {', '.join(dropped)}; dropped.")
    warn_unlikely(robot)
    return robot


def warn_unlikely(robot: Robot) -> None:
    """Write the warnings of a robot."""
    for warning in robot.warnings:
        terminal.warn(str(warning))


def robot_files(*names: str) -> list[Path]:
    """Return the files that robots are read from: outputs must not replace them."""
    return [Path(name) for name in names if Path(name).suffix and os.path.exists(name)]


def changed_title(robot: Robot, settings: Sequence[str]) -> str:
    """Return the name of a robot with what `--set` changed, for heads of tables and pictures.

    Example:
        >>> from notchflex import load_robot
        >>> changed_title(load_robot("pacheco2021-a"), ["notch.depth=1.38"])
        'Pacheco 2021, wrist A with notch.depth = 1.38'
    """
    pairs = map(parse_assignment, settings)
    changes = [f"{path} = {value}" for path, value in pairs if path != "name"]
    return f"{robot.name} with {', '.join(changes)}" if changes else robot.name


def robot_label(name: str) -> str:
    """Return the label of a robot that is given without one: the name, of a file its stem."""
    return Path(name).stem if name.endswith(".toml") else Path(name).name


def variant(text: str, alternatives: str = "") -> tuple[str, list[tuple[str, object]]]:
    """Read `LABEL: PATH=VALUE, PATH=VALUE` of `--beside`.

    Args:
        text: What was given.
        alternatives: What else may be given, as the message begins.

    Example:
        >>> variant("slick: friction.coefficient=0")
        ('slick', [('friction.coefficient', 0)])
    """
    label, colon, values = text.partition(":")
    if not colon or not label.strip():
        raise InputError.BAD_SYNTAX(
            f'--beside {text}: give {alternatives}"LABEL: PATH=VALUE, PATH=VALUE", for example '
            '"linear: material.kind=linear".'
        )
    return label.strip(), list(map(parse_assignment, values.split(",")))


def beside_robots(first: Robot, name: str, beside: Sequence[str]) -> dict[str, Robot]:
    """Return the robots of a call, the first one first, each under its label.

    Args:
        first: The robot that was named, with its `--set`.
        name: How it was named, which is its label.
        beside: The values of `--beside`: `ROBOT`, `LABEL: ROBOT` or `LABEL: PATH=VALUE, ...`.
    """
    if len(beside) > _MAX_BESIDE:
        raise InputError.OUT_OF_RANGE(
            f"--beside may be given {_MAX_BESIDE} times at most; got {len(beside)}."
        )
    robots = {robot_label(name): first}
    for text in beside:
        if "=" in text:
            label, values = variant(text, "ROBOT, LABEL: ROBOT, or ")
            robot = first.with_values(values)
            warn_unlikely(robot)
        else:
            label, named = _label_and_robot(text)
            robot = chosen_robot(named)
        if label in robots:
            raise InputError.CONFLICT(
                f"--beside {text}: there is already a robot called {label}; put another label "
                'before it, such as "second: ROBOT".'
            )
        robots[label] = robot
    return robots


def beside_files(beside: Sequence[str]) -> list[Path]:
    """Return the robot files that `--beside` names."""
    return robot_files(*(_label_and_robot(text)[1] for text in beside if "=" not in text))


def _label_and_robot(text: str) -> tuple[str, str]:
    """Split `LABEL: ROBOT` or `ROBOT`; a colon without a blank belongs to a path."""
    label, _, name = (word.strip() for word in text.rpartition(": "))
    return label or robot_label(name), name


def read_data(
    file: str,
    robot: Robot,
    path: bool | None,
    measured_as: Literal["ring", "edge"] = "ring",
    columns: Sequence[str] = (),
) -> Measurements:
    """Read measurements, and write how the rows were interpreted and what was not used.

    Args:
        file: The file.
        robot: The robot that was measured.
        path: The value of `--path`: None where neither it nor `--from-rest` was given.
        measured_as: The value of `--measured`.
        columns: The values of `--column`.
    """
    from notchflex.fit import read_measurements

    rest = None if path is None else not path
    measured = read_measurements(
        file, robot, from_rest=rest, measured=measured_as, columns=named_columns(columns)
    )
    notes: list[str] = []
    if measured.renamed:
        pairs = ", ".join(f"{old} as {new}" for new, old in measured.renamed.items())
        notes.append(f"read {pairs}")
    if measured.order:
        notes.append(measured.order)
    if measured.ignored:
        notes.append(f"ignored columns: {', '.join(measured.ignored)}")
    if count := measured.negative_forces:
        are = "force is" if count == 1 else "forces are"
        notes.append(f"{count} measured {are} negative (sensor offset); the model uses 0 N")
    for note in notes:
        terminal.note(f"{measured.source}: {note}.")
    return measured
