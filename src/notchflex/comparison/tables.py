"""A comparison as a JSON document and as the columns of a CSV."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from notchflex.comparison.comparison import Comparison
from notchflex.fit.assessment.errors_of_parts import edge
from notchflex.results.files.json import document_head
from notchflex.results.quantities.registry import AXES, DEGREES, QUANTITIES


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as a document for `notchflex.results.files.json.write_json`.

    Args:
        comparison: The comparison.

    Returns:
        `rmse_deg.notches`, `rmse_deg.total`, `tip_rmse_mm`, `points`, `negative_forces`,
        `from_rest` with `order` (how the order of the rows was understood), `diagnosis`, the
        columns that were ignored, and every row, measured beside modelled. None stands for what
        was not measured.
    """
    measured = comparison.measured
    failed = [reason for reason in comparison.reason if reason]
    points = [
        {
            "trial": measured.pull[index],
            "measured": {
                "tendon_tension_N": measured.measured_tension[index],
                "tendon_stroke_mm": measured.load.stroke[index],
                "notch_angle_deg": comparison.measured_notch_angle[index] * DEGREES,
                "total_angle_deg": comparison.measured_total_angle[index] * DEGREES,
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
        "from_rest": measured.from_rest,
        "order": measured.order,
        **errors_document(comparison),
        "negative_forces": measured.negative_forces,
        "diagnosis": list(comparison.diagnosis),
        "ignored_columns": measured.ignored,
        "converged": not failed,
        "reason": failed[0] if failed else "",
        "rows": points,
    }


def errors_document(comparison: Comparison) -> dict[str, Any]:
    """Return the errors of a comparison: `rmse_deg`, `tip_rmse_mm` and the number of `points`.

    `rmse_others` holds those of the tip's rotation, of tensions at the tip and of points on the
    axis, where they were measured. For the kinematic model also `stroke_from` ("measurement", or
    "model" where only forces were measured) and `stroke_lost_mm`, what closed notches could not
    take, by row.
    """
    lost: dict[str, Any] = {}
    if comparison.stroke_lost is not None:
        source = "model" if takes_stroke_of_model(comparison) else "measurement"
        lost = {"stroke_from": source, "stroke_lost_mm": comparison.stroke_lost}
    notches = comparison.rmse_notches * DEGREES
    seen = "notch_angle" in comparison.measured.observed
    return {
        "rmse_deg": {
            "notches": notches if seen else None,
            "total": comparison.rmse_total * DEGREES,
        },
        "tip_rmse_mm": comparison.tip_rmse,
        "rmse_others": {
            f"{name}_{edge(name)[1]}": value * edge(name)[2]
            for name, value in comparison.others.items()
        },
        "points": comparison.points,
        **lost,
    }


def comparison_columns(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as columns for a CSV: header to P values, at the edge units."""
    measured = comparison.measured
    columns: dict[str, Any] = {"trial": measured.pull}
    tendons = comparison.robot.number_of_tendons
    for tendon in range(tendons):
        number = "" if tendons == 1 else tendon + 1
        for name, given in (
            ("tension", measured.measured_tension),
            ("stroke", measured.load.stroke),
        ):
            header = QUANTITIES[name].header(tendon=number)
            if not np.isnan(given[:, tendon]).all():
                columns[header] = given[:, tendon]
            columns[f"{header}_model"] = getattr(comparison, name)[:, tendon]
    for header, seen, model in _pairs(comparison):
        if not np.isnan(seen).all():
            columns[header] = seen
        columns[f"{header}_model"] = model
    columns["tip_error_mm"] = comparison.tip_error
    columns["converged"] = comparison.converged
    columns["reason"] = comparison.reason
    return columns


def _pairs(
    comparison: Comparison,
) -> Iterator[tuple[str, Float[np.ndarray, " p"], Float[np.ndarray, " p"]]]:
    """Yield header, measured and modelled column of every notch, the total and the tip."""
    for notch in range(comparison.robot.number_of_notches):
        header = QUANTITIES["notch_angle"].header(notch=notch + 1)
        pair = comparison.measured_notch_angle[:, notch], comparison.notch_angle[:, notch]
        yield header, pair[0] * DEGREES, pair[1] * DEGREES
    pair = comparison.measured_total_angle, comparison.total_angle
    yield QUANTITIES["total_angle"].header(), pair[0] * DEGREES, pair[1] * DEGREES
    for index, axis in enumerate(AXES):
        header = QUANTITIES["tip_position"].header(axis=axis)
        yield header, comparison.measured_tip[:, index], comparison.tip[:, index]


def takes_stroke_of_model(kinematics: Comparison) -> bool:
    """Tell whether the kinematic model had to take the stroke of the full model in some row."""
    return bool(np.isnan(kinematics.measured.load.stroke[:, 0]).any())


def summary(comparison: Comparison) -> str:
    """Return what a comparison found as a few lines of text."""
    measured = comparison.measured
    way = "each from rest" if measured.from_rest else "each pull one path"
    notches = ", ".join(_number(one * DEGREES) for one in comparison.rmse_notches)
    lines = [
        f"{comparison.robot.name} beside {measured.source}",
        f"{comparison.points} of {len(measured)} rows solved, {way}",
        "root-mean-square errors:",
        f"  notches      {notches} deg",
        f"  total angle  {_number(comparison.rmse_total * DEGREES)} deg",
        f"  tip          {_number(comparison.tip_rmse)} mm",
    ]
    for name, value in comparison.others.items():
        title, unit, scale = edge(name)
        lines.append(f"  {title}  {_number(value * scale)} {unit}")
    return "\n".join([*lines, *comparison.diagnosis])


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"
