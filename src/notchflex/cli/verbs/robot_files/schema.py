"""`notchflex schema`."""

from __future__ import annotations

import json
from typing import Annotated

from notchflex import InputError, json_schema
from notchflex.cli.arguments.conversion import flag
from notchflex.support import write_document


def schema(
    *,
    design: Annotated[bool, flag("The schema of design files instead.")] = False,
    sweep: Annotated[bool, flag("The schema of plan files of sweeps instead.")] = False,
) -> None:
    """Print the JSON Schema of robot files, of design files or of plan files."""
    if design and sweep:
        raise InputError.CONFLICT("--design and --sweep exclude each other; give one of them.")
    if sweep:
        from notchflex.sweeping import plan_schema

        document = plan_schema()
    elif design:
        from notchflex.designing.specification import design_schema

        document = design_schema()
    else:
        document = json_schema()
    write_document(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
