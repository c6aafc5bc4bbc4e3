"""From the words of an option to values: converters for cyclopts, and the forms that they read.

Whatever reads or checks arguments raises `InputError` for what cannot be used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from cyclopts import Parameter, Token

from notchflex import InputError
from notchflex.support import parse_number

Values = TypeVar("Values")


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

    options.setdefault("allow_leading_hyphen", True)
    if several:
        options["show_default"] = False
    return Parameter(
        converter=convert,
        n_tokens=1,
        accepts_keys=False,
        metavar=f"{metavar}..." if several else metavar,
        negative=(),
        **options,
    )


def named(form: str, read: Callable[[str], Values], text: str) -> tuple[str, Values]:
    """Read `NAME=VALUES`.

    Args:
        form: What is allowed, for the message.
        read: Reads the values.
        text: What was typed.
    """
    name, equals, values = (word.strip() for word in text.partition("="))
    if not (name and equals and values):
        raise InputError.BAD_SYNTAX(f"give {form}.")
    return name, read(values)


def low_high(
    form: str, text: str, *, alone_is_high: bool = False
) -> tuple[float | None, float | None]:
    """Read `LOW:HIGH`, one of which may be left out.

    Args:
        form: What is allowed, for the message.
        text: What was typed.
        alone_is_high: Whether a number without a colon is the upper limit.
    """
    low, colon, high = text.partition(":")
    if not colon and alone_is_high:
        low, high = "", low
    elif not colon:
        raise InputError.BAD_SYNTAX(f"give {form}.")
    if not (low.strip() or high.strip()):
        raise InputError.BAD_SYNTAX(f"a number is missing; give {form}.")
    lower, upper = (parse_number(word, form) if word.strip() else None for word in (low, high))
    return lower, upper


def flag(text: str, **options: Any) -> Parameter:
    """Return the parameter of an option without a value."""
    return Parameter(negative=(), show_default=False, help=text, **options)


def texts(name: str, metavar: str, text: str) -> Parameter:
    """Return the parameter of an option with a text that may be given several times."""
    return flag(text, name=name, metavar=f"{metavar}...")
