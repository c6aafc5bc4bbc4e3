"""Plain tables of files as checked records: renamed words, the codes of errors, their places."""

from __future__ import annotations

import inspect
import os
import re
import sys
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar, dataclass_transform, get_type_hints

from pydantic import Field, model_validator
from pydantic_core import ArgsKwargs

from notchflex import ErrorCode, InputError, Robot, load_robot
from notchflex.support import (
    check_integer,
    nearest,
    part,
    read_specification,
    robot_named,
    short_repr,
    validated,
)

Record = TypeVar("Record")

REFUSE = InputError.INVALID_SPECIFICATION

RENAMED = {"state": "load", "yield.wanted": "wanted_yield"}
"""Old words of files and of Python, which are read for one version more, and the new ones."""

_CODES = {
    "missing": ErrorCode.MISSING_VALUE,
    "too_short": ErrorCode.NO_DATA,
    "unexpected_keyword_argument": ErrorCode.UNKNOWN_NAME,
    "literal_error": ErrorCode.UNKNOWN_NAME,
    "finite_number": ErrorCode.NOT_FINITE,
}
"""Codes of what pydantic refuses; else WRONG_TYPE of a type, and OUT_OF_RANGE."""


_DESCRIBED = re.compile(r"^    (\w+): (.+(?:\n {8}.+)*)", re.MULTILINE)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def record(
    *, kw_only: bool = True, refuse: Callable[[str], InputError] = REFUSE
) -> Callable[[type[Record]], type[Record]]:
    """Make a class a checked record, as `part` does; its docstring describes the fields.

    Messages and the schema take the first clause of each, up to a full stop or semicolon: a noun.

    Args:
        kw_only: Whether its fields are keyword arguments only.
        refuse: Makes the error of a message, with its code.
    """

    def decorate(cls: type[Record]) -> type[Record]:
        hints = get_type_hints(cls, include_extras=True)
        for name, text in _DESCRIBED.findall(inspect.getdoc(cls) or ""):
            if name in cls.__annotations__:
                words = " ".join(text.removeprefix("The ").split())
                clause = re.split(r"[.;] |\.$", words)[0]
                described = Field(description=clause[0].lower() + clause[1:])
                cls.__annotations__[name] = Annotated[hints[name], described]
        return part(kw_only=kw_only, refuse=refuse)(cls)

    return decorate


class OldWords:
    """A record that takes the old words of `RENAMED`, too."""

    @model_validator(mode="before")
    @classmethod
    def _in_new_words(cls, given: Any) -> Any:
        if isinstance(given, ArgsKwargs):
            return ArgsKwargs(given.args, _renamed(given.kwargs or {}))
        return _renamed(given) if isinstance(given, Mapping) else given

    @property
    def state(self) -> Any:
        """The old word for `load`."""
        return vars(self)["load"]


def _renamed(table: Mapping[str, Any]) -> dict[str, Any]:
    words = dict(table)
    for old, new in RENAMED.items():
        key, _, below = old.partition(".")
        is_old = key in words and new not in words
        if is_old and (not below or (isinstance(words[key], Mapping) and [*words[key]] == [below])):
            value = words.pop(key)
            words[new] = value[below] if below else value
            text = f"`{old}` is now called `{new}`; the old word is read for one version more."
            warnings.warn(text, FutureWarning, stacklevel=2)
    return words


def coded(text: str) -> InputError:
    """Return the error of what pydantic is refusing, with the code of its first problem."""
    refused = sys.exception()
    error: Any = refused.__context__ if isinstance(refused, InputError) else refused
    first = error.errors(include_url=False)[0]
    cause = first.get("ctx", {}).get("error")
    if not isinstance(cause, InputError):
        is_type = first["type"].endswith(("_type", "_wanted"))
        usual = ErrorCode.WRONG_TYPE if is_type else ErrorCode.OUT_OF_RANGE
        return getattr(InputError, _CODES.get(first["type"], usual).name)(text)
    place = "".join(f"[{key + 1}]" if isinstance(key, int) else key for key in first["loc"])
    return InputError(f"`{place}`: {cause}" if place else str(cause), cause.code)


def made(
    record: type[Record], table: Mapping[str, Any], refuse: Callable[[str], InputError] = REFUSE
) -> Record:
    """Make a record of the plain table of a file.

    Args:
        record: Its class.
        table: The table.
        refuse: Makes the error of a message.

    Raises:
        InputError: A key is missing, not known, or its value is not allowed.
    """
    try:
        return validated(record, table)
    except InputError as error:
        loads, text = table.get("load"), str(error)
        if isinstance(loads, Mapping):  # a message names them as the file does
            names = [*loads]
            text = re.sub(r"`load\[(\d+)\]", lambda n: f"`load.{names[int(n[1]) - 1]}", text)
        raise refuse(text) from None


def with_robot(
    given: Any, record: type[Record], what: str, robot: Robot | None = None
) -> tuple[Record, Robot]:
    """Return a specification, and the robot that it names or another one.

    Args:
        given: The specification, its table, or the path of its file.
        record: Its class, with the name of the robot as `robot`.
        what: What messages call its file.
        robot: The robot, where it is not the one that is named.

    Raises:
        InputError: The file or its robot cannot be read, or a value is not allowed.
    """
    if isinstance(given, str | os.PathLike):
        asked: Any = read_specification(given, what, partial(made, record))
        return asked, robot or robot_named(asked.robot, Path(given).parent)
    asked = made(record, given) if isinstance(given, Mapping) else given
    if not isinstance(asked, record):
        raise InputError.WRONG_TYPE(
            f"a notchflex.{record.__name__} is needed, its table, or the path of a file; got "
            f"{short_repr(given)}"
        )
    return asked, robot or load_robot(vars(asked)["robot"])


@contextmanager
def placed(place: str) -> Generator[None]:
    """Begin the message of an error with the place of what is refused."""
    try:
        yield
    except InputError as error:
        raise type(error)(f"{place}: {error}", error.code) from None


def whole(value: Any, name: str, least: int, most: int) -> int:
    """Return a whole number within limits.

    Raises:
        InputError: It is none.
    """
    if not least <= check_integer(value, name) <= most:
        raise InputError.OUT_OF_RANGE(f"{name} must be from {least:,} to {most:,}; got {value}")
    return value


def known(name: Any, allowed: Mapping[str, Any], what: str) -> Any:
    """Return what has a name.

    Raises:
        InputError: Nothing has it.
    """
    if name not in allowed:
        raise InputError.UNKNOWN_NAME(
            f"there is no {what} `{name}`{nearest(str(name), allowed)}; there are "
            f"{', '.join(allowed) or 'none'}."
        )
    return allowed[name]
