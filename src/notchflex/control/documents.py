"""The result of following targets, as a JSON document and as columns of a CSV table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from notchflex.control.following import Following
from notchflex.control.targets import DIRECTION
from notchflex.results.files.io import whole_document
from notchflex.results.quantities.registry import QUANTITIES


def following_document(following: Following) -> dict[str, Any]:
    """Return the document of the path, with a list `targets` of the result for each target.

    Keys of a target: `target`, its values by quantity (units as those of the steps), `step` (of
    the path, from 0), `reached`, `error` (mm, N and rad by their weights), `reason`,
    `reason_code` and `solves`.
    """
    targets = [
        {
            "target": _in_file_units(following, index),
            "step": int(following.step[index]),
            "reached": bool(following.reached[index]),
            "error": float(following.error[index]),
            "reason": following.reason[index],
            "reason_code": following.code[index],
            "solves": int(following.solves[index]),
        }
        for index in range(len(following))
    ]
    return whole_document(following.path) | {"targets": targets}


def _in_file_units(following: Following, index: int) -> dict[str, Any]:
    """The target with the keys and units of the JSON document."""
    values: dict[str, Any] = {}
    for name, numbers in following.targets.row(index).items():
        key, scale = name, 1.0
        if name != DIRECTION:
            quantity = QUANTITIES[name]
            key, scale = quantity.key or name, quantity.scale
        values[key] = numbers * scale
    return values


def following_columns(following: Following) -> dict[str, Sequence[Any]]:
    """Return the columns beside those of the path: which target each step is for, and its error.

    A step of an overshoot is for no target.
    """
    steps = len(following.path)
    columns: dict[str, list[Any]] = {
        name: [None] * steps for name in ("target", "target_error", "target_code")
    }
    for index, step in enumerate(following.step):
        columns["target"][step] = index + 1
        columns["target_error"][step] = float(following.error[index])
        columns["target_code"][step] = following.code[index]
    return dict(columns)
