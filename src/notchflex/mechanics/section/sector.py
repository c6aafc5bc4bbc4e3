r"""Annular sector: what an on-axis cut leaves, with radial cut edges.

The logarithm of the radius, $\xi = \ln(r/r_i)$ from 0 to $L = \ln(r_o/r_i)$, turns the sector
into a rectangle and leaves Laplace's equation as it is, so Saint-Venant's problem has a series
solution for every wall thickness and angle; the thin wall with corrected ends,
$J = 2amt^3/3 - 0.21\,t^4$ and $e = 2m(\sin a - a\cos a)/(a - \sin a\cos a)$, is its limit.
With $\lambda = n\pi/L$ and $\rho = r_o/r_i$, from the stress function (sine series over $\xi$)

$$J = \frac{16 r_i^4}{L}\sum_{n\ge1}\frac{[1 - (-1)^n\rho^2]^2}{(4+\lambda^2)^2}
\Big(a - \frac{\tanh\lambda a}{\lambda}\Big)$$

and from the warping function (cosine series), $e = \int\omega x\,dA / I$ with x sideways
(Trefftz),

$$eI = \frac{(r_o^2-r_i^2)(r_o^3-r_i^3)}{3L}(\sin a - a\cos a)
+ \frac{24 r_i^5}{L}\sum_{n\ge1}\frac{[1-(-1)^n\rho^2][1-(-1)^n\rho^3]}
{(4+\lambda^2)(9+\lambda^2)}\frac{\sin a - \cos a\tanh(\lambda a)/\lambda}{1+\lambda^2}.$$

Series derived for this program after the textbook case of the circular sector (Timoshenko and
Goodier, Theory of Elasticity, §109); checked against `sectionproperties` in the tests.

A laser that points at the tube axis while the tube turns leaves the wall within an angle
a = arccos((g − r_o) / r_o) on either side of the spine (Pacheco 2021; physics of the sector
after York 2015). Every depth opens the tube, even one that leaves part of the inner wall.
"""

from fractions import Fraction

import numpy as np

from notchflex._arrays import xp
from notchflex._jax import jax
from notchflex.mechanics.section.angles import cancelling_sum, half_angle
from notchflex.mechanics.section.section import Section, of_any_shape
from notchflex.mechanics.section.terms import broadcast_terms

_SUMMED = 24  # terms added one by one; even, so that odd and even terms pair up
_TAIL_NODES = 12


def _series_nodes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return index, parity and weight of the terms; the tail is integrated, not summed.

    Terms of one parity are smooth in n, and their sum beyond N is half of the integral from N
    (odd) or N + 1 (even) by the midpoint rule; the substitution n = N / u makes it a Gauss
    rule. With it slivers (a much less than the wall over the radius) keep their accuracy,
    where terms decay only as n⁻² up to n = L / a.
    """
    n = xp.arange(1, _SUMMED + 1)
    x, weight = np.polynomial.legendre.leggauss(_TAIL_NODES)
    u, weight = 0.5 * (1.0 + x), 0.5 * weight
    index, parity, weights = [n.astype(float)], [(-1.0) ** n], [xp.ones(_SUMMED)]
    for start, sign in ((_SUMMED, -1.0), (_SUMMED + 1, 1.0)):
        index.append(start / u)
        parity.append(xp.full(_TAIL_NODES, sign))
        weights.append(0.5 * weight * start / u**2)
    return xp.concatenate(index), xp.concatenate(parity), xp.concatenate(weights)


_INDEX, _PARITY, _WEIGHT = _series_nodes()


def sector_torsion_constant(outer: jax.Array, inner: jax.Array, angle: jax.Array) -> jax.Array:
    """Compute the Saint-Venant torsion constant of an annular sector.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm, greater than 0; of the same shape.
        angle: Half-angle a, rad, 0 < a ≤ π; of the same shape.

    Returns:
        Torsion constant, mm⁴. At a = π that of the slit tube.
    """
    n, parity, weight = (broadcast_terms(x, angle) for x in (_INDEX, _PARITY, _WEIGHT))
    outer, inner, angle = outer[None], inner[None], angle[None]
    length = xp.log(outer / inner)
    rate = n * xp.pi / length
    square = (inner**2 - parity * outer**2) ** 2 / (4.0 + rate**2) ** 2
    terms = square * (angle - xp.tanh(rate * angle) / rate)
    return xp.sum(16.0 * weight * terms / length, axis=0)


def sector_shear_centre(
    outer: jax.Array, inner: jax.Array, angle: jax.Array, bow: jax.Array, strong: jax.Array
) -> jax.Array:
    """Compute the distance from the tube axis to the shear centre of an annular sector.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm, greater than 0; of the same shape.
        angle: Half-angle a, rad, 0 < a ≤ π; of the same shape.
        bow: sin a − a cos a, without cancellation.
        strong: Second moment for bending sideways, mm⁴.

    Returns:
        Distance of the shear centre from the tube axis, toward the spine, mm. It lies outside
        the material, up to two mean radii from the axis.
    """
    n, parity, weight = (broadcast_terms(x, angle) for x in (_INDEX, _PARITY, _WEIGHT))
    outer_, inner_, angle_ = outer[None], inner[None], angle[None]
    length = xp.log(outer_ / inner_)
    rate = n * xp.pi / length
    radial = (inner_**2 - parity * outer_**2) * (inner_**3 - parity * outer_**3)
    radial = radial / ((4.0 + rate**2) * (9.0 + rate**2))
    around = xp.sin(angle_) - xp.cos(angle_) * xp.tanh(rate * angle_) / rate
    terms = 24.0 * weight / length * radial * around / (1.0 + rate**2)
    even = (outer**2 - inner**2) * (outer**3 - inner**3) / (3.0 * xp.log(outer / inner)) * bow
    return (even + xp.sum(terms, axis=0)) / strong


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
        edge_across=xp.where(cosine > 0.0, inner, outer) * sine,
        outer_radius=outer,
        half_angle=a,
    )


_section = of_any_shape(_properties)
