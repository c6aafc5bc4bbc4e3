"""Reference numbers that are ours: tests/reference/, described in its README."""

from __future__ import annotations

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent / "reference"
WRISTS = ("A", "B", "C")  # the files number the wrists 0, 1, 2
CUTS = ("on-axis", "off-axis")  # and the cuts 0, 1


def reference(name: str) -> np.ndarray:
    """Rows of one of the tables that hold numbers only, under a header line with '#'."""
    return np.loadtxt(FOLDER / name, delimiter=",", comments="#", ndmin=2)


def choose(table: np.ndarray, **columns: tuple[int, float]) -> np.ndarray:
    """Rows whose column (index, value) matches, for every name given."""
    chosen = np.ones(len(table), dtype=bool)
    for index, value in columns.values():
        chosen &= table[:, index] == value
    return table[chosen]
