"""Strain at the rounded corner of a cut over that of the section there (K_t).

Both are those of a linear tube. The numbers were fitted to finite elements of half cells of long
rows of equal notches, cut on-axis and bent without a tendon, the rows "fit" of
`tests/reference/fem_corner_cells.csv` (`benchmarks/fe/corner_cells.py`). Wall and height of the
notch count for no more than the scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex.robot import ArcNotch, Tube
from notchflex.robot.kinds import Notch

# Lengths over the outer diameter between which the cells lie.
_RADII, _DEPTHS, _RINGS = (0.006, 0.1), (0.68, 0.92), (0.2, 2.4)


def corner_factor(radius: Any, depth: Any, ring: Any) -> Float[Array, ""]:
    """Return the factor by radius, depth and the longer ring, over the outer diameter; or NaN."""
    ring = xp.minimum(ring, _RINGS[1])  # longer ones hold the arc no more
    ranges = (radius, _RADII), (depth, _DEPTHS), (ring, _RINGS)
    known = xp.stack([(value >= low) & (value <= high) for value, (low, high) in ranges])
    size, left, long = xp.log(radius), xp.log(1.0 - depth), xp.log(ring)
    exponent = (
        0.7805
        + size * (0.0492 + 0.0535 * size - 0.0341 * long)
        + left * (0.2288 + 0.1467 * long)
        + long * (0.2345 - 0.0496 * long)
    )
    return xp.where(xp.all(known), xp.exp(exponent), xp.nan)


def corner_factors(
    radius: float, notches: Sequence[Notch], tubes: Sequence[Tube], body_length: Array
) -> Float[Array, " n"]:
    """Return the factor of every notch with corners of a radius, mm; NaN where it is not known."""
    factors = list[Any]()
    for number, (notch, tube) in enumerate(zip(notches, tubes, strict=True)):
        if not isinstance(notch, ArcNotch) or notch.cut != "on-axis":
            factors.append(xp.array(xp.nan))
            continue
        # The first notch has a held base beside it, which acts as the longest ring.
        held = xp.array([_RINGS[1] * tube.outer_diameter])
        rings = body_length[number : number + 2] if number else held
        lengths = radius, notch.section_depth(tube), xp.max(rings)
        factors.append(corner_factor(*(length / tube.outer_diameter for length in lengths)))
    return xp.stack(factors)
