"""Torsion constant and shear centre of a cut tube by `sectionproperties` (finite elements).

The geometry is cut out of two circles with shapely, apart from the package and from the script
that made its table.
"""

from __future__ import annotations

import numpy as np
from sectionproperties.analysis import Section
from sectionproperties.pre import Geometry
from shapely import Polygon, affinity


def _disc(radius: float, corners: int) -> Polygon:
    # The polygon of the area of the circle.
    angle = 2 * np.pi / corners
    x = (np.arange(corners) + 0.5) * angle
    return Polygon(radius * np.sqrt(angle / np.sin(angle)) * np.c_[np.sin(x), np.cos(x)])


def torsion(cut: str, ratio: float, depth: float, layers: int = 3) -> tuple[float, float]:
    """Torsion constant and shear centre (Trefftz) of a tube of outer radius 1.

    `ratio` is r_i / r_o, `depth` the depth over the outer radius, `layers` the number of
    quadratic elements across the wall.
    """
    thickness = 1 - ratio
    if cut == "off-axis":
        thickness = min(thickness, 2 - depth)
        kept = Polygon([(-2, depth - 1), (2, depth - 1), (2, 2), (-2, 2)])
    else:
        half = np.arccos(depth - 1)
        thickness = min(thickness, half * (1 + ratio))
        edge = np.linspace(-half, half, 9)
        kept = Polygon([(0, 0), *(3 * np.c_[np.sin(edge), np.cos(edge)])])
    size = min(thickness / layers, 0.1)
    corners = 2 * int(np.pi / size / 2)
    shape = (_disc(1, corners) - _disc(ratio, corners)) & kept
    # Area 1 about the origin: the solver's tolerance is absolute.
    scale, centre = shape.area**-0.5, shape.centroid.y
    shape = affinity.translate(shape, yoff=-centre)
    geometry = Geometry(affinity.scale(shape, scale, scale, origin=(0, 0)))
    geometry.create_mesh([0.5 * (size * scale) ** 2])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    return section.get_j() / scale**4, section.get_sc_t()[1] / scale + centre
