"""Clear sentences instead of pydantic's error records."""

import dataclasses
import difflib
import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, Union, cast

from pydantic import ValidationError

from notchflex.robot.fields import fields_of, is_list, kind_of, kinds_in

_TOML_TYPES = (
    (bool, "true or false"),
    (str, "text"),
    (int, "a whole number"),
    (float, "a number"),
    (Mapping, "a table"),
    (Sequence, "a list"),
)
_LONGEST = 80
"""Letters of a text that are shown at most."""


def sentences(error: ValidationError, cls: type, repeats: Sequence[int] = ()) -> list[str]:
    """Say what is wrong, one sentence a problem.

    Args:
        error: What pydantic found.
        cls: The part class that was validated.
        repeats: `repeat` of every `[[notch]]` table, so that notches are counted as in the robot.
    """
    records = cast("list[dict[str, Any]]", error.errors(include_url=False))
    wrong = [record["loc"] for record in records]
    # pydantic counts only the good items of a list as there; what is wrong with others is said
    counted = (
        one
        for one in records
        if one["type"] != "too_short"
        or not any(one["loc"] == w[: len(one["loc"])] != w for w in wrong)
    )
    return list(dict.fromkeys(said for one in counted for said in _sentences_of(one, cls, repeats)))


def unknown_key(name: str, key: str, allowed: Iterable[str]) -> str:
    """Name a key that nobody knows, and the nearest one that is allowed."""
    allowed = list(allowed)
    return f"`{name}` is not a known key{nearest(key, allowed)}. Allowed: {', '.join(allowed)}."


def nearest(word: str, allowed: Iterable[str], most: int = 1) -> str:
    """Ask "did you mean", or say nothing where no allowed word is near; `most` are named."""
    close = difflib.get_close_matches(word.lower(), list(allowed), n=most, cutoff=0.6)
    return f" (did you mean {' or '.join(f'`{one}`' for one in close)}?)" if close else ""


def _sentences_of(record: dict[str, Any], cls: type, repeats: Sequence[int]) -> list[str]:
    """Say one record of pydantic; a check across keys may have found several problems."""
    place, kind = _Place(cls, record["loc"], repeats), record["type"]
    error = record.get("ctx", {}).get("error")
    if hasattr(error, "found"):
        return [f"`{place.name_of(key)}` {text}{place.note}" for key, text in error.found]
    if kind in ("unexpected_keyword_argument", "unexpected_positional_argument"):
        owner = _Place(cls, record["loc"][:-1], repeats)
        allowed = [name for name in fields_of(owner.cls) if name] if owner.cls else []
        return [unknown_key(place.name, str(record["loc"][-1]), allowed)]
    if kind == "missing":
        return [f"`{place.name}` is missing{place.note}; give {place.wanted}."]
    allowed = [kind_of(one) for one in place.kinds]
    if kind == "union_tag_not_found":
        wanted = f"give one of {_quoted(allowed)}"
        return [f"`{place.name_of('kind')}` is missing{place.note}; {wanted}."]
    if kind == "union_tag_invalid":
        got = f'`{place.name_of("kind")}` is "{record["ctx"]["tag"]}"{place.note}'
        near = nearest(str(record["ctx"]["tag"]), allowed)
        return [f"{got}; allowed: {_quoted(allowed)}{near}."]
    got = _got(record["input"], place.unit)
    return [f"`{place.name}` is {got}{place.note}; {_rule(record, place)}."]


class _Place:
    """Where in the robot a record of pydantic points: its name, field and class."""

    def __init__(self, cls: type, loc: Sequence[int | str], repeats: Sequence[int]):
        self.cls: type | None = cls
        self.kinds: list[type] = []
        self.field: Any = None
        self.name = ""
        self.note = ""
        for item in loc:
            self._enter(item, repeats)
        self.unit = str((getattr(self.field, "json_schema_extra", None) or {}).get("unit", ""))

    def _enter(self, item: int | str, repeats: Sequence[int]) -> None:
        if isinstance(item, int) and self.kinds:
            self.name += f"[{item + 1}]"
            if self.name.startswith("notch[") and sum(repeats[:item]) != item:
                # notches are counted as in every output: each one of a repeated group
                self.name = f"notch[{sum(repeats[:item]) + 1}]"
                self.note = f" (in the [[notch]] table number {item + 1})"
            return
        if isinstance(item, int) and is_list(self.field):
            self.name += f"[{item + 1}]"
            return
        if isinstance(item, int):  # a positional argument of a part made in Python
            names = [f.name for f in dataclasses.fields(cast("Any", self.cls)) if not f.kw_only]
            item = names[item] if item < len(names) else f"argument {item + 1}"
        by_kind = {kind_of(one): one for one in self.kinds}
        if item in by_kind and item:
            self.cls, self.kinds = by_kind[item], []
            return
        if len(self.kinds) == 1:
            self.cls = self.kinds[0]
        self.name = self.name_of(item)
        self.field = fields_of(self.cls).get(item) if self.cls else None
        self.kinds = kinds_in(self.field.annotation) if self.field else []
        self.cls = self.kinds[0] if len(self.kinds) == 1 else None

    def name_of(self, key: str) -> str:
        """Return the full name of a key below this place."""
        return f"{self.name}.{key}" if self.name and key else self.name or key

    @property
    def wanted(self) -> str:
        """What to give, in the words of the field."""
        if self.field and typing.get_origin(self.field.annotation) is Literal:
            return str(self.field.description)
        if self.kinds:
            is_list = typing.get_origin(self.field.annotation) is tuple
            return f"a {'[[' if is_list else '['}{self.name}{']]' if is_list else ']'} table"
        text = f"the {self.field.description}" if self.field else "a value"
        return f"{text} [{self.unit}]" if self.unit else text


def _got(value: object, unit: str) -> str:
    """Show a value as it stands in a file."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return f"{value} {unit}".strip()
    if isinstance(value, str):
        shown = value if len(value) <= _LONGEST else f"{value[: _LONGEST - 3]}..."
        return f'"{shown}" (text)'
    for cls, word in _TOML_TYPES:
        if isinstance(value, cls):
            return word
    return f"a {type(value).__name__}"


def _quoted(words: Iterable[str]) -> str:
    return ", ".join(f'"{word}"' for word in words)


def _rule(record: dict[str, Any], place: _Place) -> str:
    """Say what is allowed instead."""
    kind, got, unit = record["type"], record["input"], f" {place.unit}" if place.unit else ""
    if kind in _BOUNDS:
        limit = record["ctx"][_BOUNDS[kind][1]]
        if got != got:  # only NaN differs from itself
            return "it must be a number"
        if kind == "greater_than_equal" and got <= 0.0 < limit < 1.0:
            return f"it must be greater than 0{unit}"  # a negative length is not a small length
        percent = "; 0.04 is 4 %" if kind == "less_than_equal" and "strain" in place.name else ""
        return f"it must be {_BOUNDS[kind][0]} {limit:g}{unit}{percent}"
    if kind == "number_wanted":
        return f"it must be a number{' in' if unit else ''}{unit}, without quotes"
    if kind == "literal_error":
        allowed = list(_words_in(place.field.annotation))
        return f"allowed: {_quoted(allowed)}{nearest(str(got), allowed)}"
    if is_list(place.field) and not place.kinds:
        if kind in ("too_short", "too_long"):
            count = record["ctx"]["min_length" if kind == "too_short" else "max_length"]
            return f"give at {'least' if kind == 'too_short' else 'most'} {count:g} values"
        if kind in ("tuple_type", "list_type"):
            return "it must be a list of numbers in brackets, such as [0.01, 0.05]"
    if kind == "too_short":
        return f"give at least one {place.wanted.removeprefix('a ')}"
    if kind in ("tuple_type", "list_type"):
        return f"write it as a list, one [[{place.name}]] table for each"
    table = f"it must be a table: [{place.name.partition('[')[0]}] and its keys below"
    return _RULES.get(kind, table)


def _words_in(annotation: Any) -> Iterator[str]:
    """Yield the words that an annotation of a field allows, which may be left out or not."""
    if typing.get_origin(annotation) is Literal:
        yield from typing.get_args(annotation)
    elif typing.get_origin(annotation) in (Annotated, Union, types.UnionType):
        for one in typing.get_args(annotation):
            yield from _words_in(one)


_BOUNDS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_RULES = {
    "finite_number": "it must be a finite number",
    "whole_number_wanted": "it must be a whole number",
    "string_type": "it must be text in quotes",
    "bool_type": "it must be true or false",
    "string_too_short": "it must not be empty",
    "string_too_long": "it is too long",
    "control_character": "it must not hold control characters",
    "string_pattern_mismatch": "it must be a word of letters, digits, - and _",
}
