"""Clear sentences instead of pydantic's error records."""

import dataclasses
import difflib
import functools
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, Union, cast

from pydantic import ValidationError

_TOML_TYPES = (
    (bool, "true or false"),
    (str, "text"),
    (int, "a whole number"),
    (float, "a number"),
    (Mapping, "a table"),
    (Sequence, "a list"),
)


def sentences(error: ValidationError, cls: type, repeats: Sequence[int] = ()) -> list[str]:
    """Say what is wrong, one sentence a problem.

    Args:
        error: What pydantic found.
        cls: The part class that was validated.
        repeats: `repeat` of every `[[notch]]` table, so that notches are counted as in the robot.
    """
    said: list[str] = []
    records = error.errors(include_url=False)
    wrong = [record["loc"] for record in records]
    for record in records:
        loc = record["loc"]
        if record["type"] == "too_short" and any(loc == one[: len(loc)] != one for one in wrong):
            continue  # pydantic counts only the good items of a list; what is wrong is said
        for one in _sentences_of(cast("dict[str, Any]", record), cls, repeats):
            if one not in said:
                said.append(one)
    return said


def unknown_key(name: str, key: str, allowed: Iterable[str]) -> str:
    """Name a key that nobody knows, and the nearest one that is allowed."""
    allowed = list(allowed)
    return f"`{name}` is not a known key{nearest(key, allowed)}. Allowed: {', '.join(allowed)}."


def nearest(word: str, allowed: Iterable[str]) -> str:
    """Ask "did you mean", or say nothing where no allowed word is near."""
    close = difflib.get_close_matches(word.lower(), list(allowed), n=1, cutoff=0.6)
    return f" (did you mean `{close[0]}`?)" if close else ""


def kinds_in(annotation: Any) -> list[type]:
    """List the part classes that an annotation of a field allows."""
    if typing.get_origin(annotation) is Annotated:
        return kinds_in(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (Union, types.UnionType, tuple):
        return [cls for item in typing.get_args(annotation) for cls in kinds_in(item)]
    is_part = isinstance(annotation, type) and dataclasses.is_dataclass(annotation)
    return [annotation] if is_part else []


@functools.cache
def kind_of(cls: type) -> str:
    """Return the word that names a kind in a file, "" for a part that comes in one kind only."""
    kind = fields_of(cls).get("kind")
    return "" if kind is None else str(kind.default)


@functools.cache  # asked for each value that is set by its name
def fields_of(cls: type) -> Mapping[str, Any]:
    """Return pydantic's field records, in the order in which a file lists the keys.

    That is `kind`, then what the class itself declares, then what all kinds share.
    """
    known: dict[str, Any] = getattr(cls, "__pydantic_fields__", {})
    shared = {f.name for f in dataclasses.fields(cls) if f.kw_only}
    order = sorted(known.items(), key=lambda item: (item[0] != "kind", item[0] in shared))
    return types.MappingProxyType(dict(order))


def _sentences_of(record: dict[str, Any], cls: type, repeats: Sequence[int]) -> list[str]:
    """Say one record of pydantic; a check across keys may have found several problems."""
    place = _Place(cls, record["loc"], repeats)
    error = record.get("ctx", {}).get("error")
    if hasattr(error, "found"):
        return [f"`{place.name_of(key)}` {text}{place.note}" for key, text in error.found]
    if record["type"] in ("unexpected_keyword_argument", "unexpected_positional_argument"):
        owner = _Place(cls, record["loc"][:-1], repeats)
        allowed = [name for name in fields_of(owner.cls) if name] if owner.cls else []
        return [unknown_key(place.name, str(record["loc"][-1]), allowed)]
    if record["type"] == "missing":
        return [f"`{place.name}` is missing{place.note}; give {place.wanted}."]
    if record["type"] == "union_tag_not_found":
        allowed = _quoted(kind_of(one) for one in place.kinds)
        return [f"`{place.name_of('kind')}` is missing{place.note}; give one of {allowed}."]
    if record["type"] == "union_tag_invalid":
        allowed = [kind_of(one) for one in place.kinds]
        got = record["ctx"]["tag"]
        return [
            f'`{place.name_of("kind")}` is "{got}"{place.note}; allowed: {_quoted(allowed)}'
            f"{nearest(str(got), allowed)}."
        ]
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
        return f'"{value}" (text)'
    for cls, word in _TOML_TYPES:
        if isinstance(value, cls):
            return word
    return f"a {type(value).__name__}"


def _quoted(words: Iterable[str]) -> str:
    return ", ".join(f'"{word}"' for word in words)


def _rule(record: dict[str, Any], place: _Place) -> str:
    """Say what is allowed instead."""
    kind, ctx = record["type"], record.get("ctx", {})
    unit = f" {place.unit}" if place.unit else ""
    bounds = {
        "greater_than": ("greater than", "gt"),
        "greater_than_equal": ("at least", "ge"),
        "less_than": ("less than", "lt"),
        "less_than_equal": ("at most", "le"),
    }
    if kind == "finite_number":
        return "it must be a finite number"
    if kind in bounds and record["input"] != record["input"]:  # only NaN differs from itself
        return "it must be a number"
    if kind == "greater_than_equal" and record["input"] <= 0.0 < ctx["ge"] < 1.0:
        return f"it must be greater than 0{unit}"  # a negative length is no small length
    if kind in bounds:
        word, key = bounds[kind]
        return f"it must be {word} {ctx[key]:g}{unit}"
    if kind == "number_wanted":
        return f"it must be a number{f' in {place.unit}' if place.unit else ''}, without quotes"
    if kind == "whole_number_wanted":
        return "it must be a whole number"
    if kind == "literal_error":
        allowed = typing.get_args(place.field.annotation)
        return f"allowed: {_quoted(allowed)}{nearest(str(record['input']), allowed)}"
    if kind == "string_type":
        return "it must be text in quotes"
    if kind == "string_too_short":
        return "it must not be empty"
    if kind == "too_short":
        return f"give at least one {place.wanted.removeprefix('a ')}"
    if kind in ("tuple_type", "list_type"):
        return f"write it as a list, one [[{place.name}]] table for each"
    return f"it must be a table: [{place.name.partition('[')[0]}] and its keys below"
