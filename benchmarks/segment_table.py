"""Make segment_table.csv of notchflex.mechanics with sectionproperties (an hour of one core).

    python benchmarks/segment_table.py --json FILE     # writes the table
    python -c "from segment_table import analyse; print(analyse(0.864, 0.7))"     # of one section

Torsion constant and (Trefftz) shear centre of the annular segment of outer radius 1, by the ratio
of the radii and the depth of the cut, at Chebyshev nodes of the coordinates that `segment_torsion`
of `mechanics/cuts.py` interpolates over, by warping analysis with quadratic triangles, three across
the wall and smaller where it tapers. Divided by the estimates there and fitted by least squares.
FILE keeps the values of the analysis: a second run only fits, or goes on where the mesher crashed.
`--part 0/2` and `--part 1/2` analyse half of the nodes each, into one FILE.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from harness import options, trials
from sectionproperties.analysis import Section
from sectionproperties.pre import Geometry
from shapely import Polygon, affinity

from notchflex._jax import jnp
from notchflex.mechanics import cuts

TABLE = Path(__file__).parents[1] / "src/notchflex/mechanics/segment_table.csv"
LAYERS = 3  # elements across the wall
COARSEST = 0.1  # size of an element over the outer radius
NODES = {"closed": (9, 16), "open": (9, 20), "solid": (1, 12)}  # ratios, chord angles
ORDERS = {"closed": (7, 11), "open": (8, 16), "solid": (0, 8)}  # highest of the polynomials
SHEAR_NOISE = 3e-3
"""Over the outer radius: a shear centre this near the axis weighs half in the fit."""


def spaced(end, size):
    """Angles from 0 to `end`, as far apart as `size(angle)` says."""
    fine = np.linspace(0.0, end, 4001)
    count = np.concatenate([[0.0], np.cumsum(np.diff(fine) / size(0.5 * (fine[1:] + fine[:-1])))])
    return np.interp(np.linspace(0.0, count[-1], max(int(count[-1]) + 1, 12)), count, fine)


def arc(radius, right):
    """Points from −right to right, moved outward so that the area is that of the circle."""
    angle = np.r_[-right[:0:-1], right]
    half = 0.5 * np.gradient(angle)
    half[[0, -1]] = 0.0  # the ends of the cut stay where they are
    return radius * (1.0 + half[:, None] ** 2 / 3.0) * np.c_[np.sin(angle), np.cos(angle)]


def annular_segment_mesh(ratio, depth):
    """Polygon of the section, outer radius 1, and the size of its elements."""
    plane = depth - 1.0
    wall = min(1.0 - ratio, 2.0 - depth)

    def size(angle):  # of the elements: from the thickness along the radius where it is cut
        cosine = np.cos(angle)
        cut = plane / np.where(np.abs(cosine) < 1e-9, 1e-9, cosine)
        low = np.where(cosine > 0.0, np.maximum(ratio, cut), ratio)
        high = np.where((cosine < 0.0) & (cut > 0.0), np.minimum(1.0, cut), 1.0)
        return np.minimum(np.clip(np.abs(high - low), 0.02 * wall, wall) / LAYERS, COARSEST)

    outside = arc(1.0, spaced(np.arccos(plane), size))
    largest = min(wall / LAYERS, COARSEST)
    if plane >= ratio:
        return Polygon(outside), largest
    bore = arc(ratio, spaced(np.arccos(max(plane / ratio, -1.0)), size))
    if plane <= -ratio:
        return Polygon(outside, [bore[:-1]]), largest
    return Polygon(np.r_[outside, bore[::-1]]), largest


def analyse(ratio, depth):
    """Torsion constant and shear centre (Trefftz) over the outer radius."""
    polygon, size = annular_segment_mesh(ratio, depth)
    # About the origin and of area 1, which the tolerance of the solver takes for granted.
    scale, centre = polygon.area**-0.5, polygon.centroid.y
    moved = affinity.scale(
        affinity.translate(polygon, yoff=-centre), scale, scale, origin=(0.0, 0.0)
    )
    geometry = Geometry(moved)
    geometry.create_mesh([0.5 * (size * scale) ** 2])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    return section.get_j() / scale**4, section.get_sc_t()[1] / scale + centre


def places(shape):
    """Ratios and chord angles of the nodes, and the depths that they stand for."""

    def nodes(count, low, high):
        x = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        return 0.5 * (low + high) + 0.5 * (high - low) * x

    many, along = NODES[shape]
    roots = nodes(many, *(np.sqrt(1.0 - ratio) for ratio in reversed(cuts.RATIO_RANGE)))
    grid = np.meshgrid(roots, nodes(along, *cuts.CHORD_RANGE[shape]))
    root, angle = (axis.ravel() for axis in grid)
    ratio = 1.0 - root**2
    if shape == "closed":
        return ratio, angle, (1.0 - ratio) * np.cos(angle / 2.0) ** 2
    if shape == "open":
        return ratio, angle, 1.0 + ratio * np.cos(angle)
    # A solid segment of a tube whose bore the plane does not reach: the ratio has no effect.
    return np.minimum(ratio, np.cos(angle)), angle, 1.0 + np.cos(angle)


def estimates(shape, ratio, depth):
    """Estimates of torsion constant and shear centre, which the factors multiply."""
    one, ratio, depth = jnp.ones(len(ratio)), jnp.asarray(ratio), jnp.asarray(depth)
    area = cuts.annular_segment(one, ratio, depth).area
    if shape == "closed":
        return cuts.closed_estimate(one, ratio, depth)
    if shape == "open":
        return cuts.open_estimate(one, ratio, depth, area)
    return area * (2.0 * one - depth) ** 2 / 3.0, one


def fit(shape, values):
    """Fit the factors: coefficients and largest relative residual, by quantity."""
    ratio, angle, depth = places(shape)

    def scaled(x, low, high):
        return (2.0 * x - low - high) / (high - low)

    x = scaled(np.sqrt(1.0 - ratio), *(np.sqrt(1.0 - end) for end in reversed(cuts.RATIO_RANGE)))
    y = scaled(angle, *cuts.CHORD_RANGE[shape])
    orders = np.array(ORDERS[shape])
    matrix = np.polynomial.chebyshev.chebvander2d(x, y, orders)
    guesses = map(np.asarray, estimates(shape, ratio, depth))
    for name, value, guess, noise in zip(
        ("torsion", "shear"), values.T, guesses, (0, SHEAR_NOISE), strict=True
    ):
        weight = guess / (np.abs(guess) + noise)
        factor = value / guess
        solution = np.linalg.lstsq(matrix * weight[:, None], factor * weight, rcond=None)[0]
        worst = np.max(np.abs((matrix @ solution - factor) * weight / factor))
        print(f"{shape} {name}: largest relative residual {worst:.1e}")
        yield name, solution.reshape(orders + 1)


def main():
    """Analyse all nodes, or a part of them; then fit and write the table."""
    chosen = options(__doc__, part="0/1")
    lines = [
        "# Chebyshev coefficients of the factors on the estimates of an annular segment, made by",
        "# benchmarks/segment_table.py: shape, quantity, then one row for each order in the wall",
        "# ratio, with one column for each order in the chord angle (segment_torsion.py).",
    ]
    for shape in NODES:
        ratio, _, depth = places(shape)
        chosen.count = len(ratio)
        made = trials(lambda n, r=ratio, d=depth: {"values": analyse(r[n], d[n])}, chosen, shape)
        values = np.array([row["values"] for row in made])
        if chosen.part == "0/1":
            for quantity, table in fit(shape, values):
                lines += [
                    ",".join([shape, quantity, *(f"{number:.6f}" for number in row)])
                    for row in table
                ]
    if chosen.part == "0/1":
        TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
