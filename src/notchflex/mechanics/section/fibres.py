"""Fibres of a section: arms from the neutral axis and areas, by Gauss's rule.

The rule is that of the section's width over its height, computed from many fine strips. Area,
centroid and second moment equal those of the section to rounding: the arms are shifted and scaled
by the error of the strips, about 1e-7.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.polynomial import legendre

from notchflex._arrays import cached, decide, is_traced, xp
from notchflex._jax import constant, jax, scan
from notchflex.mechanics.section.angles import half_angle

leggauss = lru_cache(maxsize=16)(legendre.leggauss)

FIBRES = 20
_RADII, _ANGLES, _STRIPS = 10, 2, 8  # the latter for each fibre; with fewer the recurrence fails
# A node is searched in eighths of an angle; five times, and the error is below 1e-4 rad.
_PARTS, _WIDTHS = np.arange(1, 8)[:, None], np.pi / 8.0 ** np.arange(1, 6)

Strips = Float[np.ndarray, " strips"]
Points = tuple[Float[np.ndarray, "*nodes fibres"], Float[np.ndarray, "*nodes fibres"]]
"""Arms (mm) and areas (mm^2)."""

FibresAt = Callable[[Any, Any, int], Points]
"""Fibres of sections by the distances of their edges, near and spine, from their neutral axes, mm,
and their number; only those of one section where all are alike."""


def two_walls_fibres(near: Any, spine: Any, count: int) -> Points:
    """Few fibres of walls of constant width (`two_walls`, or any rectangle)."""
    points, weights = leggauss(count)
    beside_spine, beside_near = xp.outer(spine, 1.0 + points), xp.outer(near, 1.0 - points)
    return 0.5 * (beside_spine - beside_near), weights


@cached(1024)  # the same for all sites and heights
def cut_fibres(cut: str, outer: float, inner: float, depth: float, count: int) -> Points:
    """Few fibres of what a cut leaves of a tube."""
    return gauss_rule(*_FIBRES_OF_CUT[cut](outer, inner, depth, count), count)


def sector_fibres(outer: float, inner: float, depth: float, count: int = FIBRES) -> Points:
    """Divide an annular sector (`annular_sector`); each piece stands for both halves."""
    numbers = outer, 2.0 * outer - depth, depth
    half = half_angle(*map(constant, numbers))
    angles, of_angles = _between(0.0, half, _ANGLES * count)
    radii, of_radii = _between(inner, outer, _RADII)
    area = 2.0 * xp.outer(of_radii * radii, of_angles)
    return xp.outer(radii, xp.cos(angles)).ravel(), area.ravel()


def segment_fibres(outer: float, inner: float, depth: float, count: int = FIBRES) -> Points:
    """Divide an annular segment (`annular_segment`) into strips across, outside and at the bore.

    The heights of strips are cosines, so that the chords of both circles are smooth over them.
    """
    plane = depth - outer
    top, bottom, rim = (
        half_angle(*map(constant, (radius, radius - height, radius + height)))
        for radius, height in ((outer, plane), (inner, plane), (outer, inner))
    )
    beyond = xp.minimum(rim, top)
    ends = [(0.0, beyond)] + ([(np.pi - beyond, top)] if decide(plane < -inner) else [])
    at_bore = _STRIPS * count // 2 if decide(bottom > 0.0) else 0
    angles, of_angles = zip(
        *(_between(*pair, (_STRIPS * count - at_bore) // len(ends)) for pair in ends), strict=True
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


def fitted(points: Points, area: Any, second_moment: Any) -> Points:
    """Shift fibres to their centroid; scale to given areas (mm^2) and second moments (mm^4)."""
    arm, areas = map(xp.atleast_2d, points)

    def total(values: Any) -> Any:
        return xp.sum(values, -1, keepdims=True)

    areas = areas * (area[:, None] / total(areas))
    arm = arm - total(areas * arm) / area[:, None]
    return arm * xp.sqrt(second_moment[:, None] / total(areas * arm**2)), areas


def gauss_rule(points: Strips, weights: Strips, count: int) -> Points:
    """Compute the Gauss rule of a discrete measure, exact up to degree 2 count - 1.

    The nodes are the roots of the last of the polynomials orthogonal over the points. Signs of the
    others tell how many lie above a place; they are searched along the angle of its cosine, where
    they are evenly spaced.
    """
    total = xp.sum(weights)
    shares = weights / total

    def extend(state: Any, _: Any) -> Any:
        before, polynomial = state
        diagonal = shares @ (points * polynomial**2)
        following = (points - diagonal) * polynomial - before
        beside = xp.sqrt(shares @ following**2)
        return (beside * polynomial, following / beside), (diagonal, beside)

    start = xp.zeros_like(points), xp.ones_like(points)
    recurrence = scan(extend, start, (np.zeros(count),))[1]
    fixed, ends = recurrence, points
    if is_traced(points):  # the last step below has the slopes of the nodes
        fixed, ends = jax.lax.stop_gradient((recurrence, points))
    low, high = xp.min(ends), xp.max(ends)

    def place(angle: Any) -> Any:
        return 0.5 * (low + high) - 0.5 * (high - low) * xp.cos(angle)

    def narrow(angle: Any, width: Any) -> Any:
        above = _polynomials(fixed, place(angle + width[0] * _PARTS))[-1]
        return angle + width[0] * xp.sum(
            above >= np.arange(count, 0, -1)[None], 0, keepdims=True
        ), ()

    angle = scan(narrow, xp.zeros_like(fixed[0][None]), (_WIDTHS,))[0]
    nodes = place(angle + 0.5 * _WIDTHS[-1])
    for known in (fixed, fixed, fixed, recurrence):  # Newton's steps for the last two's ratio
        before, last, squares, _ = _polynomials(known, nodes)
        nodes = nodes - before * last / squares
    return nodes[0], total / _polynomials(recurrence, nodes)[2][0]


def _polynomials(recurrence: Any, places: Any) -> Any:
    """Return the last two polynomials, the sum of squares without the last, changes of sign."""

    def step(state: Any, entry: Any) -> Any:
        before, polynomial, squares, changes = state
        diagonal, beside = entry
        following = (places - diagonal) * polynomial - before
        changes = changes + ((following < 0.0) != (polynomial < 0.0))
        return (beside * polynomial, following / beside, squares + polynomial**2, changes), ()

    none = xp.zeros_like(places)
    return scan(step, (none, none + 1.0, none, xp.zeros_like(places, int)), recurrence)[0]
