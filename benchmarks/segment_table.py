"""Make segment_table.csv of notchflex.mechanics with sectionproperties (half an hour).

    python benchmarks/segment_table.py --raw FILE     # writes the table
    python benchmarks/segment_table.py 0.864 0.7      # prints one section: r_i, depth over r_o

Torsion constant and (Trefftz) shear centre of the annular segment of outer radius 1 at Chebyshev
nodes of the coordinates that `segment_torsion.py` there interpolates over, by warping analysis with
quadratic triangles, three across the wall and smaller where it tapers. Divided by the estimates of
`segment_estimates` and fitted by least squares, on 2 cores. FILE keeps the values of the analysis:
a second run only fits, or goes on where the mesher crashed.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from sectionproperties.analysis import Section
from sectionproperties.pre import Geometry
from shapely import Polygon, affinity

TABLE = Path(__file__).parents[1] / "src/notchflex/mechanics/segment_table.csv"
LAYERS = 3  # elements across the wall
COARSEST = 0.1  # size of an element over the outer radius
NODES = {"closed": (9, 16), "open": (9, 20), "solid": (1, 12)}  # ratios, chord angles
ORDERS = {"closed": (7, 11), "open": (8, 16), "solid": (0, 8)}  # highest of the polynomials
SHEAR_NOISE = (
    3e-3  # over the outer radius: a shear centre this near the axis weighs half in the fit
)


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
    from notchflex.mechanics.cuts import CHORD_RANGE, RATIO_RANGE

    def nodes(count, low, high):
        x = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        return 0.5 * (low + high) + 0.5 * (high - low) * x

    many, along = NODES[shape]
    roots = nodes(many, *(np.sqrt(1.0 - ratio) for ratio in reversed(RATIO_RANGE)))
    root, angle = (a.ravel() for a in np.meshgrid(roots, nodes(along, *CHORD_RANGE[shape])))
    ratio = 1.0 - root**2
    if shape == "closed":
        return ratio, angle, (1.0 - ratio) * np.cos(angle / 2.0) ** 2
    if shape == "open":
        return ratio, angle, 1.0 + ratio * np.cos(angle)
    # A solid segment of a tube whose bore the plane does not reach: the ratio has no effect.
    return np.minimum(ratio, np.cos(angle)), angle, 1.0 + np.cos(angle)


def analyse_all(raw):
    """Analyse every node that the file does not hold yet; return shape -> (J, e)."""
    done = {}
    if raw.exists():
        for line in raw.read_text().splitlines():
            shape, *numbers = line.split(",")
            done[shape, *map(float, numbers[:2])] = tuple(map(float, numbers[2:]))
    wanted = [(s, float(r), float(d)) for s in NODES for r, _, d in zip(*places(s), strict=True)]
    missing = [key for key in wanted if key not in done]
    with ProcessPoolExecutor(2, get_context("spawn")) as pool, raw.open("a") as file:
        jobs = {key: pool.submit(analyse, *key[1:]) for key in missing}
        for key, job in jobs.items():
            done[key] = job.result()
            file.write(",".join([key[0], *map(repr, (*key[1:], *map(float, done[key])))]) + "\n")
            file.flush()
    return {s: np.array([done[key] for key in wanted if key[0] == s]) for s in NODES}


def fit(shape, values):
    """Fit the factors: coefficients and largest relative residual of J and e."""
    from notchflex._jax import jnp
    from notchflex.mechanics import cuts as segment_estimates
    from notchflex.mechanics.cuts import CHORD_RANGE, RATIO_RANGE, annular_segment

    ratio, angle, depth = places(shape)
    one = jnp.ones(len(ratio))
    inner, cut = jnp.asarray(ratio), jnp.asarray(depth)
    area = annular_segment(one, inner, cut).area
    estimate = {
        "closed": lambda: segment_estimates.closed_estimate(one, inner, cut),
        "open": lambda: segment_estimates.open_estimate(one, inner, cut, area),
        "solid": lambda: (area * (2.0 * one - cut) ** 2 / 3.0, one),
    }[shape]()
    low, high = (np.sqrt(1.0 - r) for r in reversed(RATIO_RANGE))
    x = (2.0 * np.sqrt(1.0 - ratio) - low - high) / (high - low)
    low, high = CHORD_RANGE[shape]
    y = (2.0 * angle - low - high) / (high - low)
    orders = ORDERS[shape]
    matrix = np.polynomial.chebyshev.chebvander2d(x, y, orders)
    found = []
    for value, guess, noise in zip(
        values.T, map(np.asarray, estimate), (0, SHEAR_NOISE), strict=True
    ):
        weight = guess / (np.abs(guess) + noise)
        factor = value / guess
        solution = np.linalg.lstsq(matrix * weight[:, None], factor * weight, rcond=None)[0]
        worst = np.max(np.abs((matrix @ solution - factor) * weight / factor))
        found.append((solution.reshape(np.array(orders) + 1), worst))
    return found


def main(raw):
    """Analyse, fit and write the table."""
    values = analyse_all(raw)
    lines = [
        "# Chebyshev coefficients of the factors on the estimates of an annular segment, made by",
        "# benchmarks/segment_table.py: shape, quantity, then one row for each order in the wall",
        "# ratio, with one column for each order in the chord angle (segment_torsion.py).",
    ]
    for shape in NODES:
        for quantity, (table, worst) in zip(
            ("torsion", "shear"), fit(shape, values[shape]), strict=True
        ):
            print(f"{shape} {quantity}: largest relative residual {worst:.1e}")
            for row in table:
                lines.append(",".join([shape, quantity, *(f"{c:.6f}" for c in row)]))
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1] == "--raw":
        main(Path(sys.argv[2]))
    else:
        print("torsion constant, shear centre over r_o:", *analyse(*map(float, sys.argv[1:])))
