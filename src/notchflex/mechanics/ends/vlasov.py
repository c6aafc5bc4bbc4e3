r"""Torsion of a notch whose ends restrain warping of its section, and its shear.

Vlasov's theory of thin-walled bars with an elastic spring for the warping at either end. The twist
of a torque T is $T\ell/(GJ)$ with

$$\ell = h + t\,(3.11 - 1.60\,a) - \frac{2}{k\,(\coth(kh/2) + \lambda_w k)},\qquad
k = \sqrt{GJ/EC_w},$$

the second term for what the arc's shear does in the rings, the third for the warping. The two
numbers and the spring λ_w were fitted to cells of chains of equal notches.
"""

from __future__ import annotations

from notchflex._arrays import plain_number, xp
from notchflex.mechanics.ends.edge_loads import WallSector
from notchflex.mechanics.section import Section


def warping_constant(arc: WallSector) -> float:
    """Compute the warping constant C_w of the arc about its shear centre.

    Args:
        arc: The arc of wall that the cut leaves.

    Returns:
        C_w of the middle line and of the wall, mm⁶.
    """
    r, t, a = arc.radius, arc.wall, arc.half_angle
    sine, cosine = xp.sin(a), xp.cos(a)
    line = a**3 - 6.0 * (sine - a * cosine) ** 2 / (a - sine * cosine)
    return 2.0 / 3.0 * t * r**5 * line + (2.0 * a * r * t) ** 3 / 144.0


def torsion_length(
    arc: WallSector,
    outer: float,
    height: float,
    poisson_ratio: float,
    section: Section,
) -> float:
    """Compute the effective length ℓ in free torsion of the notch with its ends.

    Args:
        arc: The arc of wall that the cut leaves.
        outer: Outer radius, mm.
        height: Height h of the notch, mm.
        poisson_ratio: Poisson's ratio ν.
        section: The section that the cut leaves; its torsion constant is J.

    Returns:
        The length, mm: twist = T ℓ/(G J).
    """
    t, a, diameter = arc.wall, arc.half_angle, 2.0 * outer
    shear_over_young = 0.5 / (1.0 + poisson_ratio)
    rate = xp.sqrt(shear_over_young * section.torsion_constant / warping_constant(arc))
    width = 2.0 * a * arc.radius / diameter
    spring = 0.004 * diameter * (t / diameter) ** -1.98 * xp.exp(0.16 * width)
    warping = 2.0 / (rate * (1.0 / xp.tanh(0.5 * rate * height) + spring * rate))
    return height + t * (3.11 - 1.60 * a) - warping


def shear_centre(arc: WallSector, height: float, section: Section) -> float:
    """Compute the distance of the centre of twist from the tube axis, toward the spine.

    Args:
        arc: The arc of wall that the cut leaves.
        height: Height h of the notch, mm.
        section: The section that the cut leaves.

    Returns:
        The distance, mm: that of the section, moved out by the ends of short notches.
    """
    width = 2.0 * arc.half_angle * arc.radius
    return plain_number(section.shear_centre) * (1.0 + 0.027 * width / (height + 0.72 * width))
