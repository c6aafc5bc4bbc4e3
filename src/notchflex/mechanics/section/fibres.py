"""Fibres of a section: arms from the neutral axis and areas, by Gauss's rule.

The rule is that of the section's width over its height, computed from many fine strips. Area,
centroid and second moment equal those of the section to rounding: the arms are shifted and scaled
by the error of the strips, about 1e-7. Used when a robot is assembled, in NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre

from notchflex._arrays import cached, decide, xp
from notchflex._jax import constant
from notchflex.mechanics.section.angles import half_angle

leggauss = lru_cache(maxsize=16)(legendre.leggauss)

FIBRES = 20
_RADII, _ANGLES, _STRIPS = 10, 40, 160

Strips = Float[np.ndarray, " strips"]
Points = tuple[Float[np.ndarray, " fibres"], Float[np.ndarray, " fibres"]]
"""Arms (mm) and areas (mm^2)."""

FibresAt = Callable[[float, float, int], Points]
"""Fibres of a section by the distances of its edges, near and spine, from its neutral axis, mm,
and their number."""


def two_walls_fibres(near: float, spine: float, count: int) -> Points:
    """Few fibres of walls of constant width (`two_walls`, or any rectangle)."""
    return gauss_rule(*rectangle_fibres(near, spine), count)


@cached(1024)  # the same for all sites and heights
def cut_fibres(cut: str, outer: float, inner: float, depth: float, count: int) -> Points:
    """Few fibres of what a cut leaves of a tube."""
    return gauss_rule(*_FIBRES_OF_CUT[cut](outer, inner, depth), count)


def rectangle_fibres(near: float, spine: float) -> Points:
    """Divide a wall of constant width between two distances from the neutral axis, mm."""
    points, weights = leggauss(_STRIPS)
    return 0.5 * (spine - near) + 0.5 * (spine + near) * points, weights


def sector_fibres(outer: float, inner: float, depth: float) -> Points:
    """Divide an annular sector (`annular_sector`); each piece stands for both halves."""
    numbers = outer, 2.0 * outer - depth, depth
    half = half_angle(*map(constant, numbers))
    angles, of_angles = _between(0.0, half, _ANGLES)
    radii, of_radii = _between(inner, outer, _RADII)
    area = 2.0 * xp.outer(of_radii * radii, of_angles)
    return xp.outer(radii, xp.cos(angles)).ravel(), area.ravel()


def segment_fibres(outer: float, inner: float, depth: float) -> Points:
    """Divide an annular segment (`annular_segment`) into strips across, outside and at the bore.

    The heights of strips are cosines, so that the chords of both circles are smooth over them.
    """
    plane = depth - outer
    top, bottom = (xp.arccos(xp.clip(plane / r, -1.0, 1.0)) for r in (outer, inner))
    beyond = xp.arccos(xp.clip(inner / outer, plane / outer, 1.0))
    ends = [(0.0, beyond)] + ([(np.pi - beyond, top)] if decide(plane < -inner) else [])
    at_bore = _STRIPS // 2 if decide(bottom > 0.0) else 0
    angles, of_angles = zip(
        *(_between(*pair, (_STRIPS - at_bore) // len(ends)) for pair in ends), strict=True
    )
    solid, of_solid = xp.concatenate(angles), xp.concatenate(of_angles)
    bore, of_bore = _between(0.0, bottom, at_bore) if at_bore else (xp.zeros(0), xp.zeros(0))
    height = inner * xp.cos(bore)
    wall = xp.sqrt(outer**2 - height**2) - inner * xp.sin(bore)
    area = (
        2.0 * (outer * xp.sin(solid)) ** 2 * of_solid,
        2.0 * wall * inner * xp.sin(bore) * of_bore,
    )
    return xp.append(outer * xp.cos(solid), height), xp.concatenate(area)


_FIBRES_OF_CUT = {"on-axis": sector_fibres, "off-axis": segment_fibres}


def _between(first: float, last: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = leggauss(count)
    return 0.5 * (first + last) + 0.5 * (last - first) * points, 0.5 * (last - first) * weights


def fitted(points: Points, area: float, second_moment: float) -> Points:
    """Shift fibres to their centroid; scale to a given area (mm^2) and second moment (mm^4)."""
    arm, areas = points
    areas = areas * (area / xp.sum(areas))
    arm = arm - areas @ arm / area
    return arm * xp.sqrt(second_moment / (areas @ arm**2)), areas


def gauss_rule(points: Strips, weights: Strips, count: int) -> Points:
    """Compute the Gauss rule of a discrete measure, exact up to degree 2 count - 1.

    They are the eigenvalues of the recurrence of the polynomials orthogonal over the points.
    """
    total, last_polynomial, polynomial = (
        xp.sum(weights),
        xp.zeros_like(points),
        xp.ones_like(points),
    )
    diagonal, off_diagonal = list[Any](), list[Any]([0.0])
    polynomial = polynomial / xp.sqrt(total)
    for _ in range(count):
        diagonal.append(weights @ (points * polynomial**2))
        next_polynomial = (points - diagonal[-1]) * polynomial
        next_polynomial = next_polynomial - off_diagonal[-1] * last_polynomial
        off_diagonal.append(xp.sqrt(weights @ next_polynomial**2))
        last_polynomial, polynomial = polynomial, next_polynomial / off_diagonal[-1]
    beside = xp.stack(off_diagonal[1:-1])
    matrix = xp.diag(xp.stack(diagonal)) + xp.diag(beside, 1) + xp.diag(beside, -1)
    nodes, vectors = xp.linalg.eigh(matrix)
    return nodes, total * vectors[0] ** 2
