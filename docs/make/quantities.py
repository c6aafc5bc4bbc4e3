"""Writes the table of docs/units_and_frames.md from the one table of quantities.

`python docs/make/quantities.py`; a test compares the page with `tables()`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from notchflex.results.quantities import QUANTITIES

sys.path.append(str(Path(__file__).resolve().parents[1] / "papers"))
from page import rewrite, table

PAGE = "../units_and_frames.md"  # from the folder of page.py


def tables() -> dict[str, str]:
    """Return the table of all quantities by the name of its mark."""
    head = ("Python", "meaning", "unit in files", "JSON key", "CSV column")
    rows = [
        (_code(one.name), one.description, one.unit, _code(one.key), _code(one.column))
        for one in QUANTITIES.values()
    ]
    # The class keeps the column of sentences wide (docs/style.css): the names would squeeze it.
    wide = f'<div class="quantities" markdown="1">{table(head, rows)}</div>'
    return {"quantities": f"\n\n{wide}\n\n"}


def _code(text: str) -> str:
    return f"`{text}`" if text else ""


if __name__ == "__main__":
    rewrite(PAGE, tables())
