"""Loads in words, as the command line and files write them: `0:3:31,3:0:31`, `1=2.5`, `X,Y,Z`.

Whatever reads here raises `InputError` for what cannot be used. Neither NumPy nor JAX is imported
before a load is read: `--help` needs this file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from notchflex.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Vector = tuple[float, float, float]

SPEC = "values or start:stop:count ranges joined by commas, such as 2 or 0,1,2.5 or 0:3:31,3:0:31"
_BODY = "BODY:X,Y,Z or BODY:X,Y,Z@X,Y,Z, such as 3:0,0.1,0 or 3:0,0.1,0@0.8,0,0.5"
MOST_STEPS = 1_000_000
"""Steps of the longest range."""
_DIGITS = 9
"""More digits than any number of a body has."""


def parse_number(word: str, form: str, *, least: float = -math.inf) -> float:
    """Read a finite number.

    Args:
        word: What was typed.
        form: What is allowed, for the message.
        least: The smallest value.
    """
    try:
        value = float(word)
    except ValueError:
        got = f"{word!r} is not a number" if word.strip() else "a number is missing"
        raise InputError.NOT_A_NUMBER(f"{got}; give {form}.") from None
    if not math.isfinite(value):
        raise InputError.NOT_FINITE(f"{word.strip()} is not finite; give {form}.")
    if value < least:
        raise InputError.OUT_OF_RANGE(f"give {form}.")
    return value


def parse_whole(low: int, high: int | None = None) -> Callable[[str], int]:
    """Return a reader of whole numbers from `low` to `high`.

    Example:
        >>> parse_whole(0, 3)("2")
        2
    """
    form = f", {low} or more" if high is None else f" from {low} to {high}"

    def read(word: str) -> int:
        # Python converts no more than some thousand digits.
        if not word.removeprefix("-").isdecimal() or len(word) > 18:
            raise InputError.NOT_A_NUMBER(f"give a whole number{form}.")
        value = int(word)
        if value < low or (high is not None and value > high):
            raise InputError.OUT_OF_RANGE(f"give a whole number{form}.")
        return value

    return read


def parse_vector(what: str) -> Callable[[str], Vector]:
    """Return a reader of `X,Y,Z`.

    Args:
        what: What the numbers are, with their unit.

    Example:
        >>> parse_vector("angles in deg")("90,0,-5")
        (90.0, 0.0, -5.0)
    """
    form = f"three finite {what} joined by commas: X,Y,Z"

    def read(text: str) -> Vector:
        values = [parse_number(word, form) for word in text.split(",")]
        if len(values) != 3:
            raise InputError.BAD_SYNTAX(f"give {form}.")
        return values[0], values[1], values[2]

    return read


def parse_spec(text: str) -> list[float]:
    """Read values and ranges joined by commas.

    Example:
        >>> parse_spec("0,1:2:3")
        [0.0, 1.0, 1.5, 2.0]
    """
    values: list[float] = []
    for part in text.split(","):
        values += _range(part.strip())
        if len(values) > MOST_STEPS:
            raise InputError.OUT_OF_RANGE(f"this is more than {MOST_STEPS:,} steps.")
    return values


def _range(part: str) -> list[float]:
    words = part.split(":")
    if len(words) == 1:
        return [parse_number(part, SPEC)]
    if len(words) != 3:
        raise InputError.BAD_SYNTAX(f"{part!r} is not start:stop:count; give {SPEC}.")
    start, stop = (parse_number(word, SPEC) for word in words[:2])
    try:
        count = parse_whole(1, MOST_STEPS)(words[2].strip())
    except InputError as problem:
        got = f"the count in {part!r} is {words[2]!r}"
        raise InputError(f"{got}; {problem}", problem.code) from None
    if count == 1 and start != stop:
        raise InputError.OUT_OF_RANGE(
            f"a range of 1 step cannot go from {start:g} to {stop:g}; give a count of 2 or more."
        )
    import numpy as np  # not for `--help`

    return np.linspace(start, stop, count).tolist()


class TendonCommand(NamedTuple):
    """One `--tension` or `--stroke`: `source` as typed, tendon from 1 if named, its steps."""

    source: str
    tendon: int | None
    steps: list[float]


def read_command(option: str, negative: bool, text: str) -> TendonCommand:
    """Read `SPEC` or `TENDON=SPEC`.

    Args:
        option: What the text belongs to, as messages name it.
        negative: Whether values below 0 are allowed.
        text: What was given.
    """
    name, equals, spec = text.rpartition("=")
    if equals and not name.strip().lstrip("-").isdecimal():
        raise InputError.BAD_SYNTAX(f"{name!r} is not a tendon; give its number, counted from 1.")
    steps = parse_spec(spec)
    if not negative and min(steps) < 0:
        least = next(step for step in steps if step < 0)
        raise InputError.OUT_OF_RANGE(f"got {least:g} N; a tendon only pulls, so give 0 N or more.")
    return TendonCommand(f"{option} {text}", int(name) if equals else None, steps)


def load_columns(
    tension: Sequence[TendonCommand], stroke: Sequence[TendonCommand], tendons: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the commanded tensions and strokes of every step.

    A single value holds for all steps; longer columns must have one length.

    Returns:
        Tensions [N] and strokes [mm], each (S, tendons), NaN where not commanded.
    """
    import numpy as np

    if not (tension or stroke):
        raise InputError.MISSING_VALUE(
            "Give a load: --tension SPEC or --stroke SPEC, for example --tension 2."
        )
    longest = max((*tension, *stroke), key=lambda command: len(command.steps))
    tables = np.full((2, len(longest.steps), tendons), np.nan)
    commanded: dict[int, str] = {}
    for table, commands in zip(tables, (tension, stroke), strict=True):
        for command in commands:
            index = _tendon_index(command, tendons)
            if index in commanded:
                raise InputError.CONFLICT(
                    f"{command.source}: tendon {index + 1} already has {commanded[index]}; "
                    "give each tendon one tension or one stroke."
                )
            if len(command.steps) not in (1, len(longest.steps)):
                raise InputError.WRONG_SHAPE(
                    f"{command.source} has {len(command.steps)} steps and {longest.source} has "
                    f"{len(longest.steps)}; give equal numbers of steps, or a single value for all."
                )
            commanded[index] = command.source
            table[:, index] = command.steps
    return tables[0], tables[1]


def _tendon_index(command: TendonCommand, tendons: int) -> int:
    """Return the tendon of a command, counted from 0."""
    has = "1 tendon" if tendons == 1 else f"{tendons} tendons"
    if command.tendon is None and tendons > 1:
        option, _, text = command.source.partition(" ")
        raise InputError.MISSING_VALUE(
            f"{command.source}: the robot has {has}; say which one, for example {option} 1={text}."
        )
    number = 1 if command.tendon is None else command.tendon
    if not 1 <= number <= tendons:
        raise InputError.UNKNOWN_NAME(
            f"{command.source}: there is no tendon {number}; the robot has {has}."
        )
    return number - 1


class BodyForceOption(NamedTuple):
    """One `--body-force`: number of the body, force [N], and its point [mm] if given."""

    body: int
    force: Vector
    point: Vector | None


def read_body_force(text: str) -> BodyForceOption:
    """Read `BODY:X,Y,Z` or `BODY:X,Y,Z@X,Y,Z`."""
    body, colon, rest = text.partition(":")
    force, separator, point = rest.partition("@")
    if not colon or not body.strip().isdecimal() or len(body) > _DIGITS:
        raise InputError.BAD_SYNTAX(f"give {_BODY}.")

    def read(words: str, what: str) -> Vector:
        try:
            return parse_vector(what)(words)
        except InputError as problem:
            message = f"{words!r} is not three finite {what}; give {_BODY}."
            raise InputError(message, problem.code) from None

    where = read(point, "coordinates in mm") if separator else None
    return BodyForceOption(int(body), read(force, "forces in N"), where)
