"""The JSON Schema of plan files."""

from __future__ import annotations

from typing import Any

from notchflex.robot.schema import schema_of
from notchflex.sweeping.plan.parts import SweepPlan
from notchflex.tolerancing.reading import LOAD_KEYS


def plan_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan file (draft 2020-12).

    Example:
        >>> plan_schema()["required"]
        ['robot', 'variable', 'load', 'keep']
    """
    text = "Which numbers of a robot are varied, and what is kept, in mm, N, MPa and deg."
    schema = schema_of(SweepPlan, "notchflex plan file of a sweep", text)
    schema["properties"]["load"]["additionalProperties"] = {
        "type": "object",
        "properties": {key: {} for key in LOAD_KEYS},
        "additionalProperties": False,
    }
    return schema
