"""Fibres of a section: arms from the neutral axis and areas, by Gauss's rule.

Area, centroid and second moment are those of the section to rounding: the arms are moved and
scaled by what the rule leaves, about 1e-7 of them. Used when a robot is put together, in NumPy.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from notchflex.mechanics.section.angles import half_angle

FIBRES = 40
# Angles within the arc, and within the bevelled ends of an arc that a plane cuts.
_ARC, _BEVEL = 14, 6

Points = tuple[Float[np.ndarray, " fibres"], Float[np.ndarray, " fibres"]]
"""Arms (mm) and areas (mm^2)."""


def rectangle_fibres(near: float, spine: float) -> Points:
    """Fibres of a wall of constant width between two distances from the neutral axis, mm."""
    points, weights = leggauss(FIBRES)
    return 0.5 * (spine - near) + 0.5 * (spine + near) * points, weights


def sector_fibres(outer: float, inner: float, depth: float) -> Points:
    """Fibres of an annular sector (`annular_sector`), two rows of twenty."""
    half = float(half_angle(*(np.asarray(x) for x in (outer, 2.0 * outer - depth, depth))))
    angles, weights = _between(0.0, half, FIBRES // 2)
    return _polar(angles, weights, inner, outer)


def segment_fibres(outer: float, inner: float, depth: float) -> Points:
    """Fibres of an annular segment (`annular_segment`), two rows of twenty."""
    plane = depth - outer
    at_outer, at_inner = (np.arccos(np.clip(plane / r, -1.0, 1.0)) for r in (outer, inner))
    arc, of_arc = _between(0.0, min(at_outer, at_inner), _ARC)
    bevel, of_bevel = _between(min(at_outer, at_inner), max(at_outer, at_inner), _BEVEL)
    cut = plane / np.cos(bevel)  # distance of the plane from the axis along the angle
    whole = np.ones(_ARC)
    least = np.append(inner * whole, cut if plane > 0.0 else inner + 0.0 * cut)
    most = np.append(outer * whole, cut if plane < 0.0 else outer + 0.0 * cut)
    return _polar(np.append(arc, bevel), np.append(of_arc, of_bevel), least, most)


def _between(first: float, last: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = leggauss(count)
    return 0.5 * (first + last) + 0.5 * (last - first) * points, 0.5 * (last - first) * weights


def _polar(angles: np.ndarray, weights: np.ndarray, least: ArrayLike, most: ArrayLike) -> Points:
    """Two fibres along every radius, of both halves of the section together."""
    points, of_points = leggauss(2)
    middle, reach = 0.5 * (np.asarray(least) + most), 0.5 * (np.asarray(most) - least)
    radius = middle + reach * points[:, None]
    area = 2.0 * weights * reach * radius * of_points[:, None]
    return (radius * np.cos(angles)).ravel(), area.ravel()


def fitted(points: Points, area: float, second_moment: float) -> Points:
    """Fibres about their centroid, of a given area (mm^2) and second moment (mm^4)."""
    arm, areas = points
    areas = areas * (area / np.sum(areas))
    arm = arm - areas @ arm / area
    return arm * np.sqrt(second_moment / (areas @ arm**2)), areas
