"""What following targets returns, as a JSON document and as columns of a CSV table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from notchflex.control.following import Following
from notchflex.control.targets import DIRECTION
from notchflex.results.files.io import whole_document
from notchflex.results.quantities.registry import QUANTITIES


def following_document(found: Following) -> dict[str, Any]:
    """Return the document of the path, with a list `targets` of what each target came to.

    Keys of a target: `target`, its values by quantity (units as those of the steps), `step` (of
    the path, from 0), `reached`, `error` (mm, N and rad by their weights), `reason`,
    `reason_code` and `solves`.
    """
    targets = [
        {
            "target": _in_file_units(found, index),
            "step": int(found.step[index]),
            "reached": bool(found.reached[index]),
            "error": float(found.error[index]),
            "reason": found.reason[index],
            "reason_code": found.code[index],
            "solves": int(found.solves[index]),
        }
        for index in range(len(found))
    ]
    return whole_document(found.path) | {"targets": targets}


def _in_file_units(found: Following, index: int) -> dict[str, Any]:
    """The target with the keys and units of the JSON document."""
    values: dict[str, Any] = {}
    for name, numbers in found.targets.row(index).items():
        key, scale = name, 1.0
        if name != DIRECTION:
            quantity = QUANTITIES[name]
            key, scale = quantity.key or name, quantity.scale
        values[key] = numbers * scale
    return values


def following_columns(found: Following) -> dict[str, Sequence[Any]]:
    """Return the columns beside those of the path: which target each step is for, and its error.

    A step of an overshoot is for no target.
    """
    steps = len(found.path)
    columns: dict[str, list[Any]] = {
        name: [None] * steps for name in ("target", "target_error", "target_code")
    }
    for index, step in enumerate(found.step):
        columns["target"][step] = index + 1
        columns["target_error"][step] = float(found.error[index])
        columns["target_code"][step] = found.code[index]
    return dict(columns)
