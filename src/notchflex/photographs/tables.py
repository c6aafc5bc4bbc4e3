"""Tables and documents of measured photographs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from notchflex.fit.measurements import columns
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.results.files.json import document_head

PHOTOGRAPH = "photograph"
"""Column with the name of the file; `calibrate` passes over it."""


def measured_columns(found: MeasuredPhotographs) -> dict[str, list[Any]]:
    """Return the columns of the CSV, one row for each photograph that was measured."""
    rows = [number for number, one in enumerate(found.photographs) if one.measured]
    kept = [found.photographs[row] for row in rows]
    table: dict[str, list[Any]] = {PHOTOGRAPH: [one.source for one in kept]}
    for name, texts in found.loads.items():
        table[name] = [texts[row] for row in rows]
    notches, tendons = found.robot.number_of_notches, found.robot.number_of_tendons
    for column in columns.measured_columns(notches, tendons, ()):
        if column.quantity == "notch_angle":
            (notch,) = column.index
            table[column.name] = [math.degrees(one.notch_angle[notch]) for one in kept]
            table[column.deviation] = [
                math.degrees(one.notch_angle_deviation[notch]) for one in kept
            ]
    return table


def measured_document(found: MeasuredPhotographs) -> dict[str, Any]:
    """Return the JSON document: all photographs, the refused with their reasons."""
    photographs = []
    for number, one in enumerate(found.photographs):
        loads = {name: texts[number] for name, texts in found.loads.items()}
        photographs.append({**_entry(one), "loads": loads})
    return {**document_head(found.robot), "photographs": photographs}


def _entry(one: MeasuredPhotograph) -> dict[str, Any]:
    entry: dict[str, Any] = {"photograph": one.source, "measured": one.measured}
    if not one.measured:
        return {**entry, "reason": one.reason}
    return {
        **entry,
        "notch_angle_deg": np.degrees(one.notch_angle),
        "notch_angle_sd_deg": np.degrees(one.notch_angle_deviation),
        "tip_position_mm": one.tip_position,
        "tip_position_sd_mm": one.tip_deviation,
        "scale_px_mm": one.scale,
        "roll_deg": math.degrees(one.roll),
        "tilt_deg": math.degrees(one.tilt),
        "edge_noise_px": one.noise,
        "outline_found": one.found,
    }
