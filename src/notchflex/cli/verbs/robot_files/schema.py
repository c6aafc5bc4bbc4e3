"""`notchflex schema`."""

from __future__ import annotations

import json

from notchflex.results.files.streams import write_document
from notchflex.robot import json_schema


def schema() -> None:
    """Print the JSON Schema of robot files."""
    write_document(json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n")
