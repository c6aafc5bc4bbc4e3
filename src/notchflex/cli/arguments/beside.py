"""Other robots beside the first: what `simulate --beside` is given."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from notchflex.cli.arguments.options import chosen_robot, robot_files, variant
from notchflex.errors import InputError
from notchflex.robot import Robot

MOST = 4
"""Other robots beside the first: five can be told apart by colour."""


def beside_robots(first: Robot, name: str, beside: Sequence[str]) -> dict[str, Robot]:
    """Return the robots of a call, the first one first, each under its label.

    Args:
        first: The robot that was named, with its `--set`.
        name: How it was named, which is its label.
        beside: What `--beside` was given: `ROBOT`, `LABEL: ROBOT` or `LABEL: PATH=VALUE, ...`.

    Raises:
        InputError: Not of this form, too many, two of one label, or a robot that cannot be used.
    """
    if len(beside) > MOST:
        raise InputError.OUT_OF_RANGE(
            f"--beside may be given {MOST} times at most; got {len(beside)}."
        )
    robots = {_stem(name): first}
    for text in beside:
        label, robot = _one(first, text)
        if label in robots:
            raise InputError.CONFLICT(
                f"--beside {text}: there is already a robot called {label}; put another label "
                'before it, such as "second: ROBOT".'
            )
        robots[label] = robot
    return robots


def beside_files(text: str) -> list[Path]:
    """Return the robot file of one `--beside`, if it names one: outputs must not replace it."""
    return [] if "=" in text else robot_files(_split(text)[1])


def _one(first: Robot, text: str) -> tuple[str, Robot]:
    if "=" in text:
        label, values = variant(text, "ROBOT, LABEL: ROBOT, or ")
        return label, first.with_values(values)
    label, name = _split(text)
    return label, chosen_robot(name, ())


def _split(text: str) -> tuple[str, str]:
    """Label and robot of `LABEL: ROBOT` or `ROBOT`; a colon without a blank belongs to a path."""
    label, colon, name = text.partition(": ")
    return (label.strip(), name.strip()) if colon else (_stem(text.strip()), text.strip())


def _stem(name: str) -> str:
    return Path(name).stem if name.endswith(".toml") else name
