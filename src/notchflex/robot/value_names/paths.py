"""Paths of values, such as `notch[2].depth`: their parts, and the tables that they mean."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple, cast

from notchflex.errors import InputError
from notchflex.robot.error_messages import nearest
from notchflex.robot.fields import fields_of
from notchflex.robot.kinds import Friction, Material, Notch, kinds_of
from notchflex.robot.robot import Drawing
from notchflex.robot.tendon import Tendon
from notchflex.robot.tube import Tube

SECTIONS: dict[str, type] = {
    "tube": Tube,
    "notch": Notch,
    "tendon": Tendon,
    "material": Material,
    "friction": Friction,
    "drawing": Drawing,
}
EXAMPLES = "write it like material.elastic_modulus, notch[2].depth or notch[*].depth"

_PATH = re.compile(r"(?P<section>\w+)(?:\[(?P<index>\*|\d+)\])?(?:\.(?P<key>\w+))?")
# More digits than the number of any notch has.
_DIGITS = 9


class ValuePath(NamedTuple):
    """A parsed path: `number` is None for the whole list and for sections that are no list."""

    path: str
    section: str
    number: int | None
    key: str


def parse_path(path: str) -> ValuePath:
    """Split a path and check its section and whether a number may stand there."""
    match = _PATH.fullmatch(path.strip())
    if not match:
        raise InputError.UNKNOWN_NAME(f"`{path}` is not the name of a value; {EXAMPLES}.")
    section, index, key = match["section"], match["index"], match["key"]
    if section == "name" and index is None and key is None:
        return ValuePath(path, "name", None, "")
    if section not in SECTIONS and key is None:
        owners = [f"`{one}.{section}`" for one in SECTIONS if section in keys_of(one)]
        near = nearest(section, ["name", *SECTIONS])
        meant = f" (did you mean {' or '.join(owners)}?)" if owners else near
        raise InputError.UNKNOWN_NAME(f"`{path}` is not the name of a value{meant}; {EXAMPLES}.")
    if section not in SECTIONS:
        allowed = ["name", *SECTIONS]
        raise InputError.UNKNOWN_NAME(
            f"`{path}` begins with `{section}`, which no robot has{nearest(section, allowed)}. "
            f"Allowed: {', '.join(allowed)}."
        )
    if key is None:
        raise InputError.UNKNOWN_NAME(f"`{path}` names no single value; {EXAMPLES}.")
    if index is not None and section not in ("notch", "tendon"):
        raise InputError.UNKNOWN_NAME(
            f"`{path}` has a number, but there is one {section}: `{section}.{key}`."
        )
    if index is not None and len(index) > _DIGITS:
        raise InputError.OUT_OF_RANGE(f"there is no {section} of that number; {EXAMPLES}.")
    return ValuePath(path, section, None if index in (None, "*") else int(index), key)


def tables_at(table: dict[str, Any], target: ValuePath) -> list[dict[str, Any]]:
    """Find the tables that a path means; a single notch is first split from its group."""
    tables = table.setdefault(target.section, {})
    if isinstance(tables, dict):
        return [tables]
    if target.number is None:
        return tables
    number = sum(one.get("repeat", 1) for one in tables)
    if not 1 <= target.number <= number:
        plural = {"notch": "notches", "tendon": "tendons"}[target.section]
        raise InputError.OUT_OF_RANGE(
            f"`{target.path}`: the robot has {number} {target.section if number == 1 else plural}; "
            f"give a number from 1 to {number}."
        )
    before = target.number - 1  # how many stand before the chosen one, within its group in the end
    group = 0
    while before >= (count := tables[group].get("repeat", 1)):
        before -= count
        group += 1
    if count > 1:
        one = tables[group]
        kind = cast("type[Notch]", class_of("notch", one))  # nothing else is repeated
        pieces = ((0, before), (before, 1), (before + 1, count - before - 1))
        tables[group : group + 1] = [
            kind.further_on(one, start) | {"repeat": number} for start, number in pieces if number
        ]
        group += 1 if before else 0
    return [tables[group]]


def defaults_of(section: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the defaults of the keys of a part, which a file may leave out; not of its kind."""
    keys = fields_of(class_of(section, table))
    return {
        name: field.default
        for name, field in keys.items()
        if name != "kind" and not field.is_required()
    }


def keys_of(section: str) -> set[str]:
    """Return the keys that any kind of a part has."""
    base = SECTIONS[section]
    classes = kinds_of(base).values() if issubclass(base, Notch | Material | Friction) else [base]
    return {key for one in classes for key in fields_of(one)}


def class_of(section: str, table: Mapping[str, Any]) -> type:
    """Return the class of a part, given as the table of a file."""
    base = SECTIONS[section]
    return kinds_of(base)[table["kind"]] if "kind" in table else base
