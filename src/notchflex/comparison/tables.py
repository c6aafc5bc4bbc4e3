"""A comparison as a JSON document, as columns of a CSV, and as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex.comparison.comparison import Comparison
from notchflex.fit.assessment.errors_of_parts import edge
from notchflex.support import AXES, DEGREES, QUANTITIES, document_head


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as a document for `notchflex.support.write_json`.

    Args:
        comparison: The comparison.

    Returns:
        `rmse_deg.notches`, `rmse_deg.total`, `tip_rmse_mm`, `points`, `negative_forces`,
        `from_rest` with `order` (how the order of the rows was understood), `diagnosis`, the
        columns that were ignored, and every row, measured beside modelled. None marks what
        was not measured.
    """
    measured = comparison.measured
    failed = [reason for reason in comparison.reason if reason]
    columns = {
        "tendon_tension_N": (measured.measured_tension, comparison.tension),
        "tendon_stroke_mm": (measured.load.stroke, comparison.stroke),
        QUANTITIES[comparison.angle].key: _degrees(
            comparison.measured_notch_angle, comparison.notch_angle
        ),
        "total_angle_deg": _degrees(comparison.measured_total_angle, comparison.total_angle),
        "tip_position_mm": (comparison.measured_tip, comparison.tip),
    }
    rows = [
        {
            "trial": measured.pull[row],
            "measured": {key: values[row] for key, (values, _) in columns.items()},
            "model": {
                **{key: values[row] for key, (_, values) in columns.items()},
                "converged": comparison.converged[row],
                "reason": comparison.reason[row],
            },
        }
        for row in range(len(measured))
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
        "rows": rows,
    }


def errors_document(comparison: Comparison) -> dict[str, Any]:
    """Return the errors of a comparison: `rmse_deg`, `tip_rmse_mm` and the number of `points`.

    `rmse_others` holds those of the tip's rotation, of tensions at the tip and of points on the
    axis, if they were measured. For the kinematic model also `stroke_from` ("measurement", or
    "model" if some row has only forces) and `stroke_lost_mm`, which closed notches could not take,
    by row.
    """
    lost: dict[str, Any] = {}
    if comparison.stroke_lost is not None:
        source = "model" if takes_stroke_of_model(comparison) else "measurement"
        lost = {"stroke_from": source, "stroke_lost_mm": comparison.stroke_lost}
    measured = comparison.angle in comparison.measured.observed
    return {
        "rmse_deg": {
            "notches": comparison.rmse_notches * DEGREES if measured else None,
            "total": comparison.rmse_total * DEGREES,
        },
        "tip_rmse_mm": comparison.rmse_tip,
        "rmse_others": {
            f"{name}_{edge(name)[1]}": value * edge(name)[2]
            for name, value in comparison.others.items()
        },
        "points": comparison.points,
        **lost,
    }


def comparison_columns(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as columns for a CSV: header to P values, in deg, mm and N."""
    robot, measured = comparison.robot, comparison.measured
    tendons = robot.number_of_tendons
    pairs: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for tendon in range(tendons):
        number = "" if tendons == 1 else tendon + 1
        for name, values, model in (
            ("tension", measured.measured_tension, comparison.tension),
            ("stroke", measured.load.stroke, comparison.stroke),
        ):
            header = QUANTITIES[name].header(tendon=number)
            pairs[header] = values[:, tendon], model[:, tendon]
    angles = _degrees(comparison.measured_notch_angle, comparison.notch_angle)
    for notch in range(robot.number_of_notches):
        header = QUANTITIES[comparison.angle].header(notch=notch + 1)
        pairs[header] = angles[0][:, notch], angles[1][:, notch]
    total = _degrees(comparison.measured_total_angle, comparison.total_angle)
    pairs[QUANTITIES["total_angle"].header()] = total
    for index, axis in enumerate(AXES):
        header = QUANTITIES["tip_position"].header(axis=axis)
        pairs[header] = comparison.measured_tip[:, index], comparison.tip[:, index]
    columns: dict[str, Any] = {"trial": measured.pull}
    for header, (values, model) in pairs.items():
        if not np.isnan(values).all():
            columns[header] = values
        columns[f"{header}_model"] = model
    columns["tip_error_mm"] = comparison.tip_error
    columns["converged"] = comparison.converged
    columns["reason"] = comparison.reason
    return columns


def takes_stroke_of_model(kinematics: Comparison) -> bool:
    """Return whether the kinematic model takes the stroke of the full model in some row."""
    return bool(np.isnan(kinematics.measured.load.stroke[:, 0]).any())


def summary(comparison: Comparison) -> str:
    """Return the errors of a comparison as a few lines of text."""
    measured = comparison.measured
    way = "each from rest" if measured.from_rest else "each pull one path"
    notches = ", ".join(_number(one * DEGREES) for one in comparison.rmse_notches)
    lines = [
        f"{comparison.robot.name} beside {measured.source}",
        f"{comparison.points} of {len(measured)} rows solved, {way}",
        "root-mean-square errors:",
        f"  notches      {notches} deg",
        f"  total angle  {_number(comparison.rmse_total * DEGREES)} deg",
        f"  tip          {_number(comparison.rmse_tip)} mm",
    ]
    for name, value in comparison.others.items():
        title, unit, scale = edge(name)
        lines.append(f"  {title}  {_number(value * scale)} {unit}")
    return "\n".join([*lines, *comparison.diagnosis])


def _degrees(measured: np.ndarray, model: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return measured * DEGREES, model * DEGREES


def _number(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"
