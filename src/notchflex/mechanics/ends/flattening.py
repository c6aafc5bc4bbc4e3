r"""Softening of a notch as it closes, by flattening of its curved spine.

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

from collections.abc import Sequence

import numpy as np

from notchflex._arrays import xp
from notchflex.mechanics.ends.side import Side
from notchflex.mechanics.section import Section

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)

# Fitted between notches: what a ring imposes at the edge, k = k0 (1 - exp(-(c / (c1 r))²)), and a
# factor on Brazier. First and last notches of wrists are met by the same numbers (6 % to closing).
_EDGE = (0.207, 1.69)
_BRAZIER = 0.97
# One notch alone between two clamped rings, as test specimens are.
_EDGE_OF_SPECIMEN, _BRAZIER_OF_SPECIMEN = (0.465, 1.51), 0.74


def edge_and_brazier(radius: float, sides: Sequence[Side]) -> tuple[float, float]:
    """Compute the mean k of the two sides, and the factor c_b on Brazier's flattening.

    Args:
        radius: Mean radius r, mm.
        sides: The two rings.

    Returns:
        k and c_b.
    """
    specimen = all(side.boundary == "clamped" for side in sides)
    factor, decay = _EDGE_OF_SPECIMEN if specimen else _EDGE
    # The flattening k that a ring of some length imposes at the edge of the notch.
    both = [-factor * xp.expm1(-((side.length / (decay * radius)) ** 2)) for side in sides]
    return 0.5 * (both[0] + both[1]), _BRAZIER_OF_SPECIMEN if specimen else _BRAZIER


def flattening_numbers(
    outer: float,
    inner: float,
    cut: str,
    depth: float,
    poisson_ratio: float,
    section: Section,
) -> tuple[float, float, float]:
    """Compute the parameters of flattening from the shape of the arc.

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
