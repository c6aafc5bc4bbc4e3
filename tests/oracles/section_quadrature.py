"""Area, centroid and second moments of a cut tube by quadrature, in extended precision.

Independent of the closed forms: the segment is integrated line by line across it (tanh-sinh
rule, because of the square roots at the ends), the sector over radius and angle (Gauss).
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

Real = np.longdouble


class Moments(NamedTuple):
    """Area [mm2], centroid and outer fibre [mm], second moments [mm4] about the centroid."""

    area: float
    centroid: float  # from the tube axis toward the spine
    weak: float
    strong: float
    edge_spine: float  # from the centroid to the outer surface of the spine


def _tanh_sinh(count: int = 300, reach: float = 3.6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes s of (0, 1) and 1 - s, each without cancellation, and weights."""
    pi = Real(4) * np.arctan(Real(1))
    t = np.linspace(-reach, reach, count, dtype=Real)
    u = pi / 2 * np.sinh(t)
    below, above = 1 / (1 + np.exp(-2 * u)), 1 / (1 + np.exp(2 * u))
    return below, above, (t[1] - t[0]) * pi * np.cosh(t) * below * above


def _lines(outer: float, inner: float, depth: float) -> tuple[np.ndarray, ...]:
    """Area of each line, its height above the cut plane, mean square of x, for a segment."""
    outer, inner, depth = Real(outer), Real(inner), Real(depth)
    plane, top = depth - outer, 2 * outer - depth
    stops = [Real(0), *(h for h in (-inner - plane, inner - plane) if 0 < h < top), top]
    s, rest, weight = _tanh_sinh()
    parts = []
    for low, high in pairwise(stops):
        span = high - low
        w = low + span * s
        # Half widths squared, r^2 - y^2 = (r - y)(r + y), from the distance to the nearer end.
        outer_square = ((top - high) + span * rest) * (depth + w)
        inner_square = np.maximum(
            ((inner - plane - high) + span * rest) * ((inner + plane + low) + span * s), 0
        )
        x_outer, x_inner = np.sqrt(outer_square), np.sqrt(inner_square)
        width = 2 * (outer_square - inner_square) / (x_outer + x_inner)
        mean_square = (outer_square + x_outer * x_inner + inner_square) / 3
        parts.append((width * span * weight, w, mean_square))
    return tuple(np.concatenate(part) for part in zip(*parts, strict=True))


def _points(outer: float, inner: float, depth: float) -> tuple[np.ndarray, ...]:
    """Area of each point, its height over the lowest point of the spine's outside, x^2."""
    outer, inner, depth = Real(outer), Real(inner), Real(depth)
    half = 2 * np.arctan2(np.sqrt(2 * outer - depth), np.sqrt(depth))
    x, weight = (part.astype(Real) for part in np.polynomial.legendre.leggauss(60))
    radius = (inner + outer) / 2 + (outer - inner) / 2 * x[:, None]
    angle = half * x[None, :]
    area = radius * weight[:, None] * weight[None, :] * half * (outer - inner) / 2
    drop = (outer - radius) + radius * 2 * np.sin(angle / 2) ** 2
    return area, (2 * outer - depth) - drop, (radius * np.sin(angle)) ** 2


def _moments(points, outer: float, inner: float, depth: float) -> Moments:
    area, height, square = points(outer, inner, depth)
    plane = Real(depth) - outer
    total = area.sum()
    middle = (area * height).sum() / total
    centroid = plane + middle
    if plane < 0:
        # The part cut away has the opposite first moment about the tube axis: with it the
        # centroid of a barely cut tube, nearly on the axis, keeps its digits.
        area_off, height_off, _ = points(outer, inner, 2 * Real(outer) - depth)
        centroid = (area_off * (height_off - plane)).sum() / total
    weak = (area * (height - middle) ** 2).sum()
    strong = (area * square).sum()
    return Moments(*map(float, (total, centroid, weak, strong, outer - plane - middle)))


def segment(outer: float, inner: float, depth: float) -> Moments:
    """Annular segment left by a cut plane, lengths in mm."""
    return _moments(_lines, outer, inner, depth)


def sector(outer: float, inner: float, depth: float) -> Moments:
    """Annular sector left by radial cuts, lengths in mm."""
    return _moments(_points, outer, inner, depth)
