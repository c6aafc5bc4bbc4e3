"""Writes src/notchflex/results/quantities.py, a line and a title for every quantity.

`python docs/make/quantity_properties.py`; a test compares the file with `module()`. Type checkers
and editors read written properties; everything else of them comes from the registry.
"""

from __future__ import annotations

from pathlib import Path

from notchflex.results.quantities import QUANTITIES

FILE = Path(__file__).resolve().parents[2] / "src/notchflex/results/quantities.py"
MARK = "    # Written by docs/make/quantity_properties.py:\n"
KINDS = {float: "Number", bool: "Flag", int: "Count", str: "Text"}


def module() -> str:
    """Return the text of the module: what is above the mark stays."""
    lines = [
        f'    {name} = {"Array" if one.per else KINDS[one.kind]}()\n    """{one.summary}"""\n'
        for name, one in QUANTITIES.items()
    ]
    above, _, below = FILE.read_text(encoding="utf-8").partition(MARK)
    return above + MARK + "".join(lines).rstrip() + below[below.index("\n\n") :]


if __name__ == "__main__":
    FILE.write_text(module(), encoding="utf-8")
