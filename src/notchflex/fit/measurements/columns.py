"""The columns of a file of measurements: their names, and where their numbers belong."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from notchflex.support import AXES, QUANTITIES

PULL = ("pull", "trial")
FROM_REST = "from_rest"
DIRECTION = "direction"
FOLLOWING = "following"
TIP_MASS = "tip_mass_g"

# notation: {a} is an axis, x, y or z
TIP_VECTORS = {
    "tip_force": "tip_force_{a}_N",
    "tip_moment": "tip_moment_{a}_Nmm",
    "tip_point": "tip_point_{a}_mm",
    "gravity": "gravity_{a}_m_s2",
}
"""Argument of a load to its three columns."""
BODY_VECTORS = {
    "force": "body_{b}_force_{a}_N",
    "moment": "body_{b}_moment_{a}_Nmm",
    "point": "body_{b}_point_{a}_mm",
}
"""Argument of a force on body b to its three columns."""
BODY_FOLLOWING = "body_{b}_following"
BASE_TURN = "base_r{a}_deg"

_AXIS = re.compile(r"axis_(\d+(?:\.\d+)?)_([xyz])_(?:sd_)?mm")
_NUMBERED = re.compile(
    r"notch_\d+_(?:edge_)?(?:sd_)?deg"
    r"|tendon_\d+_(?:force_N|displacement_mm|tip_force_(?:sd_)?N)"
    r"|body_\d+_(?:force_[xyz]_N|moment_[xyz]_Nmm|point_[xyz]_mm|following)"
)


@dataclass(frozen=True)
class MeasuredColumn:
    """One column: its name, ending in the unit, its quantity and the index of its component."""

    name: str
    quantity: str
    index: tuple[int, ...]

    @property
    def deviation(self) -> str:
        """Name of the column of its standard deviation.

        Example:
            >>> MeasuredColumn("notch_1_deg", "notch_angle", (0,)).deviation
            'notch_1_sd_deg'
        """
        head, _, unit = self.name.rpartition("_")
        return f"{head}_sd_{unit}"

    @property
    def in_degrees(self) -> bool:
        """Whether it is an angle, which the file has in degrees."""
        return self.name.endswith("_deg")


def measured_columns(
    notches: int, tendons: int, axis_at: Sequence[float]
) -> Iterator[MeasuredColumn]:
    """Yield all columns that measurements of a robot may have; a single tendon has no number."""
    for quantity in ("notch_angle", "edge_angle"):
        for notch in range(notches):
            name = QUANTITIES[quantity].header(notch=notch + 1)
            yield MeasuredColumn(name, quantity, (notch,))
    yield MeasuredColumn(QUANTITIES["total_angle"].header(), "total_angle", ())
    yield MeasuredColumn("total_edge_deg", "total_edge_angle", ())
    for axis, letter in enumerate(AXES):
        name = QUANTITIES["tip_position"].header(axis=letter)
        yield MeasuredColumn(name, "tip_position", (axis,))
    for axis, letter in enumerate(AXES):
        yield MeasuredColumn(f"tip_r{letter}_deg", "tip_rotation", (axis,))
    for tendon in range(tendons):
        number = "" if tendons == 1 else f"_{tendon + 1}"
        yield MeasuredColumn(f"tendon{number}_tip_force_N", "tip_tension", (tendon,))
    for point, distance in enumerate(axis_at):
        written = np.format_float_positional(distance, trim="-")
        for axis, letter in enumerate(AXES):
            yield MeasuredColumn(f"axis_{written}_{letter}_mm", "axis_points", (point, axis))


def numbered(column: str) -> tuple[str, int] | None:
    """Return the part that a column is numbered after; None if it is not numbered.

    Example:
        >>> numbered("notch_12_sd_deg"), numbered("total_deg")
        (('notch', 12), None)
    """
    if _NUMBERED.fullmatch(column) is None:
        return None
    part, number, *_ = column.split("_")
    return part, int(number)


def places_on_axis(header: Iterable[str]) -> dict[str, float]:
    """Return the points on the axis, rising: as their columns write them, and as numbers, mm."""
    matches = (_AXIS.fullmatch(column) for column in header)
    written = sorted((float(match[1]), match[1]) for match in matches if match is not None)
    return {text: distance for distance, text in written}
