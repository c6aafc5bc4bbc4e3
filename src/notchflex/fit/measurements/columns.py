"""The columns of a file of measurements: their names, and where their numbers belong."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from notchflex.results.quantities.registry import AXES, QUANTITIES

PULL = ("pull", "trial")
FROM_REST = "from_rest"
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
    r"(notch)_(\d+)_(?:sd_)?deg"
    r"|(tendon)_(\d+)_(?:force_N|displacement_mm|tip_force_(?:sd_)?N)"
    r"|(body)_(\d+)_(?:(?:force_[xyz]_N)|(?:moment_[xyz]_Nmm)|(?:point_[xyz]_mm)|following)"
)


@dataclass(frozen=True)
class Column:
    """One column of what was measured.

    Attributes:
        name: Its name, ending in `_` and the unit.
        quantity: What it is a part of.
        index: Which part: index behind the axis of the rows.
    """

    name: str
    quantity: str
    index: tuple[int, ...]

    @property
    def deviation(self) -> str:
        """Name of the column of its standard deviation.

        Example:
            >>> Column("notch_1_deg", "notch_angle", (0,)).deviation
            'notch_1_sd_deg'
        """
        head, _, unit = self.name.rpartition("_")
        return f"{head}_sd_{unit}"

    @property
    def in_degrees(self) -> bool:
        """Whether it is an angle, which the file has in degrees."""
        return self.name.endswith("_deg")


def columns(notches: int, tendons: int, axis_at: Sequence[float]) -> Iterator[Column]:
    """Go through all columns that measurements of a robot may have.

    Args:
        notches: Number of its notches.
        tendons: Number of its tendons; the only one goes without its number.
        axis_at: Where the points on the axis lie, mm.
    """
    for notch in range(notches):
        name = QUANTITIES["notch_angle"].header(notch=notch + 1)
        yield Column(name, "notch_angle", (notch,))
    yield Column(QUANTITIES["total_angle"].header(), "total_angle", ())
    for axis, letter in enumerate(AXES):
        name = QUANTITIES["tip_position"].header(axis=letter)
        yield Column(name, "tip_position", (axis,))
    for axis, letter in enumerate(AXES):
        yield Column(f"tip_r{letter}_deg", "tip_rotation", (axis,))
    for tendon in range(tendons):
        number = "" if tendons == 1 else f"_{tendon + 1}"
        yield Column(f"tendon{number}_tip_force_N", "tip_tension", (tendon,))
    for point, at in enumerate(axis_at):
        for axis, letter in enumerate(AXES):
            yield Column(f"axis_{_plain(at)}_{letter}_mm", "axis_points", (point, axis))


def numbered(column: str) -> tuple[str, int] | None:
    """Tell the part that a column is numbered after; None for one that is not.

    Example:
        >>> numbered("notch_12_sd_deg"), numbered("total_deg")
        (('notch', 12), None)
    """
    found = _NUMBERED.fullmatch(column)
    if found is None:
        return None
    kind, number = (text for text in found.groups() if text is not None)
    return kind, int(number)


def places_on_axis(header: Iterable[str]) -> dict[str, float]:
    """Find the places of points on the axis, as their columns write them and as numbers, rising."""
    found = (_AXIS.fullmatch(column) for column in header)
    places = {one[1]: float(one[1]) for one in found if one is not None}
    return dict(sorted(places.items(), key=lambda item: item[1]))


def _plain(number: float) -> str:
    """A number without an exponent, as short as it can be."""
    text = f"{number:.17g}"
    for digits in range(1, 17):
        short = f"{number:.{digits}g}"
        if "e" not in short and float(short) == number:
            return short
    return text
