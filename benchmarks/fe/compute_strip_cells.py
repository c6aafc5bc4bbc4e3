"""Compute the table of strip and U-link cells: python compute_strip_cells.py strip|link OUT.csv."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from strip_cells import NAMES, Link, Strip, compliance

# Parts to "fit" differ from the first in one number; those to "judge" were not fitted.
STRIPS = [
    ("fit", Strip(5.0, 3.0, 1.5, 6.9, 3.5)),
    ("judge", Strip(5.0, 3.5, 1.2, 7.3, 3.0, 0.35)),
    ("fit", Strip(5.0, 3.0, 1.0, 6.9, 3.5)),
    ("fit", Strip(5.0, 3.0, 2.0, 6.9, 3.5)),
    ("fit", Strip(5.0, 3.0, 1.5, 6.2, 3.5)),
    ("fit", Strip(5.0, 3.0, 1.5, 7.6, 3.5)),
    ("judge", Strip(5.0, 2.5, 1.8, 6.5, 4.0)),
    ("fit", Strip(5.0, 4.0, 1.5, 6.9, 3.5)),
    ("fit", Strip(5.0, 2.0, 1.5, 6.9, 3.5)),
    ("fit", Strip(5.0, 3.0, 1.5, 6.9, 2.0)),
    ("fit", Strip(5.0, 3.0, 1.5, 6.9, 5.0)),
    ("judge", Strip(5.0, 4.2, 0.8, 7.7, 2.5, 0.33)),
    ("fit", Strip(5.0, 3.0, 1.5, 6.9, 3.5, 0.2)),
    ("fit", Strip(5.0, 3.0, 0.7, 6.9, 3.5)),
    ("judge", Strip(5.0, 2.8, 1.1, 6.6, 3.0, 0.35)),
    ("judge", Strip(5.0, 3.6, 1.3, 7.2, 4.0, 0.3)),
    ("judge", Strip(5.0, 2.2, 1.6, 7.0, 2.5, 0.38)),
]
LINKS = [
    ("fit", Link(2.995, 2.0, 0.7, 2.0, 0.275)),
    ("judge", Link(2.995, 2.3, 0.6, 2.4, 0.2, 0.3)),
    ("fit", Link(2.995, 2.0, 0.5, 2.0, 0.275)),
    ("fit", Link(2.995, 2.0, 1.0, 2.0, 0.275)),
    ("fit", Link(2.995, 2.0, 0.7, 1.2, 0.275)),
    ("fit", Link(2.995, 2.0, 0.7, 2.8, 0.275)),
    ("judge", Link(2.995, 1.7, 0.9, 1.6, 0.35)),
    ("fit", Link(2.995, 2.0, 0.7, 2.0, 0.15)),
    ("fit", Link(2.995, 2.0, 0.7, 2.0, 0.45)),
    ("fit", Link(2.995, 2.5, 0.7, 2.0, 0.275)),
    ("fit", Link(2.995, 1.5, 0.7, 2.0, 0.275)),
    ("judge", Link(2.995, 2.4, 0.45, 3.0, 0.3)),
    ("fit", Link(2.995, 2.0, 0.7, 2.0, 0.275, 0.2)),
    ("fit", Link(2.995, 2.0, 0.35, 2.0, 0.275)),
    ("judge", Link(2.995, 2.1, 0.8, 2.2, 0.25, 0.3)),
    ("judge", Link(2.995, 1.8, 0.55, 1.7, 0.3, 0.38)),
    ("judge", Link(2.995, 2.2, 0.5, 2.6, 0.35, 0.33)),
]
ENTRIES = [(i, j) for i in range(6) for j in range(i, 6) if (i in (1, 2, 3)) == (j in (1, 2, 3))]


def main(kind: str, out: Path) -> None:
    """Write E times the compliance (mm) of each part that the table has not yet."""
    parts = STRIPS if kind == "strip" else LINKS
    own = ("depth", "height") if kind == "strip" else ("length", "slot_radius")
    first = ("outer", "inner", "thickness", *own, "nu")
    if not out.exists():
        names = [f"EC_{NAMES[i]}_{NAMES[j]}" for i, j in ENTRIES]
        out.write_text(",".join(["use", *first, "nodes", *names]) + "\n", encoding="utf-8")
    done = len(out.read_text(encoding="utf-8").splitlines()) - 1
    for use, part in parts[done:]:
        begun = time.time()
        fine, coarse = part.thickness / 5.5, 0.3 * part.outer
        if isinstance(part, Link):
            fine, coarse = min(part.thickness / 5.0, part.slot_radius / 1.8), 0.2 * part.outer
        with tempfile.TemporaryDirectory() as work:
            found, _, nodes = compliance(part, Path(work), fine, coarse)
        values = [use, *(getattr(part, name) for name in first), nodes]
        row = [str(value) for value in values] + [f"{found[i, j]:.6g}" for i, j in ENTRIES]
        with out.open("a", encoding="utf-8") as file:
            file.write(",".join(row) + "\n")
        print(f"{part} {nodes} nodes, {time.time() - begun:.0f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
