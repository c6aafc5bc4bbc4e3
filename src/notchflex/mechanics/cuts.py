"""What each cut of an asymmetric notch leaves of a tube: its section, and the fibres of it."""

from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from jaxtyping import Array
from numpy.typing import ArrayLike

from notchflex._arrays import cached, xp
from notchflex._jax import constant
from notchflex.mechanics.section import (
    FIBRES,
    Points,
    Section,
    broadcast_terms,
    gauss_on,
    gauss_rule,
    half_angle,
    leggauss,
    of_any_shape,
)

# Annular sector: what an on-axis cut leaves, with radial cut edges.
#
# A laser that points at the tube axis while the tube turns leaves the wall within an angle
# a = arccos((g − r_o) / r_o) on either side of the spine (Pacheco 2021; physics of the sector
# after York 2015). Every depth opens the tube, even one that leaves part of the inner wall.
#
# The logarithm of the radius, $\xi = \ln(r/r_i)$ from 0 to $L = \ln(r_o/r_i)$, turns the sector
# into a rectangle and leaves Laplace's equation as it is, so Saint-Venant's problem has a series
# solution for every wall thickness and angle; the thin wall with corrected ends,
# $J = 2amt^3/3 - 0.21\,t^4$ and $e = 2m(\sin a - a\cos a)/(a - \sin a\cos a)$, is its limit.
# With $\lambda = n\pi/L$ and $\rho = r_o/r_i$, from the stress function (sine series over $\xi$)
#
# $$J = \frac{16 r_i^4}{L}\sum_{n\ge1}\frac{[1 - (-1)^n\rho^2]^2}{(4+\lambda^2)^2}
# \Big(a - \frac{\tanh\lambda a}{\lambda}\Big)$$
#
# and from the warping function (cosine series), $e = \int\omega x\,dA / I$ with x sideways
# (Trefftz),
#
# $$eI = \frac{(r_o^2-r_i^2)(r_o^3-r_i^3)}{3L}(\sin a - a\cos a)
# + \frac{24 r_i^5}{L}\sum_{n\ge1}\frac{[1-(-1)^n\rho^2][1-(-1)^n\rho^3]}
# {(4+\lambda^2)(9+\lambda^2)}\frac{\sin a - \cos a\tanh(\lambda a)/\lambda}{1+\lambda^2}.$$
#
# Series derived for this program after the textbook case of the circular sector (Timoshenko and
# Goodier, Theory of Elasticity, §109); checked against `sectionproperties` in the tests.


def _series_nodes() -> tuple[Array, Array, Array]:
    """Return index, parity and weight of the terms; the tail is integrated, not summed."""
    # Terms of one parity are smooth in n, and their sum beyond N = 24 is half of the integral from
    # N (odd) or N + 1 (even) by the midpoint rule; the substitution n = N / u makes it a Gauss
    # rule. With it slivers (a much less than the wall over the radius) keep their accuracy,
    # where terms decay only as n⁻² up to n = L / a.
    n = xp.arange(1.0, 25.0)
    u, weight = gauss_on(0.0, 1.0, 12)
    index, parity, weights = [n], [(-1.0) ** n], [xp.ones(24)]
    for start, sign in ((24.0, -1.0), (25.0, 1.0)):
        index.append(start / u)
        parity.append(xp.full(12, sign))
        weights.append(0.5 * weight * start / u**2)
    return xp.concatenate(index), xp.concatenate(parity), xp.concatenate(weights)


_INDEX, _PARITY, _WEIGHT = _series_nodes()


def sector_torsion(
    outer: Array, inner: Array, angle: Array, bow: Array, strong: Array
) -> tuple[Array, Array]:
    """Compute the torsion constant (mm⁴) and the shear centre (mm) of an annular sector."""
    # With its half angle a, sin a − a cos a without cancellation, and the second moment for bending
    # sideways. At a = π the constant is that of the slit tube; the shear centre lies outside the
    # material, up to two mean radii from the axis.
    n, parity, weight = (broadcast_terms(x, angle) for x in (_INDEX, _PARITY, _WEIGHT))
    r_o, r_i, a = outer[None], inner[None], angle[None]
    length = xp.log(r_o / r_i)
    rate = n * xp.pi / length
    tangent, difference = xp.tanh(rate * a), r_i**2 - parity * r_o**2
    square = difference**2 / (4.0 + rate**2) ** 2
    torsion = xp.sum(16.0 * weight * (square * (a - tangent / rate)) / length, axis=0)
    radial = difference * (r_i**3 - parity * r_o**3) / ((4.0 + rate**2) * (9.0 + rate**2))
    around = xp.sin(a) - xp.cos(a) * tangent / rate
    terms = 24.0 * weight / length * radial * around / (1.0 + rate**2)
    even = (outer**2 - inner**2) * (outer**3 - inner**3) / (3.0 * xp.log(outer / inner)) * bow
    return torsion, (even + xp.sum(terms, axis=0)) / strong


@of_any_shape
def annular_sector(outer_radius: ArrayLike, inner_radius: ArrayLike, depth: ArrayLike) -> Section:
    r"""Compute the section that an on-axis cut leaves of a tube.

    With the half-angle $a = \arccos((g - r_o)/r_o)$, the mean radius $m$, the wall $t$,
    $\langle r\rangle = m + t^2/12m$ and
    $\langle r^2\rangle - \langle r\rangle^2 = t^2/12\,(1 - t^2/12m^2)$:

    $$A = 2amt,\quad \bar y = \langle r\rangle\frac{\sin a}{a},\quad
    I = A\,[(\langle r^2\rangle - \langle r\rangle^2)\langle\cos^2\rangle
    + \langle r\rangle^2(\langle\cos^2\rangle - \langle\cos\rangle^2)]$$

    which is $\frac14(r_o^4 - r_i^4)(a + \sin a\cos a) - A\bar y^2$ written without the
    cancellation. Sideways $I = \frac14(r_o^4 - r_i^4)(a - \sin a\cos a)$. Torsion constant and
    shear centre are exact series, see `sector_torsion`.

    Every depth opens the tube: for g → 0 area and second moments tend to those of the full
    tube, the torsion constant to that of the slit tube.

    Args:
        outer_radius: Outer radius r_o of the tube, mm; any shape.
        inner_radius: Inner radius r_i, 0 < r_i < r_o, mm; broadcast with the others.
        depth: Depth g of the cut, measured from the outer surface opposite the spine,
            0 < g < 2 r_o, mm. Values outside give no error (they may be traced) but no
            sensible numbers either; a robot file refuses them.

    Returns:
        The section, every field of the common shape. Derivatives are finite for every depth
        inside the range; `edge_near` has a kink where the cut reaches the tube axis.

    Reference:
        P. York et al., "A wrist for needle-sized surgical robots", ICRA 2015;
        N. Pacheco et al., J. Med. Robot. Res. 6, 2140004 (2021).

    Example:
        >>> section = annular_sector(0.81, 0.70, 1.40)
        >>> print(f"{section.area:.6f} mm², {section.centroid:.6f} mm")
        0.125376 mm², 0.686533 mm
    """
    outer, inner, depth = map(constant, (outer_radius, inner_radius, depth))
    left = 2.0 * outer - depth  # from the cut plane to the outer surface of the spine
    a = half_angle(outer, left, depth)
    # Sine and cosine from the lengths: exact to rounding also near a = π.
    sine = xp.sqrt(left * depth) / outer
    cosine = (depth - outer) / outer

    mean = 0.5 * (outer + inner)
    wall = outer - inner
    area = 2.0 * a * mean * wall
    radius_mean = mean + wall**2 / (12.0 * mean)  # ⟨r⟩ over the wall, weighted by area
    radius_spread = wall**2 / 12.0 * (1.0 - wall**2 / (12.0 * mean**2))  # ⟨r²⟩ − ⟨r⟩²
    polar = 4.0 * mean * wall * (mean**2 + 0.25 * wall**2)  # r_o⁴ − r_i⁴

    centroid = radius_mean * sine / a
    cosine_square = 0.5 * (1.0 + sine * cosine / a)
    # Integrals without negative terms: closed forms lose digits at small angles.
    angle, step = gauss_on(0.0, a[..., None])
    versine = 2.0 * xp.sin(0.5 * angle) ** 2
    bow = xp.sum(angle * xp.sin(angle) * step, axis=-1)  # sin a − a cos a
    sag = xp.sum(versine * step, axis=-1) / a  # 1 − sin a / a
    # ⟨cos²⟩ − ⟨cos⟩²
    cosine_spread = xp.sum((sag[..., None] - versine) ** 2 * step, axis=-1) / a
    weak = area * (radius_spread * cosine_square + radius_mean**2 * cosine_spread)
    strong = 0.5 * polar * xp.sum(xp.sin(angle) ** 2 * step, axis=-1)

    # The farthest fibre on the cut side: the inner edge of the cut, or the outer one past the
    # axis. Both sums below are without cancellation: ȳ − r_i cos a, and r_o − ȳ.
    inner_edge = (wall / 2.0 + wall**2 / (12.0 * mean)) * sine / a + inner * bow / a
    outer_edge = centroid - outer * cosine
    edge_near = xp.where(cosine > 0.0, inner_edge, outer_edge)
    edge_spine = wall / 2.0 - wall**2 / (12.0 * mean) + radius_mean * sag
    torsion_constant, shear_centre = sector_torsion(outer, inner, a, bow, strong)
    return Section(
        area=area,
        centroid=centroid,
        second_moment_weak=weak,
        second_moment_strong=strong,
        torsion_constant=torsion_constant,
        shear_centre=shear_centre,
        edge_near=edge_near,
        edge_spine=edge_spine,
        edge_across=xp.where(cosine > 0.0, inner, outer) * sine,
        outer_radius=outer,
        half_angle=a,
    )


# Annular segment: what an off-axis cut leaves, with one flat cut plane.
#
# A saw or wire across the tube leaves everything beyond the plane at y = d = g − r_o from the
# tube axis (York 2015, Swaney 2017). Three shapes follow, as d passes the inner wall at −r_i and
# at r_i: a closed tube with a flat, an open arc with bevelled ends, a solid segment of the wall.
#
# There is no closed form of the torsion. A simple estimate for each of the three shapes has the
# right form (Bredt's closed tube, the thin open arc, the flat solid), so that the factor on it is
# smooth and of the order of one (`segment_torsion`). `benchmarks/segment_table.py` computed it once
# with `sectionproperties` (warping analysis) and fitted it with Chebyshev polynomials in two
# coordinates: √(1 − r_i/r_o), and the angle of the chord that the cut plane makes.
#
# The table covers 0.2 ≤ r_i/r_o ≤ 0.98 for every depth of the open arc, the solid segment down to
# a height of 0.005 r_o, and the closed tube as long as 1 % of the wall is left under the flat;
# beyond, the factors keep their value at its edge (right for slivers, not checked for the rest).
# Measured against other meshes of `sectionproperties`: torsion constant within 0.2 %; shear centre
# within 0.1 % open or solid and 1 % closed, where a barely cut tube has it nearly on the axis.


def closed_estimate(outer: Array, inner: Array, depth: Array) -> tuple[Array, Array]:
    """Estimate the closed tube with a flat after Bredt."""
    # $J \approx 4A_m^2/C + \int t^3 ds/3$ with $C = \oint ds/t$. Under the flat, within an angle
    # b of the middle of the cut, the wall is $|d|/\cos\varphi - r_i$ thick, which integrates in
    # closed form. The part f of C that the flat adds moves the shear centre from the tube axis
    # to $2mf$; with f = 1 this is that of a slit tube.
    mean, wall = 0.5 * (outer + inner), outer - inner
    height = outer - depth  # |d|, from the tube axis to the flat
    tangent = xp.sqrt(depth / (2.0 * outer - depth))  # tan(b / 2)
    flat = 2.0 * xp.arctan(tangent)
    above, below = height + inner, height - inner
    thin = 4.0 * height / xp.sqrt(above * below) * xp.arctan(xp.sqrt(above / below) * tangent)
    round_part = 2.0 * (xp.pi - flat)
    flexibility = thin - flat + round_part * mean / wall
    inside_outer = outer**2 * (xp.pi - flat) + height * xp.sqrt(depth * (2.0 * outer - depth))
    enclosed = 0.5 * (inside_outer + xp.pi * inner**2)
    torsion = 4.0 * enclosed**2 / flexibility + round_part * mean * wall**3 / 3.0
    added = 1.0 - 2.0 * xp.pi * mean / wall / flexibility
    return torsion, 2.0 * mean * added


def open_estimate(outer: Array, inner: Array, depth: Array, area: Array) -> tuple[Array, Array]:
    """Estimate the open arc: J = A t²/3 and the shear centre of the thin arc."""
    mean, wall = 0.5 * (outer + inner), outer - inner
    a = half_angle(mean, mean + outer - depth, mean - outer + depth)
    sine, cosine = xp.sin(a), xp.cos(a)
    shear = 2.0 * mean * (sine - a * cosine) / (a - sine * cosine)
    return area * wall**2 / 3.0, shear


# Where the factors were computed; benchmarks/segment_table.py reads these.
RATIO_RANGE = (0.2, 0.98)  # r_i / r_o
LIGAMENT_LEFT = 0.01  # least thickness left under the flat of a closed tube, over the wall
CHORD_RANGE = {  # of the angle in rad, see `chord_angle`
    "closed": (2.0 * xp.arcsin(xp.sqrt(LIGAMENT_LEFT)), np.pi),
    "open": (0.0, np.pi),
    "solid": (0.1, np.pi / 2.0),
}


@cache
def _read_table() -> dict[tuple[str, str], Array]:
    """Read the coefficients, by shape and quantity, shape (ratio orders, angle orders)."""
    text = (files("notchflex.mechanics") / "segment_table.csv").read_text(encoding="utf-8")
    table: dict[tuple[str, str], list[list[float]]] = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            shape, quantity, *coefficients = line.split(",")
            table.setdefault((shape, quantity), []).append([float(c) for c in coefficients])
    return {key: xp.array(rows) for key, rows in table.items()}


def _chebyshev(count: int, value: Array, low: float, high: float) -> Array:
    """Evaluate the first Chebyshev polynomials (count, …), constant outside low … high."""
    # The ends are moved in by 1e-12, because the arccosine has no derivative there.
    x = (2.0 * value - low - high) / (high - low)
    x = xp.clip(x, -1.0 + 1e-12, 1.0 - 1e-12)
    return xp.cos(broadcast_terms(xp.arange(count, dtype=float), x) * xp.arccos(x)[None])


def chord_angle(shape: str, outer: Array, inner: Array, depth: Array) -> Array:
    """Return the table's coordinate along the depth, an angle in rad."""
    if shape == "closed":
        return half_angle(outer, outer - inner - depth, depth)
    if shape == "open":
        return half_angle(inner, inner + outer - depth, inner - outer + depth)
    return half_angle(outer, 2.0 * outer - depth, depth)


def segment_torsion(outer: Array, inner: Array, depth: Array, area: Array) -> tuple[Array, Array]:
    """Compute torsion constant and shear centre of an annular segment."""
    wall, plane = outer - inner, depth - outer
    closed = (plane < -inner) & (depth < wall)  # both: they may differ by rounding
    solid = plane >= inner
    # All three are computed; outside its own range each one gets a depth in the middle of it,
    # so that no derivative becomes NaN.
    shallow = xp.where(closed, depth, 0.5 * wall)
    through = xp.where(closed | solid, outer, depth)
    deep = xp.where(solid, depth, outer + inner)

    low, high = (float(xp.sqrt(1.0 - ratio)) for ratio in reversed(RATIO_RANGE))
    table = _read_table()

    def estimated(shape: str, cut: Array, torsion: Array, shear: Array) -> Array:
        """Multiply both estimates by the factors that the table has for them."""
        both = xp.stack([table[shape, "torsion"], table[shape, "shear"]])
        _, rows, columns = both.shape
        across = _chebyshev(rows, xp.sqrt(1.0 - inner / outer), low, high)
        chord = chord_angle(shape, outer, inner, cut)
        along = _chebyshev(columns, chord, *map(float, CHORD_RANGE[shape]))
        factors = xp.einsum("kpq,p...,q...->k...", both, across, along)
        return xp.stack([torsion, shear]) * factors

    # Of a solid segment J = A h²/3, and the top of the circle.
    of_solid = estimated("solid", deep, area * (2.0 * outer - deep) ** 2 / 3.0, outer)
    of_open = estimated("open", through, *open_estimate(outer, inner, through, area))
    of_closed = estimated("closed", shallow, *closed_estimate(outer, inner, shallow))
    torsion, shear = xp.where(closed[None], of_closed, xp.where(solid[None], of_solid, of_open))
    return torsion, shear


def segment_moments(radius: Array, angle: Array, lift: Array) -> list[Array]:
    """Integrate 1, w, w² and x² over a segment of a circle, w from `lift` below its chord."""
    # By strips across at r cos φ. No term is negative: closed forms lose digits at small angles.
    radius, end = radius[..., None], angle[..., None]
    place, width = gauss_on(0.0, end)
    half_chord = radius * xp.sin(place)
    above_chord = 2.0 * radius * xp.sin(0.5 * (end + place)) * xp.sin(0.5 * (end - place))
    strips, height = 2.0 * half_chord**2 * width, lift[..., None] + above_chord
    terms = strips, strips * height, strips * height**2, strips * half_chord**2 / 3.0
    return [xp.sum(term, axis=-1) for term in terms]


@of_any_shape
def annular_segment(outer_radius: ArrayLike, inner_radius: ArrayLike, depth: ArrayLike) -> Section:
    r"""Compute the section that an off-axis cut leaves of a tube.

    The section is a segment of the outer circle less a segment of the inner one. With the
    half-angles $\alpha_r = \arccos(d/r)$, clipped to 0 … π, the moments of each about the cut
    plane are

    $$A_r = r^2(\alpha - \tfrac12\sin2\alpha),\quad
    Q_r = r^3(\tfrac34\sin\alpha + \tfrac1{12}\sin3\alpha - \alpha\cos\alpha),\quad
    J_r = r^4(\tfrac34\alpha + \tfrac12\alpha\cos2\alpha - \tfrac7{12}\sin2\alpha
    - \tfrac1{48}\sin4\alpha)$$

    and $I = J - Q^2/A$ of their differences; these are York's formulas moved to the cut plane,
    where they keep their digits. Sideways
    $\frac{r^4}{12}(3\alpha - 3\sin\alpha\cos\alpha - 2\sin^3\alpha\cos\alpha)$.

    The torsion constant drops by two or three orders of magnitude where the cut plane reaches the
    inner wall, g = r_o − r_i, and opens the tube. On the closed side it falls as the square
    root of the thickness that is left under the flat, half of it being lost at about
    (r_o − r_i)²/(r_o + r_i); the slope there is unbounded. Take it for a jump: either side has
    its own law, see `segment_torsion`, and at the very place that of the open one holds.

    Args:
        outer_radius: Outer radius r_o of the tube, mm; any shape.
        inner_radius: Inner radius r_i, 0 < r_i < r_o, mm; broadcast with the others.
        depth: Depth g of the cut, measured from the outer surface opposite the spine,
            0 < g < 2 r_o, mm. Values outside give no error (they may be traced) but no
            sensible numbers either; a robot file refuses them.

    Returns:
        The section, every field of the common shape. Derivatives are finite for every depth
        inside the range.

    Reference:
        P. York et al., "A wrist for needle-sized surgical robots", ICRA 2015;
        P. Swaney et al., J. Med. Devices 11, 014501 (2017).

    Example:
        >>> section = annular_segment(0.81, 0.70, 1.40)
        >>> print(f"{section.area:.6f} mm², {section.centroid:.6f} mm")
        0.111621 mm², 0.701661 mm
    """
    outer, inner, depth = map(constant, (outer_radius, inner_radius, depth))
    left = 2.0 * outer - depth  # from the cut plane to the outer surface of the spine
    plane = depth - outer  # d
    alpha = half_angle(outer, left, depth)
    beta = half_angle(inner, inner - plane, inner + plane)

    # A bore that the plane does not reach lies this far above it.
    lift = xp.maximum(-(inner + plane), 0.0)
    disc = segment_moments(outer, alpha, 0.0 * depth)
    bore = segment_moments(inner, beta, lift)
    area, first, second, strong = (x - y for x, y in zip(disc, bore, strict=True))
    from_plane = first / area
    weak = second - first * from_plane

    # Half chords x_o, x_i give the first moment about the tube axis, ⅔(x_o³ − x_i³), without
    # cancellation for shallow cuts; where both are there, x_o² − x_i² = r_o² − r_i².
    outer_square = left * depth
    chord_outer = xp.sqrt(outer_square)
    is_cut = xp.abs(plane) < inner
    inner_square = (inner - plane) * (inner + plane)
    chord_inner = xp.where(is_cut, xp.sqrt(xp.where(is_cut, inner_square, 1.0)), 0.0)
    gap_square = xp.where(is_cut, (outer - inner) * (outer + inner), outer_square)
    cubes = (
        gap_square
        * (outer_square + chord_outer * chord_inner + chord_inner**2)
        / (chord_outer + chord_inner)
    )
    centroid = 2.0 / 3.0 * cubes / area

    torsion_constant, shear_centre = segment_torsion(outer, inner, depth, area)
    return Section(
        area=area,
        centroid=centroid,
        second_moment_weak=weak,
        second_moment_strong=strong,
        torsion_constant=torsion_constant,
        shear_centre=shear_centre,
        edge_near=from_plane,
        edge_spine=left - from_plane,
        edge_across=chord_outer,
        outer_radius=outer,
        half_angle=alpha,
    )


@cached(1024)  # the same for all sites and heights
def cut_fibres(cut: str, outer: float, inner: float, depth: float, count: int) -> Points:
    """Few fibres of what a cut leaves of a tube."""
    return gauss_rule(*STRIPS_OF_CUT[cut](outer, inner, depth, count), count)


# Strips from the axis of symmetry to the edge, by Green's theorem: the integral of f(y) over the
# section is that of 2 x f(y) dy around it. What is not of the section has areas below 0; with that,
# the strips are as smooth as the edges, whatever the depth.


def _arcs(radii: Any, angles: Any, count: int) -> Points:
    """Divide segments of the outer circle and of the inner one, by their half angles."""
    # The upper half of an even rule: arms are even in the angle.
    part, width = (values[None, 2 * count :] for values in leggauss(4 * count))
    radius, end = (xp.stack(pair)[:, None] for pair in (radii, angles))
    angle = end * part
    area = np.array([[2.0], [-2.0]]) * (radius * xp.sin(angle)) ** 2 * end * width
    return (radius * xp.cos(angle)).ravel(), area.ravel()


def sector_fibres(outer: float, inner: float, depth: float, count: int = FIBRES) -> Points:
    """Divide an annular sector (`annular_sector`)."""
    half = half_angle(*map(constant, (outer, 2.0 * outer - depth, depth)))
    arm, area = _arcs((outer, inner), (half, half), count)
    edge, width = gauss_on(inner, outer, 2 * count)
    of_edge = 2.0 * edge * xp.sin(half) * xp.cos(half) * width
    return xp.append(arm, edge * xp.cos(half)), xp.append(area, of_edge)


def segment_fibres(outer: float, inner: float, depth: float, count: int = FIBRES) -> Points:
    """Divide an annular segment (`annular_segment`)."""
    angles = [
        half_angle(*map(constant, (radius, radius + outer - depth, radius - outer + depth)))
        for radius in (outer, inner)
    ]
    arm, area = _arcs((outer, inner), angles, count)
    return xp.maximum(arm, depth - outer), area  # of a bore beyond the cut nothing is left


STRIPS_OF_CUT = {"on-axis": sector_fibres, "off-axis": segment_fibres}


SECTION_OF_CUT = {"on-axis": annular_sector, "off-axis": annular_segment}
