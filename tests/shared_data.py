"""Measured data that are not ours to copy: read beside the checkout, or the test skips."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data"


def measured_path(name: str) -> Path:
    """Path of a file of the shared data folder; skips the test where the folder is absent."""
    if not FOLDER.is_dir():
        pytest.skip(
            "the measured data and the authors' numbers carry no licence, so they are not in this "
            "repository; this test reads them from ../shared/data beside it, which is absent"
        )
    return FOLDER / name


def measured(name: str) -> list[dict[str, str]]:
    """Rows of a CSV file of the shared data folder, as text by column."""
    with measured_path(name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers(rows: list[dict[str, str]], column: str) -> list[float]:
    """One column of such rows."""
    return [float(row[column]) for row in rows]


def notch_columns(rows: list[dict[str, str]]) -> list[list[float]]:
    """Columns notch_1_deg, notch_2_deg ... [deg], as many as the first row fills."""
    count = sum(key.startswith("notch_") and value != "" for key, value in rows[0].items())
    return [[float(row[f"notch_{j}_deg"]) for j in range(1, count + 1)] for row in rows]
