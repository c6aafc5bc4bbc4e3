"""Annular segment: what an off-axis cut leaves, with one flat cut plane.

A saw or wire across the tube leaves everything beyond the plane at y = d = g − r_o from the
tube axis (York 2015, Swaney 2017). Three shapes follow, as d passes the inner wall at −r_i and
at r_i: a closed tube with a flat, an open arc with bevelled ends, a solid segment of the wall.
"""

from fractions import Fraction

from notchflex._jax import array_module, jax
from notchflex.mechanics.section.angles import cancelling_sum, half_angle
from notchflex.mechanics.section.section import Section, plain_or_compiled
from notchflex.mechanics.section.segment_torsion import segment_torsion

# Moments of a segment of the unit circle beyond the chord at height cos α, w measured from the
# chord: ∫dA, ∫w dA, ∫w² dA, ∫x² dA. (The forms about the circle's centre lose all digits for
# small α: the last three are of order α⁵, α⁷, α⁵.)
_area = cancelling_sum([(1, 1, "cos", 0), (Fraction(-1, 2), 0, "sin", 2)])
_first = cancelling_sum(
    [(Fraction(3, 4), 0, "sin", 1), (Fraction(1, 12), 0, "sin", 3), (-1, 1, "cos", 1)]
)
_second = cancelling_sum(
    [
        (Fraction(3, 4), 1, "cos", 0),
        (Fraction(1, 2), 1, "cos", 2),
        (Fraction(-7, 12), 0, "sin", 2),
        (Fraction(-1, 48), 0, "sin", 4),
    ]
)
_sideways = cancelling_sum(
    [(Fraction(1, 4), 1, "cos", 0), (Fraction(-1, 6), 0, "sin", 2), (Fraction(1, 48), 0, "sin", 4)]
)


def annular_segment(
    outer_radius: jax.typing.ArrayLike,
    inner_radius: jax.typing.ArrayLike,
    depth: jax.typing.ArrayLike,
) -> Section:
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
    return _section(outer_radius, inner_radius, depth)


def _properties(outer: jax.Array, inner: jax.Array, depth: jax.Array) -> Section:
    """Compute all properties of arrays of one shape."""
    xp = array_module(outer)
    left = 2.0 * outer - depth  # from the cut plane to the outer surface of the spine
    plane = depth - outer  # d
    alpha = half_angle(outer, left, depth)
    beta = half_angle(inner, inner - plane, inner + plane)

    # A bore that the plane does not reach lies this far above it.
    lift = xp.maximum(-(inner + plane), 0.0)
    bore_area = inner**2 * _area(beta)
    bore_first = inner**3 * _first(beta)
    bore_second = inner**4 * _second(beta) + lift * (2.0 * bore_first + lift * bore_area)

    area = outer**2 * _area(alpha) - bore_area
    first = outer**3 * _first(alpha) - (bore_first + lift * bore_area)
    second = outer**4 * _second(alpha) - bore_second
    from_plane = first / area
    weak = second - first * from_plane
    strong = outer**4 * _sideways(alpha) - inner**4 * _sideways(beta)

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
    )


_section = plain_or_compiled(_properties)
