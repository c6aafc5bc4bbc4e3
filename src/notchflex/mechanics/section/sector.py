"""Annular sector: what an on-axis cut leaves, with radial cut edges.

A laser that points at the tube axis while the tube turns leaves the wall within an angle
a = arccos((g − r_o) / r_o) on either side of the spine (Pacheco 2021; physics of the sector
after York 2015). Every depth opens the tube, even one that leaves part of the inner wall.
"""

from fractions import Fraction

from notchflex._jax import array_module, jax
from notchflex.mechanics.section.angles import cancelling_sum, half_angle
from notchflex.mechanics.section.section import Section, plain_or_compiled
from notchflex.mechanics.section.sector_torsion import sector_shear_centre, sector_torsion_constant

# a − sin a cos a
_angle_minus = cancelling_sum([(1, 1, "cos", 0), (Fraction(-1, 2), 0, "sin", 2)])
# a² (⟨cos²⟩ − ⟨cos⟩²) over −a … a, that is a²/2 + a sin a cos a / 2 − sin² a
_spread = cancelling_sum(
    [
        (Fraction(1, 2), 2, "cos", 0),
        (Fraction(1, 4), 1, "sin", 2),
        (Fraction(-1, 2), 0, "cos", 0),
        (Fraction(1, 2), 0, "cos", 2),
    ]
)
# sin a − a cos a
_bow = cancelling_sum([(1, 0, "sin", 1), (-1, 1, "cos", 1)])
# a − sin a
_sag = cancelling_sum([(1, 1, "cos", 0), (-1, 0, "sin", 1)])


def annular_sector(
    outer_radius: jax.typing.ArrayLike,
    inner_radius: jax.typing.ArrayLike,
    depth: jax.typing.ArrayLike,
) -> Section:
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
    return _section(outer_radius, inner_radius, depth)


def _properties(outer: jax.Array, inner: jax.Array, depth: jax.Array) -> Section:
    """Compute all properties of arrays of one shape."""
    xp = array_module(outer)
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
    weak = area * (radius_spread * cosine_square + radius_mean**2 * _spread(a) / a**2)
    strong = 0.25 * polar * _angle_minus(a)

    # The farthest fibre on the cut side: the inner edge of the cut, or the outer one past the
    # axis. Both sums below are without cancellation: ȳ − r_i cos a, and r_o − ȳ.
    inner_edge = (wall / 2.0 + wall**2 / (12.0 * mean)) * sine / a + inner * _bow(a) / a
    outer_edge = centroid - outer * cosine
    edge_near = xp.where(cosine > 0.0, inner_edge, outer_edge)
    edge_spine = wall / 2.0 - wall**2 / (12.0 * mean) + radius_mean * _sag(a) / a
    return Section(
        area=area,
        centroid=centroid,
        second_moment_weak=weak,
        second_moment_strong=strong,
        torsion_constant=sector_torsion_constant(outer, inner, a),
        shear_centre=sector_shear_centre(outer, inner, a, _bow(a), strong),
        edge_near=edge_near,
        edge_spine=edge_spine,
    )


_section = plain_or_compiled(_properties)
