"""What `--tension` and `--stroke` say: values and ranges, for one tendon or several.

A SPEC is one or more parts joined by commas; a part is a value or `start:stop:count`. An option is
a SPEC, or `TENDON=SPEC` where there are several tendons, counted from 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from notchflex.errors import InputError

MOST_STEPS = 1_000_000
FORM = "values or start:stop:count ranges joined by commas, such as 2 or 0,1,2.5 or 0:3:31,3:0:31"


def parse_spec(
    text: str, option: str, *, negative: bool = True, shown: str | None = None
) -> list[float]:
    """Return the numbers that a SPEC stands for.

    Args:
        text: For example `0:3:31,3:0:31`.
        option: The option it came from, for the message.
        negative: Whether negative numbers are allowed.
        shown: What messages quote, where the SPEC is only a part of what was given.

    Returns:
        The values, in the order given; at least one.

    Raises:
        InputError: Not a SPEC, an empty range, a number that is not finite or not allowed.

    Example:
        >>> parse_spec("0,1:2:3", "--tension")
        [0.0, 1.0, 1.5, 2.0]
    """
    values: list[float] = []
    given = (text if shown is None else shown) or "''"
    for part in text.split(","):
        values.extend(_part(part.strip(), given, option))
        if len(values) > MOST_STEPS:
            raise InputError.OUT_OF_RANGE(
                f"{option} {given}: this is more than {MOST_STEPS:,} steps."
            )
    for value in values:
        if value < 0 and not negative:
            raise InputError.OUT_OF_RANGE(
                f"{option} {given}: got {value:g} N; a tendon only pulls, so give 0 N or more."
            )
    return values


def _part(part: str, text: str, option: str) -> list[float]:
    numbers = part.split(":")
    if len(numbers) == 1:
        return [_number(part, text, option)]
    if len(numbers) != 3:
        raise InputError.BAD_SYNTAX(
            f"{option} {text}: {part!r} is no start:stop:count; give {FORM}."
        )
    start, stop = (_number(number, text, option) for number in numbers[:2])
    try:
        count = int(numbers[2])
    except ValueError:
        raise InputError.NOT_A_NUMBER(
            f"{option} {text}: the count in {part!r} is {numbers[2]!r}; give a whole number."
        ) from None
    if count < 1:
        raise InputError.OUT_OF_RANGE(
            f"{option} {text}: a range of {count} steps; give a count of 1 or more."
        )
    if count == 1 and start != stop:
        raise InputError.OUT_OF_RANGE(
            f"{option} {text}: a range of 1 step cannot go from {start:g} to {stop:g}; "
            "give a count of 2 or more."
        )
    if count > MOST_STEPS:
        raise InputError.OUT_OF_RANGE(f"{option} {text}: this is more than {MOST_STEPS:,} steps.")
    return np.linspace(start, stop, count).tolist()


def _number(word: str, text: str, option: str) -> float:
    try:
        value = float(word)
    except ValueError:
        got = f"{word!r} is no number" if word.strip() else "a number is missing"
        raise InputError.BAD_SYNTAX(f"{option} {text}: {got}; give {FORM}.") from None
    if not math.isfinite(value):
        raise InputError.NOT_FINITE(f"{option} {text}: got {word.strip()}; give finite numbers.")
    return value


def load_columns(
    tension: Sequence[str], stroke: Sequence[str], tendons: int, *, option: str = "--tension"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the commanded tensions and strokes of every step.

    A single value holds for all steps; longer columns must have one length.

    Args:
        tension: What `--tension` was given, each SPEC or TENDON=SPEC.
        stroke: The same of `--stroke`.
        tendons: Number of tendons of the robot.
        option: What gave the tensions, for messages.

    Returns:
        Tensions [N] and strokes [mm], each (S, tendons), NaN where not commanded.

    Raises:
        InputError: A bad SPEC, a tendon that there is not, that is named twice or not at all, or
            columns of different lengths.
    """
    columns: dict[tuple[str, int], tuple[str, list[float]]] = {}
    commanded: dict[int, str] = {}
    for kind, texts in ((option, tension), ("--stroke", stroke)):
        for text in texts:
            index, spec = _tendon(text, kind, tendons)
            if index in commanded:
                raise InputError.CONFLICT(
                    f"{kind} {text}: tendon {index + 1} already has {commanded[index]}; "
                    "give each tendon one tension or one stroke."
                )
            values = parse_spec(spec, kind, negative=kind == "--stroke", shown=text)
            commanded[index] = f"{kind} {text}"
            columns[kind, index] = (commanded[index], values)
    if not columns:
        raise InputError.MISSING_VALUE(
            "Give a load: --tension SPEC or --stroke SPEC, for example --tension 2."
        )
    longest_name, longest = max(columns.values(), key=lambda column: len(column[1]))
    for name, values in columns.values():
        if len(values) not in (1, len(longest)):
            raise InputError.WRONG_SHAPE(
                f"{name} has {len(values)} steps and {longest_name} has {len(longest)}; "
                "give equal numbers of steps, or a single value for all of them."
            )
    table = {kind: np.full((len(longest), tendons), np.nan) for kind in (option, "--stroke")}
    for (kind, index), (_, values) in columns.items():
        table[kind][:, index] = values
    return table[option], table["--stroke"]


def _tendon(text: str, option: str, tendons: int) -> tuple[int, str]:
    """Split `TENDON=SPEC`; return the tendon counted from 0 and the SPEC."""
    name, equals, spec = text.partition("=")
    if not equals:
        if tendons == 1:
            return 0, text
        raise InputError.MISSING_VALUE(
            f"{option} {text}: the robot has {tendons} tendons; say which one, "
            f"for example {option} 1={text}."
        )
    try:
        index = int(name)
    except ValueError:
        raise InputError.OUT_OF_RANGE(
            f"{option} {text}: {name!r} is no tendon; give a number from 1 to {tendons}."
        ) from None
    if not 1 <= index <= tendons:
        has = "1 tendon" if tendons == 1 else f"{tendons} tendons"
        raise InputError.OUT_OF_RANGE(
            f"{option} {text}: there is no tendon {index}; the robot has {has}."
        )
    return index - 1, spec


def parse_vector(text: str, option: str, what: str) -> NDArray[np.float64]:
    """Return the three numbers of `X,Y,Z`.

    Args:
        text: Three numbers joined by commas.
        option: The option it came from, for the message.
        what: What the numbers are, with their unit.

    Returns:
        The vector, (3,).

    Raises:
        InputError: Not three finite numbers.

    Example:
        >>> parse_vector("90,0,0", "--base-rotation", "angles in deg").tolist()
        [90.0, 0.0, 0.0]
    """
    words = text.split(",")
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError.BAD_SYNTAX(
            f"{option} {text}: give three finite {what} joined by commas: X,Y,Z."
        )
    return values
