"""Options of the exported files, as values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Literal, get_args

from notchflex.errors import InputError

Seam = Literal["past", "split"]
AngleUnit = Literal["mm", "deg"]
DxfVersion = Literal["R2000", "R12"]

_LONGEST = 1e4  # mm; longer than any tube


def _check_number(name: str, value: object, low: float, high: float, unit: str = "mm") -> None:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError.WRONG_TYPE(f"{name} must be a number; got {value!r}.")
    value = float(value)
    if not math.isfinite(value):
        raise InputError.NOT_FINITE(f"{name} must be finite; got {value}.")
    if not low <= value <= high:
        raise InputError.OUT_OF_RANGE(
            f"{name} must be from {low:g} to {high:g} {unit}; got {value:g} {unit}."
        )


def _check_word(name: str, value: object, kind: object) -> None:
    words = get_args(kind)
    if value not in words:
        raise InputError.UNKNOWN_NAME(f"{name} must be one of {', '.join(words)}; got {value!r}.")


@dataclass(frozen=True)
class PatternOptions:
    """Options of flat patterns (DXF, SVG, dimensioned PDF sheet).

    Args:
        kerf: Width of the beam [mm]. With 0 the pattern is the nominal geometry, and the shop
            compensates; otherwise the path runs half a kerf into the waste. The drawing says which.
        corner_radius: Radius of the sharp corners of the cuts [mm]; 0 or at least half the kerf.
        polishing: Wall that electropolishing removes from each edge after cutting [mm]; the path
            runs this much farther into the waste.
        seam: Cuts that cross the seam run `"past"` it, or are `"split"` into two closed outlines.
        seam_deg: Side of the tube on which it is unrolled [deg].
        two_axis: Whether the machine has a linear and a rotary axis only, so that its beam always
            points to the tube axis; cuts with other walls are then refused.
        y_unit: Unit of the coordinate round the tube: `"mm"` on the outer surface, or `"deg"`.
        shank: Uncut tube on the base side, by which the robot is held [mm]; the cut-off runs at
            its end.
        chord: Largest distance of a curve from its chords [mm].
        dxf_version: `"R2000"`, or `"R12"` for old programs.

    Raises:
        InputError: A value is not allowed.

    Example:
        >>> PatternOptions(kerf=0.025).inside
        0.0125
    """

    kerf: float = 0.0
    corner_radius: float = 0.0
    polishing: float = 0.0
    seam: Seam = "past"
    seam_deg: float = 180.0
    two_axis: bool = False
    y_unit: AngleUnit = "mm"
    shank: float = 10.0
    chord: float = 0.001
    dxf_version: DxfVersion = "R2000"

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("kerf", "corner_radius", "polishing"):
            _check_number(name, getattr(self, name), 0.0, 10.0)
        _check_number("seam_deg", self.seam_deg, -360.0, 360.0, "deg")
        _check_number("shank", self.shank, 0.0, _LONGEST)
        _check_number("chord", self.chord, 1e-5, 1.0)
        if self.two_axis not in (True, False):
            raise InputError.WRONG_TYPE(f"two_axis must be True or False; got {self.two_axis!r}.")
        _check_word("seam", self.seam, Seam)
        _check_word("y_unit", self.y_unit, AngleUnit)
        _check_word("dxf_version", self.dxf_version, DxfVersion)
        if 0.0 < self.corner_radius < self.inside:
            raise InputError.CONFLICT(
                f"corner_radius is {self.corner_radius:g} mm; a beam whose path runs "
                f"{self.inside:g} mm inside the edges cuts no smaller radius than that."
            )

    @property
    def inside(self) -> float:
        """Distance of the path from the edges of the cuts, into the waste [mm]."""
        return 0.5 * self.kerf + self.polishing


@dataclass(frozen=True)
class SolidOptions:
    """Options of solids (STL, STEP).

    Args:
        channels: Diameter of the channels of the tendons, drilled through the wall along the whole
            tube [mm]; 0 for none.
        shank: Uncut tube on the base side [mm].
        chord: Largest distance of the flat sides of an STL from the round surface [mm].

    Raises:
        InputError: A value is not allowed.

    Example:
        >>> SolidOptions(shank=2.0).channels
        0.0
    """

    channels: float = 0.0
    shank: float = 10.0
    chord: float = 0.001

    def __post_init__(self) -> None:
        """Check the values."""
        _check_number("channels", self.channels, 0.0, _LONGEST)
        _check_number("shank", self.shank, 0.0, _LONGEST)
        _check_number("chord", self.chord, 1e-5, 1.0)
