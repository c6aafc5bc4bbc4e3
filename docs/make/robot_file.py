"""Writes the tables of docs/robot_file.md from the JSON Schema of robot files.

`python docs/make/robot_file.py`; a test compares the page with `tables()`.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import notchflex as nf

sys.path.append(str(Path(__file__).resolve().parents[1] / "papers"))
from page import rewrite, table

PAGE = "../robot_file.md"  # from the folder of page.py
SINGLE = ("Tube", "Tendon", "Fatigue", "Drive", "Drawing")
KINDS = ("notch", "material", "friction")


def tables() -> dict[str, str]:
    """Return the tables by the name of their mark: a part, or all kinds of one."""
    schema = nf.json_schema()
    parts = schema["$defs"]
    found = {name.lower(): _part(parts[name]) for name in SINGLE}
    for key in KINDS:
        found[key] = "\n" + "\n".join(_kind(key, parts[name]) for name in _kinds(schema, key))
    found["top"] = _top(schema)
    return found


def _top(schema: dict[str, Any]) -> str:
    rows = []
    for key, value in schema["properties"].items():
        several = value.get("type") == "array"
        if "$ref" in value or "discriminator" in value:
            written = f"`[{key}]`"
        else:
            single = f"`[{key}]`" if value.get("type") == "object" else f'`{key} = "..."`'
            written = f"`[[{key}]]`" if several else single
        needed = key in schema["required"]
        least = "one" if needed else "none"
        number = f"{least} or more" if several else "one" if needed else "none or one"
        rows.append((written, number, MEANING[key]))
    return table(("written", "how many", "meaning"), rows)


MEANING = {
    "name": "what tables and pictures call the robot",
    "tube": "the tube before it is cut",
    "notch": "the notches, base to tip; `repeat` stands for several equal ones",
    "tendon": "the tendons",
    "material": "the material of the tube",
    "friction": "the friction between tendon and tube",
    "tolerance": "how far values may lie from these, by name: see below",
    "fatigue": "the limit line that its [strain cycles](fatigue.md) are compared with",
    "drawing": "what the title block of a drawing says",
    "drive": "spools that drive two tendons each: see [Sheaths and spools](transmission.md)",
}


def _kinds(schema: dict[str, Any], key: str) -> list[str]:
    """Return the names of the definitions of all kinds of a part."""
    value = schema["properties"][key]
    mapping = value.get("items", value)["discriminator"]["mapping"]
    return [reference.rsplit("/", 1)[1] for reference in mapping.values()]


def _kind(key: str, part: dict[str, Any]) -> str:
    kind = part["properties"]["kind"]["const"]
    return f'\n#### {key}: `kind = "{kind}"`\n\n{part["description"]}{_part(part)}'


def _part(part: dict[str, Any]) -> str:
    required = set(part.get("required", ()))
    rows = [
        (
            f"`{key}`",
            value.get("unit", ""),
            _allowed(value),
            "required" if key in required else _default(part["title"], key),
            value.get("description", ""),
        )
        for key, value in part["properties"].items()
        if key != "kind"
    ]
    if not rows:
        return "\n\nIt has no keys but `kind`.\n"
    rows.sort(key=lambda row: row[3] != "required")
    return table(("key", "unit", "allowed", "if left out", "meaning"), rows)


def _default(title: str, key: str) -> str:
    """Return the default of the class itself: the schema cannot say infinite."""
    default = getattr(nf, title).__dataclass_fields__[key].default
    if default is None:
        return "none"
    return f'`"{default}"`' if isinstance(default, str) else f"`{default}`"


def _allowed(value: dict[str, Any]) -> str:
    if "enum" in value:
        return " or ".join(f'`"{one}"`' for one in value["enum"])
    if "anyOf" in value:
        return " or ".join(filter(None, map(_allowed, value["anyOf"])))
    if "$ref" in value or "oneOf" in value:
        return "a table"
    if value.get("type") == "array" and "minItems" not in value:
        return f"list of: {_allowed(value['items'])}"
    if value.get("type") == "array":
        return f"{value['minItems']} to {value['maxItems']} of: {_allowed(value['items'])}"
    word = {"integer": "whole number", "number": "number", "string": "text"}[value["type"]]
    lower = [("from", "minimum"), ("above", "exclusiveMinimum")]
    upper = [("to", "maximum"), ("and below", "exclusiveMaximum")]
    limits = [
        next((f"{name} {_number(value[key])}" for name, key in end if key in value), "")
        for end in (lower, upper)
    ]
    return " ".join(filter(None, [word, *limits]))


def _number(value: float) -> str:
    """Return a number as a robot file holds it: 1e-6, not 1e-06."""
    return re.sub(r"e([+-])0*", lambda found: f"e{found[1].strip('+')}", f"{value:g}")


if __name__ == "__main__":
    rewrite(PAGE, tables())
