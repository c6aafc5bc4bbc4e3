"""The JSON Schema of design files."""

from __future__ import annotations

from typing import Any

from notchflex.designing.specification.spec import DesignSpec
from notchflex.robot.schema import schema_of


def design_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file (draft 2020-12).

    Example:
        >>> design_schema()["required"]
        ['robot']
    """
    text = "What a robot must do and what may be chosen for it, in mm, N, MPa and deg."
    return schema_of(DesignSpec, "notchflex design file", text)
