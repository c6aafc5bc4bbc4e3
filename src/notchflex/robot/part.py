"""What every part of a robot is: a frozen dataclass, checked by pydantic when it is made."""

import contextlib
import dataclasses
import difflib
import functools
import inspect
import operator
import types
import typing
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import (
    Annotated,
    Any,
    Literal,
    LiteralString,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    dataclass_transform,
    get_type_hints,
    overload,
)

import pydantic.dataclasses
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError

from notchflex.errors import InputError

T = TypeVar("T")
Problems: TypeAlias = Iterable[tuple[str, str]]
"""Pairs of a key and the rest of a sentence that begins with it."""

# Fields of the parts of a robot, as pydantic records them: kinds, lists, words and units.


def _members(annotation: Any) -> Iterator[Any]:
    """Yield the types that an annotation allows, without their checks."""
    if typing.get_origin(annotation) is Annotated:
        yield from _members(typing.get_args(annotation)[0])
    elif typing.get_origin(annotation) in (Union, types.UnionType):
        for member in typing.get_args(annotation):
            yield from _members(member)
    else:
        yield annotation


def kinds_in(annotation: Any) -> Iterator[type]:
    """Yield the part classes that an annotation of a field allows, alone or in a list."""
    for member in _members(annotation):
        if typing.get_origin(member) is tuple:
            yield from kinds_in(typing.get_args(member)[0])
        elif dataclasses.is_dataclass(member):
            yield cast("type", member)


def is_list(field: Any) -> bool:
    """Return whether a field (pydantic's record of it) takes a list."""
    return any(typing.get_origin(member) is tuple for member in _members(field.annotation))


def unit_of(field: Any) -> str:
    """Return the unit of a field, "" for none."""
    return str((field.json_schema_extra or {}).get("unit", ""))


def is_unsaid(name: str, value: object) -> bool:
    """Return whether files and lists leave a key out: without a value, or a factor of 1."""
    return value is None or (name.endswith("_factor") and value == 1.0)


@functools.cache
def kind_of(cls: type) -> str:
    """Return the word that names a kind in a file, "" for a part that comes in one kind only."""
    kind = fields_of(cls).get("kind")
    return "" if kind is None else str(kind.default)


@functools.cache  # asked for each value that is set by its name
def fields_of(cls: type) -> Mapping[str, Any]:
    """Return pydantic's field records as a file lists keys: `kind`, its own, those shared."""
    pydantic_fields: dict[str, Any] = getattr(cls, "__pydantic_fields__", {})
    shared = {f.name for f in dataclasses.fields(cls) if f.kw_only}
    order = sorted(pydantic_fields.items(), key=lambda item: (item[0] != "kind", item[0] in shared))
    return types.MappingProxyType(dict(order))


@functools.cache
def own_parts(cls: type) -> tuple[str, ...]:
    """Return the keys of a part that hold a part of its own."""
    return tuple(name for name, field in fields_of(cls).items() if any(kinds_in(field.annotation)))


def fields_in(part: Any) -> dict[str, Any]:
    """Return the fields of a part, and those of its own parts as `material.density`."""
    fields: Any = fields_of(type(part))
    for name in own_parts(type(part)):
        if (own := getattr(part, name)) is not None:
            fields = {**fields, **{f"{name}.{key}": each for key, each in fields_in(own).items()}}
    return fields


# Clear sentences instead of pydantic's error records.

_LONGEST = 80
"""Letters of a text that are shown at most."""


def sentences(error: ValidationError, cls: type, repeats: Sequence[int] = ()) -> list[str]:
    """Say in a sentence each what pydantic refused in a part."""
    records = cast("list[dict[str, Any]]", error.errors(include_url=False))
    places = [record["loc"] for record in records]
    said: dict[str, None] = {}
    for record in records:
        # pydantic counts only the good items of a list as there; what is wrong with others is said
        inside = (place[: len(record["loc"])] == record["loc"] != place for place in places)
        if record["type"] != "too_short" or not any(inside):
            said |= dict.fromkeys(_sentences_of(record, cls, repeats))
    return list(said)


def unknown_key(name: str, key: str, allowed: Iterable[str]) -> str:
    """Name a key that nobody knows, and the nearest one that is allowed."""
    allowed = list(allowed)
    return f"`{name}` is not a known key{nearest(key, allowed)}. Allowed: {', '.join(allowed)}."


def nearest(word: str, allowed: Iterable[str], most: int = 1) -> str:
    """Ask "did you mean", or say nothing where no allowed word is near; `most` are named."""
    close = difflib.get_close_matches(word.lower(), list(allowed), n=most, cutoff=0.6)
    return f" (did you mean {' or '.join(f'`{name}`' for name in close)}?)" if close else ""


def _sentences_of(record: dict[str, Any], cls: type, repeats: Sequence[int]) -> list[str]:
    """Say one record of pydantic; a check across keys may have several problems."""
    place, kind = _Place(cls, record["loc"], repeats), record["type"]
    error = record.get("ctx", {}).get("error")
    if isinstance(error, ProblemError):
        return [f"`{place.name_of(key)}` {text}{place.note}" for key, text in error.problems]
    if kind in ("unexpected_keyword_argument", "unexpected_positional_argument"):
        owners = _Place(cls, record["loc"][:-1], repeats).classes
        allowed = [name for owner in owners for name in fields_of(owner)]
        return [unknown_key(place.name, str(record["loc"][-1]), allowed)]
    kinds = [kind_of(each) for each in place.classes]
    if kind == "missing":
        return [f"`{place.name}` is missing{place.note}; give {place.wanted}."]
    if kind == "union_tag_not_found":
        wanted = f"give one of {_quoted(kinds)}"
        return [f"`{place.name_of('kind')}` is missing{place.note}; {wanted}."]
    if kind == "union_tag_invalid":
        tag = str(record["ctx"]["tag"])
        return [
            f'`{place.name_of("kind")}` is "{tag}"{place.note}; allowed: '
            f"{_quoted(kinds)}{nearest(tag, kinds)}."
        ]
    got = _got(record["input"], place.unit)
    return [f"`{place.name}` is {got}{place.note}; {_rule(record, place)}."]


class _Place:
    """Where a record of pydantic points: the name, its field, and the part classes there."""

    def __init__(self, cls: type, loc: Sequence[int | str], repeats: Sequence[int]):
        self.classes, self.field = [cls], cast("Any", None)
        self.name = self.note = ""
        for item in loc:
            self._enter(item, repeats)
        self.unit = unit_of(self.field) if self.field else ""

    def _enter(self, item: int | str, repeats: Sequence[int]) -> None:
        if isinstance(item, int) and self.field:
            # notches are counted as in every output, those of a repeated group each
            before = sum(repeats[:item]) + max(item - len(repeats), 0)
            before = before if self.name == "notch" else item
            self.name += f"[{before + 1}]"
            if before != item:
                self.note = f" (in the [[notch]] table number {item + 1})"
        elif len(self.classes) > 1:  # pydantic names the kind before its keys
            self.classes = [each for each in self.classes if kind_of(each) == item]
        else:
            if isinstance(item, int):  # a positional argument of a part made in Python
                (cls,) = cast("Any", self.classes)
                names = [field.name for field in dataclasses.fields(cls) if not field.kw_only]
                item = names[item] if item < len(names) else f"argument {item + 1}"
            self.name = self.name_of(item)
            self.field = fields_of(self.classes[0]).get(item) if self.classes else None
            self.classes = [*kinds_in(self.field.annotation)] if self.field else []

    def name_of(self, key: str) -> str:
        """Return the full name of a key below this place."""
        return f"{self.name}.{key}" if self.name and key else self.name or key

    @property
    def wanted(self) -> str:
        """What to give, in the words of the field."""
        if self.field and typing.get_origin(self.field.annotation) is Literal:
            return str(self.field.description)
        if self.classes:
            header = f"[{self.name}]"
            return f"a {f'[{header}]' if is_list(self.field) else header} table"
        text = f"the {self.field.description}" if self.field else "a value"
        return f"{text} [{self.unit}]" if self.unit else text


def _got(value: object, unit: str) -> str:
    """Show a value as it stands in a file."""
    match value:
        case bool():
            return str(value).lower()
        case int() | float():
            return f"{value} {unit}".strip()
        case str():
            shown = value if len(value) <= _LONGEST else f"{value[: _LONGEST - 3]}..."
            return f'"{shown}" (text)'
        case Mapping():
            return "a table"
        case Sequence():
            return "a list"
        case _:
            return f"a {type(value).__name__}"


def _quoted(words: Iterable[str]) -> str:
    return ", ".join(f'"{word}"' for word in words)


def _rule(record: dict[str, Any], place: _Place) -> str:
    """Say what is allowed instead."""
    kind, got, unit = record["type"], record["input"], f" {place.unit}" if place.unit else ""
    if kind in _BOUNDS:
        (limit,) = record["ctx"].values()
        if got != got:  # only NaN differs from itself
            return "it must be a number"
        if kind == "greater_than_equal" and got <= 0.0 < limit < 1.0:
            return f"it must be greater than 0{unit}"  # a negative length is not a small length
        percent = "; 0.04 is 4 %" if kind == "less_than_equal" and "strain" in place.name else ""
        return f"it must be {_BOUNDS[kind]} {limit:g}{unit}{percent}"
    if kind == "number_wanted":
        return f"it must be a number{' in' if unit else ''}{unit}, without quotes"
    if kind == "literal_error":
        words = map(typing.get_args, _members(cast("Any", place.field).annotation))
        allowed = [word for several in words for word in several]
        return f"allowed: {_quoted(allowed)}{nearest(str(got), allowed)}"
    of_parts = bool(place.classes)
    if kind in ("too_short", "too_long"):
        if of_parts:
            return f"give at least one {place.wanted.removeprefix('a ')}"
        side, count = ("least", "min") if kind == "too_short" else ("most", "max")
        return f"give at {side} {record['ctx'][f'{count}_length']:g} values"
    if kind in ("tuple_type", "list_type"):
        listed = f"write it as a list, one [[{place.name}]] table for each"
        return (
            listed if of_parts else "it must be a list of numbers in brackets, such as [0.01, 0.05]"
        )
    table = f"it must be a table: [{place.name.partition('[')[0]}] and its keys below"
    return _RULES.get(kind, table)


_BOUNDS = {
    "greater_than": "greater than",
    "greater_than_equal": "at least",
    "less_than": "less than",
    "less_than_equal": "at most",
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


class ProblemError(ValueError):
    """The problems of a check across several keys: pairs of a key (a path below the part) and text.

    The text goes on after the name of the key: "is 1.7 mm; it must be ...".
    """

    def __init__(self, problems: Problems):
        self.problems = list(problems)
        super().__init__("\n".join(f"`{key}` {text}" for key, text in self.problems))


@overload
def part(cls: type[T]) -> type[T]: ...
@overload
def part(
    *, kw_only: bool, refuse: Callable[[str], InputError] = InputError.INVALID_ROBOT
) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(Field,))
def part(
    cls: type[T] | None = None,
    *,
    kw_only: bool = False,
    refuse: Callable[[str], InputError] = InputError.INVALID_ROBOT,
) -> Any:
    """Make a class a frozen pydantic dataclass that says clearly what is wrong with its values.

    Wrong values raise `InputError`; unknown keys are refused by name. A method `conflicts` yields
    what is wrong across keys, as for `ProblemError`. What the attribute `warnings` of an object
    holds is given as Python warnings when it is made by its class.

    Args:
        cls: The class with its annotated fields.
        kw_only: Whether its fields are keyword arguments only, here and in what derives from it.
        refuse: Makes the error of a message, with its code.
    """
    if cls is None:
        return functools.partial(part, kw_only=kw_only, refuse=refuse)
    decorated: Any = cls
    if hasattr(cls, "conflicts"):
        decorated.__post_init__ = _check_conflicts
    decorated = pydantic.dataclasses.dataclass(
        decorated, frozen=True, kw_only=kw_only, config=ConfigDict(extra="forbid")
    )
    checked_init = decorated.__init__

    @functools.wraps(checked_init)
    def checked(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            checked_init(self, *args, **kwargs)
        except ValidationError as error:
            problems = sentences(error, decorated)
            text = "\n".join(f"{decorated.__name__}: {problem}" for problem in problems)
            raise refuse(text) from None
        for warning in getattr(self, "warnings", ()):
            warnings.warn(warning, stacklevel=2)

    decorated.__init__ = checked
    # for help, without the checks of the annotations
    plain, signature = get_type_hints(decorated), inspect.signature(decorated)
    decorated.__signature__ = signature.replace(
        parameters=[
            parameter.replace(annotation=plain[name])
            for name, parameter in signature.parameters.items()
        ]
    )
    return decorated


def _check_conflicts(part: Any) -> None:
    """Refuse values of a part that contradict each other."""
    if problems := list(part.conflicts()):
        raise ProblemError(problems)


def unchecked(part: T, **values: Any) -> T:
    """Return a part with other values that nothing checks, such as numbers that are traced."""
    other = object.__new__(type(part))
    names = [field.name for field in dataclasses.fields(cast("Any", part))]
    vars(other).update({name: getattr(part, name) for name in names} | values)
    return other


def _converted(to: Callable[[Any], float], method: str, refused: LiteralString) -> BeforeValidator:
    """Return what takes any number with a method (of numpy too), but no truth value and no text."""

    def convert(value: object) -> float:
        if not isinstance(value, bool) and hasattr(value, method):
            with contextlib.suppress(TypeError, ValueError, OverflowError):  # such as of an array
                return to(value)
        raise PydanticCustomError(refused, "another number is wanted")

    return BeforeValidator(convert)


_AS_FLOAT = _converted(float, "__float__", "number_wanted")
Float = Annotated[float, Field(allow_inf_nan=False), _AS_FLOAT]
"""A finite float64."""
FloatOrInf = Annotated[float, _AS_FLOAT]
"""A float64 that may be infinite; a bound of `quantity` keeps NaN out."""
Int = Annotated[int, _converted(operator.index, "__index__", "whole_number_wanted")]
"""A whole number."""


# What a number of a unit may be at most, and at least where it must be greater than 0: far beyond
# every robot, and near enough that nothing computed from it overflows.
_MIN_MAGNITUDE = {"mm": 1e-6, "MPa": 1e-6, "N": 1e-6, "kg/m3": 1e-6, "deg": 1e-6, "": 1e-9}
_MAX_MAGNITUDE = {"mm": 1e6, "MPa": 1e9, "kg/m3": 1e6, "deg": 3600.0, "": 1e3}

MOST_STRAIN = 0.5
"""Beyond every material of a robot; a strain above it was meant in percent."""


def quantity(
    unit: str,
    text: str,
    *,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    usual: tuple[float, float] | None = None,
) -> Any:
    """Describe a number for use in `Annotated`: its unit, what it is, and what is allowed.

    Args:
        unit: Unit as in the robot file ("mm", "N", "MPa", "deg"); "" for a pure number.
        text: What the number is; goes into the JSON Schema, into messages and written files.
        above: Exclusive lower bound.
        below: Exclusive upper bound.
        at_least: Inclusive lower bound.
        at_most: Inclusive upper bound.
        usual: Lowest and highest usual value; beyond them `Robot.warnings` asks what was meant.

    Where a bound is not given, the limits of the unit apply: 1e-6 to 1e6 mm, 1e-6 to 1e9 MPa, 3600
    deg and so on.
    """
    if above == 0.0 and at_least is None:
        at_least = _MIN_MAGNITUDE.get(unit)
    if at_most is None and below is None:
        at_most = _MAX_MAGNITUDE.get(unit)
    if above is None and at_least is None and unit in _MAX_MAGNITUDE:
        at_least = -_MAX_MAGNITUDE[unit]
    extra: dict[str, Any] = {"unit": unit} if unit else {}
    if usual:
        extra["usual"] = list(usual)
    return Field(
        gt=above,
        lt=below,
        ge=at_least,
        le=at_most,
        description=text,
        json_schema_extra=extra or None,
    )


positive = functools.partial(quantity, above=0)
"""Describes a number that must be greater than 0."""
