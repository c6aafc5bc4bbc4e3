"""What every part of a robot is: a frozen dataclass, checked by pydantic when it is made."""

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

# Fields of the parts of a robot, as pydantic records them: kinds, lists and keys.


def kinds_in(annotation: Any) -> list[type]:
    """List the part classes that an annotation of a field allows."""
    if typing.get_origin(annotation) is Annotated:
        return kinds_in(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (Union, types.UnionType, tuple):
        return [cls for item in typing.get_args(annotation) for cls in kinds_in(item)]
    is_part = isinstance(annotation, type) and dataclasses.is_dataclass(annotation)
    return [annotation] if is_part else []


def is_list(field: Any) -> bool:
    """Return whether a field (pydantic's record of it; None takes nothing) takes a list."""

    def takes(annotation: Any) -> bool:
        origin = typing.get_origin(annotation)
        if origin in (Annotated, Union, types.UnionType):
            return any(map(takes, typing.get_args(annotation)))
        return origin is tuple

    return field is not None and takes(field.annotation)


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
    """Return pydantic's field records, in the order in which a file lists the keys.

    That is `kind`, then what the class itself declares, then what all kinds share.
    """
    pydantic_fields: dict[str, Any] = getattr(cls, "__pydantic_fields__", {})
    shared = {f.name for f in dataclasses.fields(cls) if f.kw_only}
    order = sorted(pydantic_fields.items(), key=lambda item: (item[0] != "kind", item[0] in shared))
    return types.MappingProxyType(dict(order))


# Clear sentences instead of pydantic's error records.

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


T = TypeVar("T")


class ProblemError(ValueError):
    """What a check across several keys found: pairs of a key (a path below the part) and a text.

    The text goes on after the name of the key: "is 1.7 mm; it must be ...".
    """

    def __init__(self, problems: Iterable[tuple[str, str]]):
        self.found = list(problems)
        super().__init__("\n".join(f"`{key}` {text}" for key, text in self.found))


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

    Wrong values raise `InputError`; unknown keys are refused by name. What the attribute `warnings`
    of an object holds is given as Python warnings when it is made by its class.

    Args:
        cls: The class with its annotated fields.
        kw_only: Whether its fields are keyword arguments only, here and in what derives from it.
        refuse: Makes the error of a message, with its code.
    """
    if cls is None:
        return functools.partial(_part, kw_only=kw_only, refuse=refuse)
    return _part(cls, kw_only=kw_only, refuse=refuse)


def _part(cls: type[T], *, kw_only: bool, refuse: Callable[[str], InputError]) -> type[T]:
    dataclass = pydantic.dataclasses.dataclass(
        frozen=True, kw_only=kw_only, config=ConfigDict(extra="forbid")
    )
    decorated: Any = dataclass(cls)
    checked_init = decorated.__init__

    @functools.wraps(checked_init)
    def checked(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            checked_init(self, *args, **kwargs)
        except ValidationError as error:
            problems = sentences(error, decorated)
            raise refuse("\n".join(f"{decorated.__name__}: {one}" for one in problems)) from None
        for warning in getattr(self, "warnings", ()):
            warnings.warn(warning, stacklevel=2)

    decorated.__init__ = checked
    decorated.__signature__ = _plain_signature(decorated)
    return decorated


def _plain_signature(cls: Any) -> inspect.Signature:
    """Return the signature of a class without the checks of its annotations, for help."""
    signature = inspect.signature(cls)
    names = {name: one.annotation for name, one in signature.parameters.items()}
    namespace = {"__annotations__": names, "__module__": cls.__module__}
    plain = get_type_hints(type(cls.__name__, (), namespace))
    return signature.replace(
        parameters=[one.replace(annotation=plain[n]) for n, one in signature.parameters.items()]
    )


def unchecked(part: T, **values: Any) -> T:
    """Return a part with other values that nothing checks, such as numbers that are traced."""
    other = object.__new__(type(part))
    names = {field.name for field in dataclasses.fields(cast("Any", part))}
    vars(other).update({name: one for name, one in vars(part).items() if name in names} | values)
    return other


def _as_float(value: object) -> float:
    """Take any real number (of numpy too), but no truth value and no text."""
    if isinstance(value, (bool, str, bytes)) or not hasattr(value, "__float__"):
        raise PydanticCustomError("number_wanted", "a number is wanted")
    try:
        return float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, OverflowError):
        raise PydanticCustomError("number_wanted", "a number is wanted") from None


def _as_int(value: object) -> int:
    """Take any whole number type (of numpy too), but no truth value, no text and no float."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise PydanticCustomError("whole_number_wanted", "a whole number is wanted")
    try:
        return operator.index(value)  # pyright: ignore[reportArgumentType]
    except TypeError:  # an array of several numbers, or of floats
        raise PydanticCustomError("whole_number_wanted", "a whole number is wanted") from None


Float = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_as_float)]
"""A finite float64."""
FloatOrInf = Annotated[float, BeforeValidator(_as_float)]
"""A float64 that may be infinite; a bound of `quantity` keeps NaN out."""
Int = Annotated[int, BeforeValidator(_as_int)]
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
