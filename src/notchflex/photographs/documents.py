"""The JSON document of measured photographs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from notchflex.photographs.cut.measure_cut import MeasuredCut
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.support import document_head


def measured_document(measured: MeasuredPhotographs) -> dict[str, Any]:
    """Return the JSON document: all photographs, the refused with their reasons."""
    photographs = []
    for number, one in enumerate(measured.photographs):
        loads = {name: texts[number] for name, texts in measured.loads.items()}
        photographs.append({**_entry(one), "loads": loads})
    return {**document_head(measured.robot), "photographs": photographs}


def cut_document(cut: MeasuredCut) -> dict[str, Any]:
    """Return the JSON document of notches that were measured: why not, if they were refused."""
    photographs = [
        {"photograph": one.source, "turn_deg": math.degrees(turn), **_view(one)}
        for one, turn in zip(cut.photographs, cut.turns, strict=True)
    ]
    document: dict[str, Any] = {"measured": cut.measured, "photographs": photographs}
    document |= cut.columns() if cut.measured else {"reason": cut.reason}
    return {**document_head(cut.robot), **document}


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
        **_view(one),
    }


def _view(one: MeasuredPhotograph) -> dict[str, Any]:
    return {
        "scale_px_mm": one.scale,
        "roll_deg": math.degrees(one.roll),
        "tilt_deg": math.degrees(one.tilt),
        "edge_noise_px": one.noise,
        "outline_found": one.found,
    }
