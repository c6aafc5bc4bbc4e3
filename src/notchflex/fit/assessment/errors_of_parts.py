"""Errors of the model part by part, beside how well the measurements repeat."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.measurements.measurements import OBSERVED, Measurements
from notchflex.fit.measurements.repeats import repeats_of_each
from notchflex.support import DEGREES, QUANTITIES

# Quantities that are not registered as results: title, unit, and the factor to it.
_MEASURED_ONLY = {
    "total_edge_angle": ("total edge angle", QUANTITIES["total_angle"].unit, DEGREES),
    "tip_rotation": ("tip rotation", QUANTITIES["total_angle"].unit, DEGREES),
    "tip_tension": ("tension at the tip", QUANTITIES["span_tension"].unit, 1.0),
    "axis_points": ("points on the axis", QUANTITIES["tip_position"].unit, 1.0),
}
# Quantities whose components make up one distance, or one angle.
_VECTORS = ("tip_position", "tip_rotation", "axis_points")


@dataclass(frozen=True)
class PartError:
    """The error of one measured part of one robot.

    Attributes:
        robot: Label of the robot.
        quantity: The quantity, by the names of `Measurements.observed`.
        part: Notch or tendon, from 1; 0 for a quantity of one part.
        title: Title of the part.
        unit: Unit of the numbers below.
        error: Root-mean-square difference of model and measurement; of points and of the tip's
            orientation that of the distance or angle between the two.
        repeats: Standard deviation between repeats, NaN if nothing was repeated.
        count: Number of measured numbers.
    """

    robot: str
    quantity: str
    part: int
    title: str
    unit: str
    error: float
    repeats: float
    count: int


def edge(quantity: str) -> tuple[str, str, float]:
    """Return title and unit of a measured quantity, and the factor from inner units to this.

    Example:
        >>> edge("tip_position")
        ('tip position', 'mm', 1.0)
    """
    if quantity in _MEASURED_ONLY:
        return _MEASURED_ONLY[quantity]
    row = QUANTITIES[quantity]
    return row.title, row.unit, row.scale


def part_title(quantity: str, part: int) -> str:
    """Return the title of a part (from 1; 0 if there is only one) of a quantity.

    Example:
        >>> part_title("notch_angle", 2), part_title("total_angle", 0)
        ('notch 2', 'total bending angle')
    """
    if quantity in ("notch_angle", "edge_angle"):
        return f"notch {part}{', edges' if quantity == 'edge_angle' else ''}"
    title = edge(quantity)[0]
    return f"{title}, tendon {part}" if part else title


def errors_of_parts(found: Calibration) -> tuple[PartError, ...]:
    """Return errors of every notch, the total angle, the tip and whatever else was measured.

    Args:
        found: The fit.

    Returns:
        Robot by robot, in the order of `Measurements.observed`.
    """
    return tuple(one for label in found.given for one in _of_robot(found, label))


def _of_robot(calibration: Calibration, label: str) -> Iterator[PartError]:
    residuals = calibration.residuals
    of_robot = residuals.robot == list(calibration.given).index(label)
    measured = calibration.problem.samples.of_robot(label)
    for number, quantity in enumerate(OBSERVED):
        mine = of_robot & (residuals.quantity == number)
        if not mine.any():
            continue
        _, unit, scale = edge(quantity)
        floor = _floor([one for one in measured if quantity in one.observed], quantity) * scale
        parts = residuals.part[mine] + 1
        if quantity in (*_VECTORS, "total_angle", "total_edge_angle"):
            parts = np.zeros(len(parts), int)
        # Three components are one point, or one rotation of a row.
        single = residuals.row if quantity == "tip_rotation" else residuals.point
        points = np.stack([residuals.sample[mine], single[mine]])
        for part in np.unique(parts).tolist():
            count = len(np.unique(points[:, parts == part], axis=1).T)
            values = residuals.values[mine][parts == part] * scale
            error = float(np.sqrt(np.sum(values**2) / count))
            title, repeats = part_title(quantity, part), float(floor[max(part - 1, 0)])
            yield PartError(label, quantity, part, title, unit, error, repeats, count)


def _floor(measured: Sequence[Measurements], quantity: str) -> NDArray[np.float64]:
    """Standard deviation between repeats of every part, pooled over the files of a robot."""
    total, rows = np.zeros(1), 0
    for one in measured:
        each = repeats_of_each(one)[quantity]
        if quantity in _VECTORS:
            each = np.sqrt(np.mean(np.sum(each**2, axis=-1)))
        if np.isfinite(each).all():
            total = total + len(one) * np.atleast_1d(each) ** 2
            rows += len(one)
    if not rows:
        return np.full(max(1, *(one.observed[quantity][0].size for one in measured)), np.nan)
    return np.sqrt(total / rows)
