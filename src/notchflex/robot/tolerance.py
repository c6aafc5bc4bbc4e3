"""Tolerances of a robot: how far its values may lie from those of its file."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any, TypeAlias, cast

from pydantic import BeforeValidator, WithJsonSchema

from notchflex.robot.error_messages import unknown_key
from notchflex.robot.part import ProblemError

Deviation: TypeAlias = float | str
"""A number in the unit of the value, or a part of the value as text, such as "5 %"."""

_PERCENT = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?%")
_HOW = 'give a number in the unit of the value, or text such as "5 %"'


@dataclass(frozen=True)
class Tolerance:
    """How far one value of a robot may lie from the one in its file.

    Attributes:
        value: Name of the value, such as `notch.depth` or `notch[3].depth`.
        sd: Standard deviation of a normal distribution, cut off at `plus` and `minus` if given.
        plus: How far above the value it may lie; with `minus` and without `sd` the deviation is
            uniform.
        minus: How far below the value it may lie, as a positive number.
        per_notch: Whether every notch has a deviation of its own; else all have the same.
    """

    value: str
    sd: Deviation | None = None
    plus: Deviation | None = None
    minus: Deviation | None = None
    per_notch: bool = False

    @property
    def written(self) -> Any:
        """What stands in a robot file: the standard deviation alone, or a table."""
        keys = {name: getattr(self, name) for name in _KEYS}
        table = {name: one for name, one in keys.items() if one is not None and one is not False}
        return self.sd if list(table) == ["sd"] else table


_KEYS = tuple(field.name for field in fields(Tolerance))[1:]


def amount(deviation: Deviation | None, value: float) -> float:
    """Return a deviation in the unit of its value; infinite for None.

    Example:
        >>> amount("5 %", 40_000.0), amount(0.01, 1.4)
        (2000.0, 0.01)
    """
    if isinstance(deviation, str):
        return float(deviation.rstrip("% ")) / 100.0 * abs(value)
    return math.inf if deviation is None else deviation


def with_limits(tolerances: Sequence[Tolerance], path: str, value: float) -> str:
    """Return a value as a drawing has it, with its tolerance; a standard deviation counts twice.

    Example:
        >>> with_limits((Tolerance("notch.depth", sd=0.01),), "notch.depth", 1.4)
        '1.4 ±0.02'
    """
    text = f"{value:.6g}"
    for one in tolerances:
        if one.value == path:
            plus, minus = (
                2.0 * amount(one.sd, value) if far is None else amount(far, value)
                for far in (one.plus, one.minus)
            )
            text += f" ±{plus:.3g}" if plus == minus else f" +{plus:.3g} −{minus:.3g}"
    return text


def read_tolerances(table: Any) -> Any:
    """Make tolerances of the table of a robot file, or leave those that are made."""
    if table is None:
        return ()
    if isinstance(table, Sequence) and all(
        isinstance(one, Tolerance) for one in cast("Sequence[Any]", table)
    ):
        return tuple(cast("Sequence[Tolerance]", table))
    if not isinstance(table, Mapping):
        text = "is not a table; write [tolerance] and below it lines such as notch.depth = 0.01."
        raise ProblemError([("", text)])
    tolerances: dict[str, Tolerance] = {}
    problems: list[tuple[str, str]] = []
    for name, entry in _flat(cast("Mapping[str, Any]", table)):
        value = name.replace("[*]", "")
        if value in tolerances:
            problems.append((name, "is given twice; give it once."))
        keys = cast("dict[str, Any]", entry if isinstance(entry, dict) else {"sd": entry})
        problems += [(name, text) for text in _entry_problems(name, keys)]
        tolerances[value] = Tolerance(value, **{key: keys[key] for key in _KEYS if key in keys})
    if problems:
        raise ProblemError(problems)
    return tuple(tolerances.values())


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the names of values and what is given for them: TOML reads `a.b` as nested tables."""
    for key, entry in table.items():
        name = f"{before}{key}"
        if isinstance(entry, Mapping) and "." not in name:
            yield from _flat(cast("Mapping[str, Any]", entry), f"{name}.")
        else:
            yield name, dict(cast("Any", entry)) if isinstance(entry, Mapping) else entry


def _entry_problems(name: str, entry: dict[str, Any]) -> Iterator[str]:
    for key, value in entry.items():
        if key not in _KEYS:
            sentence = unknown_key(f"{name}.{key}", key, _KEYS)
            yield f"has a wrong key: {sentence}"
        elif key == "per_notch":
            if not isinstance(value, bool):
                yield f"has per_notch = {value!r}; write true or false."
        elif isinstance(value, str):
            if not _PERCENT.fullmatch(value):
                yield f'has the text "{value}"; {_HOW}.'
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            yield f"has {key} = {value!r}, which is not a number; {_HOW}."
        elif not 0.0 <= value < math.inf:
            yield f"has {key} = {value}; give a finite number of 0 or more, without a sign."
    if "sd" not in entry and not {"plus", "minus"} <= entry.keys():
        yield "has neither `sd` (standard deviation) nor both `plus` and `minus`; give one of them."


_DEVIATION = {
    "anyOf": [{"type": "number", "minimum": 0}, {"type": "string", "pattern": "^[0-9.]+ ?%$"}]
}
_ENTRY = {
    "anyOf": [
        *_DEVIATION["anyOf"],
        {
            "type": "object",
            "properties": {
                "sd": {**_DEVIATION, "description": "standard deviation"},
                "plus": {**_DEVIATION, "description": "how far above the value"},
                "minus": {**_DEVIATION, "description": "how far below the value, positive"},
                "per_notch": {"type": "boolean", "description": "each notch deviates by itself"},
            },
            "additionalProperties": False,
        },
        {"type": "object", "additionalProperties": True},  # `notch.depth` as a table in a table
    ]
}

Tolerances = Annotated[
    tuple[Tolerance, ...],
    BeforeValidator(read_tolerances),
    WithJsonSchema({"type": "object", "additionalProperties": _ENTRY}),
]
"""The `[tolerance]` table of a robot file."""
