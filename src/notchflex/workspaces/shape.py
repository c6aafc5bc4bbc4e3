"""The shape of a cloud of points: convex hull, alpha shape, and whether a point is inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull, Delaunay, QhullError

# A cloud thinner than this part of its size is flat, or a curve.
_FLAT = 1e-6


@dataclass(frozen=True, eq=False)
class Hull:
    """The convex hull of points.

    Attributes:
        dimension: 3, 2 for points of a plane, 1 for points of a line, 0 for a single one.
        size: Volume (mm³), area (mm²) or length (mm), by the dimension.
        corners: Its corners, mm, (k, 3).
        faces: Triples of corners, counted from 0; none unless it has a volume, (f, 3).
        origin: A point of the cloud's middle, mm, (3,).
        axes: Unit vectors of the space that the cloud fills, (dimension, 3).
    """

    dimension: int
    size: float
    corners: Float[np.ndarray, "k 3"]
    faces: Int[np.ndarray, "f 3"]
    origin: Float[np.ndarray, " 3"]
    axes: Float[np.ndarray, "dimension 3"]

    @property
    def unit(self) -> str:
        """Unit of its size."""
        return ("", "mm", "mm²", "mm³")[self.dimension]


def hull_of(points: Float[np.ndarray, "n 3"]) -> Hull:
    """Return the convex hull of points, mm."""
    origin, axes = _frame(points)
    dimension = len(axes)
    flat = (points - origin) @ axes.T
    no_faces = np.zeros((0, 3), int)
    if dimension == 0:
        return Hull(0, 0.0, points[:1], no_faces, origin, axes)
    if dimension == 1:
        ends = [int(flat.argmin()), int(flat.argmax())]
        return Hull(1, float(np.ptp(flat)), points[ends], no_faces, origin, axes)
    hull = ConvexHull(flat)
    corners = points[hull.vertices]
    faces = no_faces
    if dimension == 3:
        index = np.zeros(len(points), int)
        index[hull.vertices] = np.arange(len(hull.vertices))
        faces = index[hull.simplices]
    return Hull(dimension, float(hull.volume), corners, faces, origin, axes)


def alpha_size(points: Float[np.ndarray, "n 3"], radius: float) -> float:
    """Return volume (mm³) or area (mm²) of the alpha shape of points.

    It is the union of the simplices of their Delaunay triangulation whose circumscribed sphere is
    smaller than a radius: unlike the convex hull it leaves hollows out.

    Args:
        points: Points, mm.
        radius: Largest radius, mm.
    """
    origin, axes = _frame(points)
    if len(axes) < 2:
        return 0.0
    flat = (points - origin) @ axes.T
    try:
        simplices = flat[Delaunay(flat).simplices]
    except QhullError:
        return 0.0
    edges = simplices[:, 1:] - simplices[:, :1]
    sizes = np.abs(np.linalg.det(edges)) / (2.0 if len(axes) == 2 else 6.0)
    is_regular = sizes > 1e-12 * sizes.max()
    half = 0.5 * (edges[is_regular] ** 2).sum(axis=2)
    centre = np.linalg.solve(edges[is_regular], half[..., None])[..., 0]
    small = np.linalg.norm(centre, axis=1) <= radius
    return float(sizes[is_regular][small].sum())


def inside(
    hull: Hull, points: Float[np.ndarray, "n 3"], slack: float = 1e-3
) -> Bool[np.ndarray, " n"]:
    """Return which points lie in a hull with a volume or an area.

    Args:
        hull: The hull.
        points: Points, mm.
        slack: How far outside a point may lie, as a part of the size of the hull: a hull of single
            states misses the outermost ones of a thin workspace.
    """
    if hull.dimension < 2:
        return np.zeros(len(points), bool)
    near = slack * float(np.ptp(hull.corners, axis=0).max())
    flat = (points - hull.origin) @ hull.axes.T
    off = points - hull.origin - flat @ hull.axes
    within = np.abs(off).max(axis=1) <= near
    equations = ConvexHull((hull.corners - hull.origin) @ hull.axes.T).equations
    for row in equations:  # few, while the points are many
        within &= flat @ row[:-1] + row[-1] <= near
    return within


def _frame(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "d 3"]]:
    """Return the middle of points and the axes along which they spread."""
    origin = points.mean(axis=0)
    spread = points - origin
    # Of many points the axes follow from their covariance.
    values, vectors = np.linalg.eigh(spread.T @ spread / len(points))
    deviation = np.sqrt(np.maximum(values[::-1], 0.0))
    dimension = int((deviation > _FLAT * max(float(deviation[0]), 1e-9)).sum())
    return origin, vectors[:, ::-1].T[:dimension]
