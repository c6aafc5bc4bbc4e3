"""From the words of an option to values: converters for cyclopts, and the forms that they read.

Whatever reads or checks arguments raises `InputError` for what cannot be used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from cyclopts import Parameter, Token

from notchflex.errors import InputError

Vector = tuple[float, float, float]

MOST_STEPS = 1_000_000
SPEC = "values or start:stop:count ranges joined by commas, such as 2 or 0,1,2.5 or 0:3:31,3:0:31"


def converted(
    read: Callable[[str], Any], metavar: str, *, several: bool = False, **options: Any
) -> Parameter:
    """Return the parameter of an option that a function reads.

    Args:
        read: Turns one word into a value; raises `InputError` with what is wrong and allowed. The
            option and the word are put before it.
        metavar: What `--help` shows for the word.
        several: Whether the option may be given several times; its value is then a tuple.
        options: Other arguments of `Parameter`.
    """

    def convert_one(token: Token) -> Any:
        try:
            return read(token.value)
        except InputError as problem:
            value = token.value if len(token.value) < 200 else f"{token.value[:80]}..."
            words = [word for word in (token.keyword, value or "''") if word]
            raise InputError(f"{' '.join(words)}: {problem}", problem.code) from None

    def convert(_type: Any, tokens: Sequence[Token]) -> Any:
        values = tuple(map(convert_one, tokens))
        return values if several else values[0]

    if several:
        options["show_default"] = False
    return Parameter(
        converter=convert,
        n_tokens=1,
        accepts_keys=False,
        allow_leading_hyphen=True,
        metavar=f"{metavar}..." if several else metavar,
        negative=(),
        **options,
    )


def flag(text: str, **options: Any) -> Parameter:
    """Return the parameter of an option without a value."""
    return Parameter(negative=(), show_default=False, help=text, **options)


def texts(name: str, metavar: str, text: str) -> Parameter:
    """Return the parameter of an option with a text that may be given several times."""
    return flag(text, name=name, metavar=f"{metavar}...")


def number(word: str, form: str, *, least: float = -math.inf) -> float:
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


def whole(low: int, high: int | None = None) -> Callable[[str], int]:
    """Return a reader of whole numbers from `low` to `high`.

    Example:
        >>> whole(0, 3)("2")
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


def vector(what: str) -> Callable[[str], Vector]:
    """Return a reader of `X,Y,Z`.

    Args:
        what: What the numbers are, with their unit.

    Example:
        >>> vector("angles in deg")("90,0,-5")
        (90.0, 0.0, -5.0)
    """
    form = f"three finite {what} joined by commas: X,Y,Z"

    def read(text: str) -> Vector:
        values = [number(word, form) for word in text.split(",")]
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
        return [number(part, SPEC)]
    if len(words) != 3:
        raise InputError.BAD_SYNTAX(f"{part!r} is not start:stop:count; give {SPEC}.")
    start, stop = (number(word, SPEC) for word in words[:2])
    try:
        count = whole(1, MOST_STEPS)(words[2].strip())
    except InputError as problem:
        got = f"the count in {part!r} is {words[2]!r}"
        raise InputError(f"{got}; {problem}", problem.code) from None
    if count == 1 and start != stop:
        raise InputError.OUT_OF_RANGE(
            f"a range of 1 step cannot go from {start:g} to {stop:g}; give a count of 2 or more."
        )
    import numpy as np  # not for `--help`

    return np.linspace(start, stop, count).tolist()
