"""Draws the picture of the page on sweeps into docs/images.

`python docs/make/sweep.py`.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import notchflex as nf
from notchflex.plotting import sweep_picture

DOCS = Path(__file__).resolve().parents[1]
IMAGES = DOCS / "images"


def main() -> None:
    """Run the plan that the page shows, and draw it."""
    page = (DOCS / "sweep.md").read_text(encoding="utf-8")
    text = re.search(r'```toml title="plan.toml"\n(.*?)```', page, re.DOTALL)
    assert text is not None, "the page shows no plan.toml"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "plan.toml"
        file.write_text(text[1], encoding="utf-8")
        found = nf.sweep(file, Path(folder) / "swept")
        picture = sweep_picture(found, "notch.depth", "total_angle_deg_step_3")
        picture.save(IMAGES / "sweep.svg")


if __name__ == "__main__":
    main()
