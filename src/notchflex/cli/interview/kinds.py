"""Questions about a part of any kind, from the keys of its description."""

from __future__ import annotations

import typing
from collections.abc import Callable
from typing import Any, TypeVar

from notchflex.cli.interview.ask import Interview, Question
from notchflex.cli.interview.readings import choice, reading, readings, whole
from notchflex.robot.error_messages import fields_of
from notchflex.robot.kinds import Notch, kinds_of
from notchflex.robot.robot import MOST_NOTCHES

T = TypeVar("T")

OPTION_OF = {
    ("notch", "depth"): "--depth",
    ("notch", "height"): "--height",
    ("notch", "uncut_length"): "--uncut-length",
    ("notch", "direction_deg"): "--direction",
    ("notch", "precurvature_deg"): "--precurvature",
    ("material", "elastic_modulus"): "--elastic-modulus",
    ("friction", "coefficient"): "--friction",
}
"""Section and key to the option that answers it; `--set SECTION.KEY=VALUE` answers the others."""

_BOUNDS = {"gt": "above", "ge": "at_least", "lt": "below", "le": "at_most"}


def ask_kind(interview: Interview, option: str, text: str, base: type[T], usual: str) -> type[T]:
    """Ask for a kind of notch or friction; a pipe that names none means the usual one.

    Raises:
        InputError: There is no such kind.
    """
    kinds = kinds_of(base)
    names = (usual, *(name for name in kinds if name != usual))
    if not interview.person and interview.given.get(option) is None:
        return kinds[usual]
    question = f"{text}, {' or '.join(names)}"
    name = interview.ask(Question(option, question, lambda said: choice(said, names), usual))
    return kinds[name]


def ask_part(interview: Interview, section: str, kind: type[T]) -> T:
    """Ask for the keys of a part.

    Args:
        interview: Where the answers come from.
        section: Its section in the robot file.
        kind: Its class.

    Raises:
        InputError: An answer that cannot be used.
    """
    values: dict[str, Any] = {}
    for key, field in fields_of(kind).items():
        if key not in ("kind", "repeat", "allowed_strain"):
            values[key] = interview.ask(_question(section, key, field, _reader(field, None)))
    return kind(**values)


def ask_row(interview: Interview, kind: type[Notch]) -> tuple[Notch, ...]:
    """Ask for the number of notches of a kind, and for their keys: one value, or one for each.

    Raises:
        InputError: An answer that cannot be used.
    """
    count = interview.ask(
        Question(
            "--notches",
            "Number of notches",
            lambda text: whole(text, at_least=1, at_most=MOST_NOTCHES),
        )
    )
    columns: dict[str, list[Any]] = {}
    for key, field in fields_of(kind).items():
        if key not in ("kind", "repeat"):
            question = _question("notch", key, field, _reader(field, count))
            columns[key] = interview.ask(question)
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    runs: list[tuple[int, dict[str, Any]]] = []
    for number, row in enumerate(rows):
        if not number or row != rows[number - 1]:
            runs.append((number, row))
    ends = [*(number for number, _ in runs[1:]), count]
    return tuple(
        kind(**kind.further_on(row, first), repeat=end - first)
        for (first, row), end in zip(runs, ends, strict=True)
    )


def _question(section: str, key: str, field: Any, read: Callable[[str], Any]) -> Question:
    extra = field.json_schema_extra or {}
    unit = f" [{extra['unit']}]" if extra.get("unit") else ""
    default = None
    if not field.is_required():
        default = "none" if field.default is None else f"{field.default}"
    option = OPTION_OF.get((section, key), f"--set {section}.{key}")
    return Question(option, f"{section}.{key}, {field.description}{unit}", read, default)


def _reader(field: Any, count: int | None) -> Callable[[str], Any]:
    """Read a value of a field, or one for each of several notches."""
    choices = typing.get_args(field.annotation)
    if typing.get_origin(field.annotation) is typing.Literal:
        return lambda text: (
            choice(text, choices) if count is None else [choice(text, choices)] * count
        )
    bounds = {
        word: getattr(one, name)
        for one in field.metadata
        for name, word in _BOUNDS.items()
        if getattr(one, name, None) is not None
    }
    optional = type(None) in choices

    def read(text: str) -> Any:
        if optional and text.lower() == "none":
            return None if count is None else [None] * count
        return reading(text, **bounds) if count is None else readings(text, count, **bounds)

    return read
