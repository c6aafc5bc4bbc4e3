"""Torsion constant and shear centre of a cut tube by `sectionproperties` (finite elements).

The geometry is cut out of two circles with shapely, apart from the package and from the script
that made its table. The analyses run in a process of their own, because its mesher crashes now
and then when it is used many times (drufat/triangle issues 68, 70).
"""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np

Case = tuple[str, float, float]  # cut, r_i / r_o, depth over the outer radius


def torsions(cases: list[Case]) -> list[tuple[float, float]]:
    """Torsion constant and shear centre (Trefftz) of tubes of outer radius 1."""
    found: list[tuple[float, float]] = []
    for attempt in range(8):
        # Another number of layers is another mesh, should one of them be what it crashes on.
        missing = json.dumps([cases[len(found) :], 3.0 + 0.1 * attempt])
        done = subprocess.run(
            [sys.executable, __file__, missing], capture_output=True, text=True, check=False
        )
        found += [tuple(json.loads(line)) for line in done.stdout.splitlines()]
        if len(found) == len(cases):
            return found
    raise RuntimeError(f"sectionproperties fails on {cases[len(found)]}: {done.stderr}")


def _disc(radius: float, corners: int):
    from shapely import Polygon

    # The polygon of the area of the circle.
    angle = 2 * np.pi / corners
    x = (np.arange(corners) + 0.5) * angle
    return Polygon(radius * np.sqrt(angle / np.sin(angle)) * np.c_[np.sin(x), np.cos(x)])


def _torsion(cut: str, ratio: float, depth: float, layers: float) -> tuple[float, float]:
    # With `layers` quadratic elements across the wall.
    from sectionproperties.analysis import Section
    from sectionproperties.pre import Geometry
    from shapely import Polygon, affinity, set_precision

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
    # Corners beside each other where the cut meets one would break the mesher.
    shape = set_precision(shape, 1e-7)
    # Area 1 about the origin: the solver's tolerance is absolute.
    scale, centre = shape.area**-0.5, shape.centroid.y
    shape = affinity.translate(shape, yoff=-centre)
    geometry = Geometry(affinity.scale(shape, scale, scale, origin=(0, 0)))
    geometry.create_mesh([0.5 * (size * scale) ** 2])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    found = float(section.get_j() / scale**4), float(section.get_sc_t()[1] / scale + centre)
    if not np.all(np.isfinite(found)):
        raise RuntimeError("the analysis gave no number")
    return found


if __name__ == "__main__":
    wanted, with_layers = json.loads(sys.argv[1])
    for case in wanted:
        print(json.dumps(_torsion(*case, with_layers)), flush=True)
