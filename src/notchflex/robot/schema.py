"""The JSON Schema of robot files, for editors that check and complete them."""

import math
from typing import Any

from pydantic import TypeAdapter

from notchflex.robot.robot import Robot

# pydantic's words for bounds, which it leaves as they are behind a check of our own
_BOUNDS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
}


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a robot file (draft 2020-12).

    Returns:
        The schema; every number has its unit under `unit`.  It holds nothing that JSON lacks: an
        infinite default is left out and stated in the description.

    Example:
        >>> sorted(json_schema()["required"])
        ['friction', 'material', 'name', 'notch', 'tendon', 'tube']
    """
    return schema_of(
        Robot, "notchflex robot file", "A tendon-driven notched tube, in mm, N, MPa and deg."
    )


def schema_of(cls: type, title: str, description: str) -> dict[str, Any]:
    """Return the JSON Schema of a file that a part describes.

    Args:
        cls: The part.
        title: What the file is called.
        description: What it holds.
    """
    schema = TypeAdapter(cls).json_schema()
    for one in [schema, *schema["$defs"].values()]:
        _tidy(one)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": title,
        "description": description,
    }


def _tidy(model: dict[str, Any]) -> None:
    """Make the schema of a class say what a file must hold."""
    # the rest of a docstring speaks of Python
    model["description"] = str(model.get("description", "")).partition("\n")[0]
    properties: dict[str, dict[str, Any]] = model["properties"]
    for value in properties.values():
        value.pop("title", None)
        default = value.get("default")
        if default in (None, []) or (isinstance(default, float) and math.isinf(default)):
            value.pop("default", None)  # TOML has no null: such a key is left out
        choices = [one for one in value.get("anyOf", ()) if one != {"type": "null"}]
        if len(choices) == 1:
            del value["anyOf"]
            value.update(choices[0])
        for ours, theirs in _BOUNDS.items():
            if ours in value:
                value[theirs] = value.pop(ours)
    if "kind" in properties:  # it has a default in Python, but a file must name it
        model["required"] = ["kind", *model.get("required", [])]
        properties["kind"].pop("default", None)
