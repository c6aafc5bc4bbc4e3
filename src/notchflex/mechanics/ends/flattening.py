r"""How a notch softens as it closes: its curved spine flattens.

The moment at an angle θ is $M = K_0\theta/q^2$ with $q = 1 + \alpha\theta/2 + \beta\theta^2/2$.
β is Brazier's flattening of an arc with free edges, α the anticlastic one (odd in θ: closing
softens, opening stiffens) and what the ring imposes on the arc at the edges of the notch.

With $b = \alpha/2$, $e = \beta/2$, $D = 4e - b^2$ the moment is the derivative of the potential

$$U = K_0\Big[\frac2D - \frac{2 + b\theta}{Dq} - \frac bD\,(F(\theta) - F(0))\Big],\qquad
F = \frac2{\sqrt D}\arctan\frac{2e\theta + b}{\sqrt D},$$

and the tangent stiffness $K_0(1 - b\theta - 3e\theta^2)/q^3$ is zero at the limit point, beyond
which a constant moment closes the notch at once.
"""

from __future__ import annotations

import numpy as np

from notchflex._jax import array_module, jax
from notchflex.mechanics.section import Section

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)

# Fitted between notches: what a ring imposes at the edge, k = k0 (1 - exp(-(c / (c1 r))²)), and a
# factor on Brazier. First and last notches of wrists are met by the same numbers (6 % to closing).
_EDGE = (0.207, 1.69)
_BRAZIER = 0.97
# One notch alone between two clamped rings, as test specimens are.
_EDGE_OF_SPECIMEN, _BRAZIER_OF_SPECIMEN = (0.465, 1.51), 0.74


def _imposed(factor: float, decay: float, length: jax.Array, radius: jax.Array) -> jax.Array:
    """What a ring of some length imposes at the edge of the notch, k."""
    return -factor * array_module(length, radius).expm1(-((length / (decay * radius)) ** 2))


def edge_and_brazier(
    radius: jax.Array, lengths: tuple[jax.Array, jax.Array], boundaries: tuple[str, str]
) -> tuple[jax.Array, float]:
    """Average k over the two sides; with the factor c_b on Brazier's flattening.

    Args:
        radius: Mean radius r, mm.
        lengths: Uncut lengths of the two rings, mm.
        boundaries: Of the two rings.

    Returns:
        k and c_b.
    """
    specimen = boundaries == ("clamped", "clamped")
    edge = _EDGE_OF_SPECIMEN if specimen else _EDGE
    both = [_imposed(*edge, length, radius) for length in lengths]
    return 0.5 * (both[0] + both[1]), _BRAZIER_OF_SPECIMEN if specimen else _BRAZIER


def flattening_numbers(
    outer: jax.Array,
    inner: jax.Array,
    cut: str,
    depth: jax.Array,
    poisson_ratio: jax.Array,
    section: Section,
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Compute what the shape of the arc does to its flattening.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        cut: "on-axis" or "off-axis".
        depth: Depth of the cut, mm.
        poisson_ratio: Poisson's ratio ν.
        section: The section that the cut leaves.

    Returns:
        Half angle a_o of the arc on the outer surface, rad; φ, without unit; B, mm².
    """
    xp = array_module(outer, depth, poisson_ratio)
    radius, wall = 0.5 * (outer + inner), outer - inner
    outer_angle = xp.arccos((depth - outer) / outer)
    # An off-axis cut beyond the mean radius leaves no arc at mid-wall; `validity` says so.
    a = outer_angle
    if cut == "off-axis":
        a = xp.arccos(xp.minimum((depth - outer) / radius, 1.0 - 1e-9))
    angle = 0.5 * a * (1.0 + _NODES)
    slope = xp.sin(a) / a
    bent = (
        0.5 * (xp.sin(a) ** 2 + xp.sin(angle) ** 2)
        + slope * (xp.cos(a) - xp.cos(angle))
        - slope * angle * xp.sin(angle)
    )
    first, second = (0.5 * a * (moment @ _WEIGHTS) for moment in (bent, bent**2))
    weak = section.second_moment_weak
    phi = 2.0 * wall * radius**3 * xp.abs(first) / weak
    brazier = 48.0 * (1.0 - poisson_ratio**2) * radius**7 * second / (wall * weak)
    return outer_angle, phi, brazier


def softening(angle: jax.Array, alpha: jax.Array, beta: jax.Array) -> jax.Array:
    """Compute q = 1 + αθ/2 + βθ²/2: the moment is K₀ θ/q².

    Args:
        angle: θ, rad, positive closing; any shape.
        alpha: α, 1/rad.
        beta: β, 1/rad².

    Returns:
        q, of the shape of `angle`.
    """
    return 1.0 + 0.5 * angle * (alpha + beta * angle)


def moment(angle: jax.Array, alpha: jax.Array, beta: jax.Array) -> jax.Array:
    """Compute M/K₀ = θ/q², rad; arguments as for `softening`."""
    return angle / softening(angle, alpha, beta) ** 2


def tangent(angle: jax.Array, alpha: jax.Array, beta: jax.Array) -> jax.Array:
    """Compute the tangent stiffness over K₀, negative past a limit point; as `softening`."""
    falling = 0.5 * angle * (alpha + 3.0 * beta * angle)
    return (1.0 - falling) / softening(angle, alpha, beta) ** 3


def potential(angle: jax.Array, alpha: jax.Array, beta: jax.Array) -> jax.Array:
    """Compute the potential U/K₀, rad², by a Gauss rule: right to rounding for every α and β.

    Its integrand has no pole near the angles of a notch, so that the points of the arc do; the
    closed form above loses digits at small angles and has another branch where D ≤ 0.

    Args:
        angle: θ, rad, positive closing; any shape.
        alpha: α, 1/rad.
        beta: β, 1/rad².

    Returns:
        The potential, of the shape of `angle`.
    """
    total = 0.0 * angle
    for node, weight in zip(0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS, strict=True):
        total = total + weight * angle * moment(node * angle, alpha, beta)
    return total


def limit_angle(alpha: jax.Array, beta: jax.Array) -> jax.Array:
    """Compute the closing angle of the largest moment, where 1 − αθ/2 − 3βθ²/2 = 0.

    Args:
        alpha: α, 1/rad, not negative.
        beta: β, 1/rad², not negative; not both 0.

    Returns:
        The angle, rad.
    """
    xp = array_module(alpha, beta)
    return 4.0 / (alpha + xp.sqrt(alpha**2 + 24.0 * beta))
