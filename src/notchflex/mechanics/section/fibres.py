"""Fibres of a section: arms from the neutral axis and areas, by Gauss's rule.

The rule is that of the section's own width over its height, found from many fine strips. Area,
centroid and second moment are those of the section to rounding: the arms are moved and scaled by
what the strips leave, about 1e-7 of them. Used when a robot is put together, in NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre

from notchflex._jax import constant
from notchflex.mechanics.section.angles import half_angle

leggauss = lru_cache(maxsize=16)(legendre.leggauss)

FIBRES = 20
_RADII, _ANGLES, _STRIPS = 10, 40, 160

Strips = Float[np.ndarray, " strips"]
Points = tuple[Float[np.ndarray, " fibres"], Float[np.ndarray, " fibres"]]
"""Arms (mm) and areas (mm^2)."""

FibresAt = Callable[[float, float], Points]
"""Fibres of a section by the distances of its edges, near and spine, from its neutral axis, mm."""


def two_walls_fibres(near: float, spine: float) -> Points:
    """Few fibres of walls of constant width (`two_walls`, or any rectangle)."""
    return reduced(rectangle_fibres(near, spine))


@lru_cache(maxsize=1024)  # the same for all sites and heights
def cut_fibres(cut: str, outer: float, inner: float, depth: float) -> Points:
    """Few fibres of what a cut leaves of a tube."""
    return reduced(_FIBRES_OF_CUT[cut](outer, inner, depth))


def rectangle_fibres(near: float, spine: float) -> Points:
    """Pieces of a wall of constant width between two distances from the neutral axis, mm."""
    points, weights = leggauss(_STRIPS)
    return 0.5 * (spine - near) + 0.5 * (spine + near) * points, weights


def sector_fibres(outer: float, inner: float, depth: float) -> Points:
    """Pieces of an annular sector (`annular_sector`), each standing for both halves."""
    numbers = outer, 2.0 * outer - depth, depth
    half = float(half_angle(*(constant(number) for number in numbers)))
    angles, of_angles = _between(0.0, half, _ANGLES)
    radii, of_radii = _between(inner, outer, _RADII)
    area = 2.0 * np.outer(of_radii * radii, of_angles)
    return np.outer(radii, np.cos(angles)).ravel(), area.ravel()


def segment_fibres(outer: float, inner: float, depth: float) -> Points:
    """Pieces of an annular segment (`annular_segment`): strips across, outside and beside the bore.

    The heights of strips are cosines, so that the chords of both circles are smooth over them.
    """
    plane = depth - outer
    top, bottom = (float(np.arccos(np.clip(plane / r, -1.0, 1.0))) for r in (outer, inner))
    beyond = float(np.arccos(np.clip(inner / outer, plane / outer, 1.0)))
    ends = [(0.0, beyond)] + ([(np.pi - beyond, top)] if plane < -inner else [])
    at_bore = _STRIPS // 2 if bottom > 0.0 else 0
    angles, of_angles = zip(
        *(_between(*pair, (_STRIPS - at_bore) // len(ends)) for pair in ends), strict=True
    )
    solid, of_solid = np.concatenate(angles), np.concatenate(of_angles)
    bore, of_bore = _between(0.0, bottom, at_bore) if at_bore else (np.zeros(0), np.zeros(0))
    height = inner * np.cos(bore)
    wall = np.sqrt(outer**2 - height**2) - inner * np.sin(bore)
    area = (
        2.0 * (outer * np.sin(solid)) ** 2 * of_solid,
        2.0 * wall * inner * np.sin(bore) * of_bore,
    )
    return np.append(outer * np.cos(solid), height), np.concatenate(area)


_FIBRES_OF_CUT = {"on-axis": sector_fibres, "off-axis": segment_fibres}


def _between(first: float, last: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = leggauss(count)
    return 0.5 * (first + last) + 0.5 * (last - first) * points, 0.5 * (last - first) * weights


def reduced(points: Points) -> Points:
    """Few fibres that stand for many."""
    return gauss_rule(*points, FIBRES)


def fitted(points: Points, area: float, second_moment: float) -> Points:
    """Fibres about their centroid, of a given area (mm^2) and second moment (mm^4)."""
    arm, areas = points
    areas = areas * (area / np.sum(areas))
    arm = arm - areas @ arm / area
    return arm * np.sqrt(second_moment / (areas @ arm**2)), areas


def gauss_rule(points: Strips, weights: Strips, count: int) -> Points:
    """Few points that integrate all polynomials as many do, up to degree 2 count - 1.

    They are the eigenvalues of the recurrence of the polynomials orthogonal over the points.
    """
    total, last, here = np.sum(weights), np.zeros_like(points), np.ones_like(points)
    centre, beside = np.zeros(count), np.zeros(count + 1)
    here = here / np.sqrt(total)
    for degree in range(count):
        centre[degree] = weights @ (points * here**2)
        following = (points - centre[degree]) * here - beside[degree] * last
        beside[degree + 1] = np.sqrt(weights @ following**2)
        last, here = here, following / beside[degree + 1]
    beside = beside[1:-1]
    found, vectors = np.linalg.eigh(np.diag(centre) + np.diag(beside, 1) + np.diag(beside, -1))
    return found, total * vectors[0] ** 2
