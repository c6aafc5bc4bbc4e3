"""Makes the tables (between marks that do not show) and pictures of comparisons with other numbers.

`python docs/make/validation.py` makes all of it, `python docs/make/validation.py gao2017` one part.
Each part is a module beside this one, `against_<part>.py`, that compares the package with numbers
of tests/reference and returns tables by name, and draws its pictures. They stand on
docs/validation.md, or on the page that the module names as `PAGE`.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = "../validation.md"  # from the folder of page.py
PICTURES = ROOT / "docs" / "images" / "validation"
PARTS = ("sections", "pacheco2021", "liu2022", "gao2017", "finite_elements", "drawing", "measured")


def main(parts: list[str]) -> None:
    """Make some parts of the page."""
    # The tables are read, and runs are set up, by what the tests use too.
    sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "docs" / "papers")]
    unknown = set(parts) - set(PARTS)
    if unknown:
        sys.exit(f"no such part: {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    page = importlib.import_module("page")
    for part in parts or PARTS:
        module = importlib.import_module(f"against_{part}")
        print(part, flush=True)
        page.main(getattr(module, "PAGE", PAGE), module.tables)
        if hasattr(module, "pictures"):
            module.pictures(PICTURES)


if __name__ == "__main__":
    main(sys.argv[1:])
