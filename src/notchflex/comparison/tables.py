"""A comparison as a JSON document and as the columns of a CSV."""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex.comparison.comparison import Comparison
from notchflex.results.json import document_head
from notchflex.results.quantities import AXES, DEGREES, QUANTITIES


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as a document for `notchflex.results.json.write_json`.

    Args:
        comparison: The comparison.

    Returns:
        `rmse_deg.notches`, `rmse_deg.total`, `tip_rmse_mm`, `points`, `negative_forces`, the
        columns that were ignored, and every point, measured beside modelled.
    """
    measured = comparison.measured
    failed = [reason for reason in comparison.reason if reason]
    points = [
        {
            "trial": measured.trial[index],
            "measured": {
                "tendon_tension_N": measured.tension[index],
                "tendon_stroke_mm": measured.stroke[index],
                "notch_angle_deg": measured.notch_angle[index] * DEGREES,
                "total_angle_deg": measured.total_angle[index] * DEGREES,
                "tip_position_mm": comparison.measured_tip[index],
            },
            "model": {
                "tendon_tension_N": comparison.tension[index],
                "tendon_stroke_mm": comparison.stroke[index],
                "notch_angle_deg": comparison.notch_angle[index] * DEGREES,
                "total_angle_deg": comparison.total_angle[index] * DEGREES,
                "tip_position_mm": comparison.tip[index],
                "converged": comparison.converged[index],
                "reason": comparison.reason[index],
            },
        }
        for index in range(len(measured))
    ]
    return {
        **document_head(comparison.robot),
        "data": measured.source,
        "from_rest": comparison.from_rest,
        **errors_document(comparison),
        "negative_forces": measured.negative_forces,
        "ignored_columns": measured.ignored,
        "converged": not failed,
        "reason": failed[0] if failed else "",
        "rows": points,
    }


def errors_document(comparison: Comparison) -> dict[str, Any]:
    """Return the errors of a comparison: `rmse_deg`, `tip_rmse_mm` and the number of `points`.

    For the kinematic model also `stroke_lost_mm`, what closed notches could not take, by point.
    """
    lost = {} if comparison.stroke_lost is None else {"stroke_lost_mm": comparison.stroke_lost}
    return {
        "rmse_deg": {
            "notches": comparison.rmse_notches * DEGREES,
            "total": comparison.rmse_total * DEGREES,
        },
        "tip_rmse_mm": comparison.tip_rmse,
        "points": comparison.points,
        **lost,
    }


def comparison_columns(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as columns for a CSV: header to P values, at the edge units."""
    measured = comparison.measured
    columns: dict[str, Any] = {"trial": measured.trial}
    tendons = comparison.robot.number_of_tendons
    for tendon in range(tendons):
        number = "" if tendons == 1 else tendon + 1
        for name, given in (("tension", measured.tension), ("stroke", measured.stroke)):
            header = QUANTITIES[name].header(tendon=number)
            if not np.isnan(given[:, tendon]).all():
                columns[header] = given[:, tendon]
            columns[f"{header}_model"] = getattr(comparison, name)[:, tendon]
    for notch in range(comparison.robot.number_of_notches):
        header = QUANTITIES["notch_angle"].header(notch=notch + 1)
        columns[header] = measured.notch_angle[:, notch] * DEGREES
        columns[f"{header}_model"] = comparison.notch_angle[:, notch] * DEGREES
    header = QUANTITIES["total_angle"].header()
    columns[header] = measured.total_angle * DEGREES
    columns[f"{header}_model"] = comparison.total_angle * DEGREES
    for index, axis in enumerate(AXES):
        header = QUANTITIES["tip_position"].header(axis=axis)
        columns[header] = comparison.measured_tip[:, index]
        columns[f"{header}_model"] = comparison.tip[:, index]
    columns["tip_error_mm"] = comparison.tip_error
    columns["converged"] = comparison.converged
    columns["reason"] = comparison.reason
    return columns
