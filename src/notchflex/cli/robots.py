"""Robots and measurements on the command line: by name or file, with changed values, variants."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

from cyclopts import Parameter

from notchflex import InputError, Robot
from notchflex.cli import terminal
from notchflex.cli.options import converted
from notchflex.support import load_changed, parse_assignment

if TYPE_CHECKING:
    from notchflex.fit import Measurements

_MOST_VARIANTS = 4
"""Robots beside the first: five can be distinguished by colour."""

RobotName = Annotated[
    str,
    Parameter(help="A ready robot (`notchflex robots` lists them) or the path of a robot file."),
]
Settings = Annotated[
    tuple[str, ...],
    Parameter(
        name="--set",
        metavar="PATH=VALUE...",
        help="Change a value of the robot: `material.elastic_modulus=9000`, `notch[2].depth=1.3` "
        "(the second from the base), `notch.depth=1.38` (every notch), `material.kind=linear`.",
    ),
]
OnePath = Annotated[
    bool | None,
    Parameter(
        name="--path",
        negative="--from-rest",
        help="Take each pull as one loading path with friction history, or each row as loaded from "
        "rest. By default the column `from_rest` decides, else whether the force falls in a pull.",
    ),
]
MeasuredAs = Annotated[
    Literal["ring", "edge"],
    Parameter(
        help="Columns such as `notch_1_deg` hold angles between the uncut pieces beside a "
        "notch, or between its faces (`notch_1_edge_deg`): different with elastic ends."
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


class Variant(NamedTuple):
    """One `--beside`: a label with the name of a robot, or with values of the first robot."""

    label: str
    robot: str
    values: list[tuple[str, object]]


def _read_variant(text: str) -> Variant:
    """Read `ROBOT`, `LABEL: ROBOT` or `LABEL: PATH=VALUE, PATH=VALUE`."""
    if "=" not in text:  # a colon without a blank belongs to a path
        label, _, name = map(str.strip, text.rpartition(": "))
        return Variant(label or robot_label(name), name, [])
    label, colon, values = map(str.strip, text.partition(":"))
    if not (colon and label):
        raise InputError.BAD_SYNTAX(
            'give ROBOT, LABEL: ROBOT, or "LABEL: PATH=VALUE, PATH=VALUE", for example '
            '"linear: material.kind=linear".'
        )
    return Variant(label, "", list(map(parse_assignment, values.split(","))))


def beside_parameter(metavar: str) -> Parameter:
    """Return the parameter of `--beside`."""
    return converted(_read_variant, metavar, several=True, name="--beside")


Beside = Annotated[tuple[Variant, ...], beside_parameter("ROBOT")]


def beside_robots(first: Robot, name: str, variants: Sequence[Variant]) -> dict[str, Robot]:
    """Return the robots of a call, the first one first, each under its label.

    Args:
        first: The robot that was named, with its `--set`.
        name: How it was named, which is its label.
        variants: The values of `--beside`.
    """
    if len(variants) > _MOST_VARIANTS:
        raise InputError.OUT_OF_RANGE(
            f"--beside may be given {_MOST_VARIANTS} times at most; got {len(variants)}."
        )
    robots = {robot_label(name): first}
    for label, named, values in variants:
        if label in robots:
            raise InputError.CONFLICT(
                f"--beside {label}: there is already a robot called {label}; put another label "
                'before it, such as "second: ROBOT".'
            )
        robots[label] = chosen_robot(named) if named else first.with_values(values)
        if values:
            warn_unlikely(robots[label])
    return robots


def read_data(
    file: str,
    robot: Robot,
    path: bool | None,
    measured_as: Literal["ring", "edge"],
    columns: Sequence[tuple[str, str]],
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
        file, robot, from_rest=rest, measured=measured_as, columns=dict(columns)
    )
    renamed = ", ".join(f"{old} as {new}" for new, old in measured.renamed.items())
    count = measured.negative_forces
    are = "force is" if count == 1 else "forces are"
    for note, holds in {
        f"read {renamed}": renamed,
        measured.order: measured.order,
        f"ignored columns: {', '.join(measured.ignored)}": measured.ignored,
        f"{count} measured {are} negative (sensor offset); the model uses 0 N": count,
    }.items():
        if holds:
            terminal.note(f"{measured.source}: {note}.")
    return measured
