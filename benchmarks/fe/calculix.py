"""Decks of quadratic tetrahedra for CalculiX (`ccx`), run on one thread."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np

ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""CalculiX counts the last two middle nodes of a tetrahedron the other way round than gmsh."""
PRINTED = ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]


def solid_lines(
    nodes: Iterable[tuple[int, np.ndarray]], cells: np.ndarray, young: float, poisson: float
) -> list[str]:
    """Return the lines of nodes (number and place), elements (numbers of nodes) and material."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{number},{x:.12g},{y:.12g},{z:.12g}" for number, (x, y, z) in nodes]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=SOLID")
    lines += [f"{k},{','.join(map(str, cell))}" for k, cell in enumerate(cells.tolist(), 1)]
    lines += ["*MATERIAL, NAME=TUBE", "*ELASTIC", f"{young},{poisson}"]
    return [*lines, "*SOLID SECTION, ELSET=SOLID, MATERIAL=TUBE"]


def run(folder: Path, name: str, to_the_end: bool = True) -> str:
    """Run the deck `name.inp` in a folder, and return what it printed."""
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(["ccx", name], cwd=folder, check=to_the_end, capture_output=True, env=alone)
    return (folder / f"{name}.dat").read_text(encoding="utf-8")


def displacements(folder: Path, name: str, lines: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Write and run a deck: numbers of nodes, and displacements, of one step after the other."""
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = (line.split() for line in run(folder, name).splitlines())
    table = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    return table[:, 0].astype(int), table[:, 1:]
