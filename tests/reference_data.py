"""Reference numbers that are ours: tests/reference/, described in its README."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).resolve().parent / "reference"
WRISTS = ("A", "B", "C")  # the files number the wrists 0, 1, 2
CUTS = ("on-axis", "off-axis")  # and the cuts 0, 1


def reference(name: str) -> np.ndarray:
    """Rows of one of the tables that hold numbers only, under a header line with '#'."""
    return np.loadtxt(FOLDER / name, delimiter=",", comments="#", ndmin=2)


def named_rows(name: str) -> list[dict[str, Any]]:
    """Rows of one of the tables with names of columns in its first line, numbers as floats."""

    def value(text: str) -> float | str:
        try:
            return float(text)
        except ValueError:
            return text

    with (FOLDER / name).open(newline="", encoding="utf-8") as file:
        lines = (line for line in file if not line.startswith("#"))
        return [{key: value(text) for key, text in row.items()} for row in csv.DictReader(lines)]


def choose(table: np.ndarray, **columns: tuple[int, float]) -> np.ndarray:
    """Rows whose column (index, value) matches, for every name given."""
    chosen = np.ones(len(table), dtype=bool)
    for index, value in columns.values():
        chosen &= table[:, index] == value
    return table[chosen]
