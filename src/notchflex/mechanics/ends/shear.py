r"""Shear of a notch with its ends: relative displacement of its two rings.

A force across the tube, through the middle of the notch and its centre of twist, bends the arc to
an S and distorts the rings. Its compliance times Young's modulus is

$$E\,C = \frac{\ell^3}{12\,I} + \frac{K}{D}\left(\frac{t}{D}\right)^{p}\left(\frac{b}{D}\right)^{q}
\left(\frac{\ell}{D}\right)^{m}\left(\frac{c}{D}\right)^{n}$$

with the length ℓ of the bending about the axis that the force bends it about, ends included, the
wall t, the width b of the arc, the uncut length c and the outer diameter D. The five numbers of
each direction were fitted to cells of chains of equal notches.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from notchflex._arrays import plain_number
from notchflex.mechanics.ends.edge_loads import WallSector
from notchflex.mechanics.ends.side import Side


class _Powers(NamedTuple):
    """The factor K and the powers of t, b, ℓ and c, each over the outer diameter."""

    factor: float
    wall: float
    width: float
    length: float
    ring: float


_IN_PLANE = _Powers(1.37, -1.80, -2.10, 1.00, 0.30)
_SIDEWAYS = _Powers(2.35, -1.17, -0.84, 1.31, 0.06)


def shear_compliances(
    arc: WallSector,
    outer: float,
    lengths: tuple[float, float],
    second_moments: tuple[float, float],
    sides: Sequence[Side],
) -> tuple[float, float]:
    """Compute the compliance of the two directions across the tube.

    Args:
        arc: The arc of wall that the cut leaves.
        outer: Outer radius, mm.
        lengths: Lengths ℓ of weak and of strong bending, mm.
        second_moments: Second moments of these, mm⁴.
        sides: The rings beside the notch.

    Returns:
        Displacement per force times Young's modulus, 1/mm: in the plane in which the notch bends,
        and sideways.
    """
    diameter = 2.0 * outer
    wall, width = arc.wall / diameter, 2.0 * arc.half_angle * arc.radius / diameter

    def compliance(powers: _Powers, length: float, second_moment: float) -> float:
        rings = sum((side.length / diameter) ** powers.ring for side in sides) / len(sides)
        arc_and_rings = wall**powers.wall * width**powers.width * rings
        distorted = powers.factor * arc_and_rings * (length / diameter) ** powers.length
        return plain_number(length**3 / (12.0 * second_moment) + distorted / diameter)

    in_plane, sideways = map(compliance, (_IN_PLANE, _SIDEWAYS), lengths, second_moments)
    return in_plane, sideways
