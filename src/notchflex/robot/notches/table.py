"""A flexure that was measured or computed elsewhere: its moment over its angle, or a stiffness."""

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from notchflex.robot.cuts import CutLayout, whole_gap
from notchflex.robot.kinds import Material, Notch, Tube
from notchflex.robot.part import Float, FloatOrInf, Problems, part, positive, quantity

COLUMNS = ("angle_deg", "moment_Nmm")
"""Columns of a file of the curve, and the keys that hold it."""


@part
class TableNotch(Notch):
    """A flexure given by numbers: a measured joint, another cut, a result of finite elements.

    It is a short rod along its neutral axis with the same strains all along. The material counts
    for its mass alone, that of the uncut tube; its strain is not known (NaN).

    Args:
        length: Length along the neutral axis, and of the gap in the tube [mm].
        angle_deg: Angles of bending, beyond the free shape [deg], rising. Where all have one sign
            the curve goes on to the other side with opposite moments. A state beyond its ends
            counts as not converged.
        moment: Moment about the neutral axis at each angle [N mm], of the same sign, not
            falling.
        file: CSV file of both, with columns of these names; its path starts at the folder of the
            robot file. Reading a robot file takes the numbers from there.
        stiffness: Stiffness about x, y, z [N mm/rad] and along x, y, z [N/mm], of the far end
            against the near one, about the middle of the neutral axis. Bending is about y. Six
            numbers, infinite where it is rigid; or the 36 of a matrix by rows, symmetric and
            positive definite, of moments and forces by rotations [rad] and displacements [mm]. A
            curve replaces the second of six; where they are left out the rest is rigid.
        axis_offset: Distance of the neutral axis from the tube axis, away from the bend [mm].
        closing_angle_deg: Angle at which it closes, precurvature included [deg].
        uncut_length: Uncut length behind it, toward the tip [mm].
        direction_deg: Side toward which it bends [deg].
        precurvature_deg: Angle when nothing pulls [deg].
        repeat: How many equal ones follow one another.

    Raises:
        InputError: A value is not allowed, the curve falls, or the stiffness is not positive.

    Example:
        >>> joint = TableNotch(2.0, angle_deg=(5.0, 20.0), moment=(1.0, 3.0), uncut_length=1.0)
        >>> joint.curve
        ((-20.0, -5.0, 0.0, 5.0, 20.0), (-3.0, -1.0, 0.0, 1.0, 3.0))
    """

    length: Annotated[Float, positive("mm", "length along the neutral axis")]
    angle_deg: Annotated[
        tuple[Annotated[Float, quantity("deg", "angle", above=-180, below=180)], ...] | None,
        Field(description="angles of bending, rising", json_schema_extra={"unit": "deg"}),
    ] = None
    moment: Annotated[
        tuple[Float, ...] | None,
        Field(description="moment at each angle", json_schema_extra={"unit": "N mm"}),
    ] = None
    file: Annotated[
        str | None, Field(description="CSV file with the columns angle_deg and moment_Nmm")
    ] = None
    stiffness: Annotated[
        tuple[FloatOrInf, ...] | None,
        Field(description="stiffness about and along x, y, z: 6 numbers, or 36 by rows"),
    ] = None
    _: KW_ONLY
    kind: Literal["table"] = "table"
    is_cut: ClassVar = False
    axis_offset: Annotated[
        Float, quantity("mm", "distance of the neutral axis from the tube axis, off the bend")
    ] = 0.0
    closing_angle_deg: Annotated[
        Float | None, positive("deg", "angle at which it closes", below=180)
    ] = None

    @property
    def has_lips(self) -> bool:
        """Whether it meets a stop."""
        return self.closing_angle_deg is not None

    def made_of(self, material: Material) -> Any:
        """Return itself: its numbers are its law."""
        return self

    @property
    def curve(self) -> tuple[Sequence[float], Sequence[float]]:
        """Angles [deg] and moments [N mm] on both sides, with 0."""
        if not self.angle_deg:
            numbers = self.stiffness or ()
            half_turn = math.pi * numbers[7 if len(numbers) == 36 else 1]
            return (-180.0, 0.0, 180.0), (-half_turn, 0.0, half_turn)
        points = {0.0: 0.0, **dict(zip(self.angle_deg, self.moment or (), strict=True))}
        if min(points) == 0.0 or max(points) == 0.0:
            points |= {-angle: -moment for angle, moment in points.items() if angle}
        angles, moments = zip(*sorted(points.items()), strict=True)
        return angles, moments

    def cut_layout(self, tube: Tube, before: Notch | None, after: Notch | None) -> CutLayout:
        """Return the whole gap: what fills it is not known."""
        return whole_gap(self, tube.outer_radius)

    @property
    def stays_in_plane(self) -> bool:
        """Whether nothing couples its plane of bending with the directions out of it."""
        numbers = self.stiffness or ()
        coupled = (each for k, each in enumerate(numbers) if (k // 6 + k) % 2)
        return len(numbers) < 36 or not any(coupled)

    def conflicts(self) -> Problems:
        """Find a curve that falls, a stiffness that is not positive, or none of both."""
        angles, moments, numbers = self.angle_deg or (), self.moment or (), self.stiffness or ()
        if self.file is not None:
            yield "file", "is taken from robot files; give `angle_deg` and `moment` here."
        elif not angles and not numbers:
            yield "angle_deg", "is missing; give angles and moments, a file, or a stiffness."
        elif len(angles) != len(moments):
            yield "moment", f"has {len(moments)} numbers and `angle_deg` {len(angles)}."
        elif angles and (not any(angles) or any(low >= high for low, high in pairwise(angles))):
            yield "angle_deg", f"is {list(angles)} deg; angles must rise, and one is not 0."
        elif any(low > high for low, high in pairwise(moments)) or any(
            angle * moment <= 0.0 and (angle or moment)
            for angle, moment in zip(angles, moments, strict=True)
        ):
            yield (
                "moment",
                f"is {list(moments)} N mm; moments must have the signs of their angles and not "
                "fall: a falling piece has no unique equilibrium. Smooth a noisy curve first.",
            )
        elif len(numbers) not in ((0, 6) if angles else (6, 36)):
            yield "stiffness", f"has {len(numbers)} numbers; give 6, or 36 without a curve."
        elif numbers and not _is_positive(numbers, bool(angles)):
            yield (
                "stiffness",
                "is not positive; six numbers are greater than 0, the second one finite where no "
                "curve replaces it; 36 are a symmetric, positive definite matrix, with moments "
                "about x, y, z and forces along x, y, z as rows.",
            )

    def problems(self, tube: Tube) -> Problems:
        """Find a free shape beyond the closing angle."""
        if self.closing_angle_deg is not None and self.precurvature_deg >= self.closing_angle_deg:
            yield (
                "precurvature_deg",
                f"is {self.precurvature_deg} deg; it must be less than the closing angle, "
                f"{self.closing_angle_deg} deg.",
            )


def _is_positive(numbers: Sequence[float], has_curve: bool) -> bool:
    """Return whether a stiffness is positive definite, up to rounding."""
    import numpy as np  # robots without such a matrix are read without it

    if len(numbers) == 6:
        return min(numbers) > 0.0 and (has_curve or math.isfinite(numbers[1]))
    matrix = np.reshape(numbers, (6, 6))
    if not np.isfinite(matrix).all() or matrix.diagonal().min() <= 0.0:
        return False
    size = np.sqrt(matrix.diagonal())
    scaled = matrix / np.outer(size, size)
    error = np.abs(scaled - scaled.T).max()
    return bool(error < 1e-6 and np.linalg.eigvalsh(scaled).min() > 1e-9)
