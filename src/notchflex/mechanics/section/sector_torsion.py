r"""Torsion constant and shear centre of an annular sector, exactly.

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
"""

import numpy as np

from notchflex._jax import array_module, jax
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
    n = np.arange(1, _SUMMED + 1)
    x, weight = np.polynomial.legendre.leggauss(_TAIL_NODES)
    u, weight = 0.5 * (1.0 + x), 0.5 * weight
    index, parity, weights = [n.astype(float)], [(-1.0) ** n], [np.ones(_SUMMED)]
    for start, sign in ((_SUMMED, -1.0), (_SUMMED + 1, 1.0)):
        index.append(start / u)
        parity.append(np.full(_TAIL_NODES, sign))
        weights.append(0.5 * weight * start / u**2)
    return np.concatenate(index), np.concatenate(parity), np.concatenate(weights)


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
    xp = array_module(outer)
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
    xp = array_module(outer)
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
