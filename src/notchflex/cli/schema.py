"""`notchflex schema`."""

from __future__ import annotations

import json
import sys

from notchflex.robot import json_schema


def schema() -> None:
    """Print the JSON Schema of robot files."""
    sys.stdout.write(json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n")
