"""How far the model is from what was measured, part by part, beside how well that repeats."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.measurements.measurements import OBSERVED
from notchflex.fit.measurements.repeats import repeats_of_each
from notchflex.fit.model.residuals import Residuals
from notchflex.fit.model.samples import Sample
from notchflex.results.quantities.registry import DEGREES, QUANTITIES

# What has no row of its own in the table of quantities: title, unit, and the factor to it.
_MEASURED_ONLY = {
    "tip_rotation": ("tip rotation", QUANTITIES["total_angle"].unit, DEGREES),
    "tip_tension": ("tension at the tip", QUANTITIES["span_tension"].unit, 1.0),
    "axis_points": ("points on the axis", QUANTITIES["tip_position"].unit, 1.0),
}
# Coordinates of these are one distance, or one angle.
VECTORS = ("tip_position", "tip_rotation", "axis_points")


@dataclass(frozen=True)
class PartError:
    """The error of one measured part of one robot.

    Attributes:
        robot: Label of the robot.
        quantity: What was measured, by the names of `Measurements.observed`.
        part: Which notch or tendon, from 1; 0 for a quantity that has one part.
        title: What to call it.
        unit: Unit of the numbers below.
        error: Root-mean-square difference of model and measurement; of points and of the tip's
            orientation that of the distance or angle between the two.
        repeats: Standard deviation between repeats of the same, NaN where nothing was repeated.
        count: How many numbers were measured.
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
    """Title and unit of a measured quantity, and the factor that takes its numbers to the unit.

    Example:
        >>> edge("tip_position")
        ('tip position', 'mm', 1.0)
    """
    if quantity in _MEASURED_ONLY:
        return _MEASURED_ONLY[quantity]
    row = QUANTITIES[quantity]
    return row.title, row.unit, row.scale


def part_title(quantity: str, part: int) -> str:
    """What to call a part of a quantity; `part` from 1, 0 where it has one.

    Example:
        >>> part_title("notch_angle", 2), part_title("total_angle", 0)
        ('notch 2', 'total bending angle')
    """
    if quantity == "notch_angle":
        return f"notch {part}"
    title = edge(quantity)[0]
    return f"{title}, tendon {part}" if part else title


def errors_of_parts(found: Calibration) -> tuple[PartError, ...]:
    """Errors of every notch, the total angle, the tip and whatever else was measured.

    Args:
        found: The fit.

    Returns:
        Robot by robot, in the order of `Measurements.observed`.
    """
    return tuple(one for label in found.given for one in _of_robot(found, label))


def parts_of(quantity: str, part: NDArray[np.intp]) -> NDArray[np.intp]:
    """Part of every number, as `PartError.part` counts, from its component as residuals have it."""
    if quantity in VECTORS or quantity == "total_angle":
        return np.zeros(len(part), int)
    return np.asarray(part, int) + 1


def _of_robot(found: Calibration, label: str) -> Iterator[PartError]:
    residuals = found.residuals
    own = residuals.robot == list(found.given).index(label)
    samples = [one for one in found.problem.samples.every if one.label == label]
    for number, quantity in enumerate(OBSERVED):
        there = own & (residuals.quantity == number)
        if not there.any():
            continue
        _, unit, scale = edge(quantity)
        floor = _floor(samples, quantity) * scale
        values = residuals.values[there] * scale
        part = parts_of(quantity, residuals.part[there])
        points = _points(residuals, there, quantity)
        for one in np.unique(part):
            mine = part == one
            count = len(np.unique(points[mine]))
            error = float(np.sqrt(np.sum(values[mine] ** 2) / count))
            repeats = float(floor[one - 1 if one else 0])
            title = part_title(quantity, int(one))
            yield PartError(label, quantity, int(one), title, unit, error, repeats, count)


def _points(residuals: Residuals, there: NDArray[np.bool_], quantity: str) -> NDArray[np.intp]:
    """What the numbers are coordinates of: one value for all that make up a distance or angle."""
    if quantity != "tip_rotation":
        return residuals.point[there]
    rows = np.stack([residuals.sample[there], residuals.row[there]])
    return np.unique(rows, axis=1, return_inverse=True)[1].ravel()


def _floor(samples: Sequence[Sample], quantity: str) -> NDArray[np.float64]:
    """Standard deviation between repeats of every part, pooled over the files of a robot."""
    total, rows = 0.0, 0
    for sample in samples:
        if quantity not in sample.measured.observed:
            continue
        each = np.asarray(repeats_of_each(sample.measured)[quantity], float)
        if quantity in VECTORS:
            each = np.sqrt(np.mean(np.sum(each**2, axis=-1)))
        each = np.atleast_1d(each)
        if np.isfinite(each).all():
            total = total + len(sample.measured) * each**2
            rows += len(sample.measured)
    if not rows:
        parts = max(
            sample.measured.observed[quantity][0].size
            for sample in samples
            if quantity in sample.measured.observed
        )
        return np.full(max(parts, 1), np.nan)
    return np.sqrt(np.asarray(total) / rows)


__all__ = ["VECTORS", "PartError", "edge", "errors_of_parts", "part_title", "parts_of"]
