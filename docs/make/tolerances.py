"""Draws the picture of the page on tolerances into docs/images.

`python docs/make/tolerances.py`.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import notchflex as nf

DOCS = Path(__file__).resolve().parents[1]
IMAGES = DOCS / "images"


def main() -> None:
    """Analyse the file that the page shows, and draw it."""
    page = (DOCS / "tolerances.md").read_text(encoding="utf-8")
    text = re.search(r'```toml title="limits.toml"\n(.*?)```', page, re.DOTALL)
    assert text is not None, "the page shows no limits.toml"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "limits.toml"
        file.write_text(text[1], encoding="utf-8")
        found = nf.tolerance_analysis(nf.load_robot("pacheco2021-a"), file, draws=6400)
    nf.plot(found).save(IMAGES / "tolerances.svg")


if __name__ == "__main__":
    main()
