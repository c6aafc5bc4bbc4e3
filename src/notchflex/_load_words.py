"""Loads in words, as the command line and files write them: `0:3:31,3:0:31`, `1=2.5`, `X,Y,Z`.

Whatever reads here raises `InputError` for what cannot be used. Neither NumPy nor JAX is imported
before a load is read: `--help` needs this file.
"""

from __future__ import annotations

import math
import re
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


def parse_whole(low: int, high: int | None = None, what: str = "") -> Callable[[str], int]:
    """Return a reader of whole numbers from `low` to `high`; messages begin with `what`.

    Example:
        >>> parse_whole(0, 3)("2")
        2
    """
    form = f", {low} or more" if high is None else f" from {low} to {high}"
    form = f"give {what}a whole number{form}."

    def read(word: str) -> int:
        # Python converts no more than some thousand digits.
        if not word.removeprefix("-").isdecimal() or len(word) > 18:
            raise InputError.NOT_A_NUMBER(form)
        if int(word) < low or (high is not None and int(word) > high):
            raise InputError.OUT_OF_RANGE(form)
        return int(word)

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
    start, *rest = part.split(":")
    if not rest:
        return [parse_number(start, SPEC)]
    if len(rest) != 2:
        raise InputError.BAD_SYNTAX(f"{part!r} is not start:stop:count; give {SPEC}.")
    first, last = parse_number(start, SPEC), parse_number(rest[0], SPEC)
    count = parse_whole(1, MOST_STEPS, f"as the count of {part!r} ")(rest[1].strip())
    if count == 1 and first != last:
        raise InputError.OUT_OF_RANGE(
            f"a range of 1 step cannot go from {first:g} to {last:g}; give a count of 2 or more."
        )
    import numpy as np  # not for `--help`

    return np.linspace(first, last, count).tolist()


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
    tension: Sequence[TendonCommand],
    stroke: Sequence[TendonCommand],
    tendons: int,
    what: str = "tendon",
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
    commanded, has = dict[int, str](), f"{tendons} {what}{'s' * (tendons != 1)}"
    for kind, commands in enumerate((tension, stroke)):
        for source, number, steps in commands:
            if number is None and tendons > 1:
                option, _, text = source.partition(" ")
                raise InputError.MISSING_VALUE(
                    f"{source}: the robot has {has}; say which one, for example {option} 1={text}."
                )
            tendon = 1 if number is None else number
            if not 1 <= tendon <= tendons:
                raise InputError.UNKNOWN_NAME(
                    f"{source}: there is no {what} {tendon}; the robot has {has}."
                )
            if tendon in commanded:
                raise InputError.CONFLICT(
                    f"{source}: {what} {tendon} already has {commanded[tendon]}; give each {what} "
                    "one tension or one stroke."
                )
            if len(steps) not in (1, len(longest.steps)):
                raise InputError.WRONG_SHAPE(
                    f"{source} has {len(steps)} steps and {longest.source} has "
                    f"{len(longest.steps)}; give equal numbers of steps, or a single value for all."
                )
            commanded[tendon] = source
            tables[kind, :, tendon - 1] = steps
    return tables[0], tables[1]


class BodyForceOption(NamedTuple):
    """One `--body-force`: number of the body, force [N], and its point [mm]."""

    body: int
    force: Vector
    point: Vector


def read_body_force(text: str) -> BodyForceOption:
    """Read `BODY:X,Y,Z` or `BODY:X,Y,Z@X,Y,Z`."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*:([^@]*)(?:@(.*))?", text, re.ASCII | re.DOTALL)
    if match is None:
        raise InputError.BAD_SYNTAX(f"give {_BODY}.")
    body, force, point = match.groups("0,0,0")
    where = parse_vector("coordinates in mm")(point)
    return BodyForceOption(int(body), parse_vector("forces in N")(force), where)
