r"""Two parallel rectangular walls: the section of a strip that two opposite cuts leave of a tube.

A strip runs across the tube, and the lumen parts it into two walls, each b wide across the strip
and h thick in the direction in which the strip bends, with their middles at ±c. Both ends of the
strip are clamped in rigid pieces of the tube, which prevent warping of its section; Vlasov's theory
of thin-walled bars gives how much that stiffens its torsion.

Used when a robot is assembled, so plain NumPy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.section.section import Section

_ODD = 2.0 * xp.arange(8) + 1.0
_FIFTH_POWERS = 31.0 / 32.0 * 1.0369277551433699  # sum of n^-5 over odd n, from zeta(5)


def two_walls(width: ArrayLike, thickness: ArrayLike, middle: ArrayLike) -> Section:
    r"""Compute the section of two equal walls side by side.

    Args:
        width: Width b of each wall, across the strip, mm; any shape.
        thickness: Thickness h, in the direction of bending, mm; broadcast with the others.
        middle: Distance c of the middle of each wall from the plane of symmetry, mm.

    Returns:
        The section, every field of the common shape. Weak is the bending of the strip,
        $2bh^3/12$, strong the bending sideways, $2(hb^3/12 + bhc^2)$; the torsion constant is
        that of free warping.

    Example:
        >>> strip = two_walls(2.0, 1.5, 4.0)
        >>> print(f"{strip.second_moment_weak:.4f} mm⁴, torsion {strip.torsion_constant:.4f} mm⁴")
        1.1250 mm⁴, torsion 2.4362 mm⁴
    """
    b, h, c = (
        xp.asarray(value, dtype=float) for value in xp.broadcast_arrays(width, thickness, middle)
    )
    nought = xp.zeros_like(b)
    return Section(
        area=constant(2.0 * b * h),
        centroid=constant(nought),
        second_moment_weak=constant(2.0 * b * h**3 / 12.0),
        second_moment_strong=constant(2.0 * (h * b**3 / 12.0 + b * h * c**2)),
        torsion_constant=constant(2.0 * rectangle_torsion_constant(b, h)),
        shear_centre=constant(nought),
        edge_near=constant(0.5 * h),
        edge_spine=constant(0.5 * h),
        edge_across=constant(c + 0.5 * b),
        outer_radius=constant(nought),
        half_angle=constant(nought),
    )


def rectangle_torsion_constant(width: ArrayLike, thickness: ArrayLike) -> np.ndarray:
    r"""Compute Saint-Venant's torsion constant of a rectangle, to rounding.

    With the longer side b and the shorter h (Timoshenko and Goodier, Theory of Elasticity, §109):

    $$J = \frac{bh^3}{3}\Big[1 - \frac{192}{\pi^5}\frac hb
    \sum_{n=1,3,\dots}\frac{\tanh(n\pi b/2h)}{n^5}\Big]$$

    The sum of $n^{-5}$ is known, and what the tanh takes off falls with $e^{-n\pi}$ or faster.

    Args:
        width: One side, mm; any shape.
        thickness: The other side, mm.

    Returns:
        Torsion constant, mm⁴.

    Example:
        >>> print(f"{rectangle_torsion_constant(1.0, 1.0):.10f}")
        0.1405770150
    """
    one, other = xp.asarray(width, dtype=float), xp.asarray(thickness, dtype=float)
    b, h = xp.maximum(one, other), xp.minimum(one, other)
    decay = xp.exp(-np.pi * _ODD * (b / h)[..., None])
    taken_off = xp.sum(2.0 * decay / (1.0 + decay) / _ODD**5, axis=-1)
    return b * h**3 / 3.0 * (1.0 - 192.0 / np.pi**5 * (h / b) * (_FIFTH_POWERS - taken_off))


def clamped_torsion_constant(
    section: Section, middle: ArrayLike, length: float, poisson_ratio: float = 0.33
) -> np.ndarray:
    r"""Compute the equivalent torsion constant of two walls clamped at both ends.

    Where the strip turns about its own axis, its walls are bent one up, one down. With the
    warping constant $I_\omega = 2\,(bh^3/12)\,c^2$ the torque that turns the whole length L by
    an angle is that of free warping with

    $$J_\text{clamped} = \frac{J}{1 - \tanh u/u},\qquad
    u = \frac L2\sqrt{\frac{GJ}{EI_\omega}},$$

    (Vlasov 1961, Thin-Walled Elastic Beams): for short strips $12EI_\omega/GL^2$, two beams.

    Args:
        section: Section by `two_walls`.
        middle: Distance c of the middle of each wall from the plane of symmetry, mm.
        length: Length between the clamps, mm.
        poisson_ratio: For the ratio of the moduli; the result changes by less than its relative
            change times 1 / (1 + ratio).

    Returns:
        Torsion constant, mm⁴.

    Example:
        >>> strip = two_walls(2.0, 1.5, 4.0)
        >>> print(f"{clamped_torsion_constant(strip, 4.0, 8.0):.3f} mm⁴")
        11.890 mm⁴
    """
    free = xp.asarray(section.torsion_constant)
    warping = xp.asarray(section.second_moment_weak) * xp.asarray(middle, dtype=float) ** 2
    u = 0.5 * length * xp.sqrt(free / (2.0 * (1.0 + poisson_ratio) * warping))
    return free / _beyond_tanh(u)


def _beyond_tanh(u: np.ndarray) -> np.ndarray:
    """Compute 1 - tanh(u)/u, which is u²/3 for small u, without cancellation."""
    small = u < 0.1
    square = xp.where(small, u, 0.0) ** 2
    # The series of tanh; the first term left out is below 1e-14 of the sum.
    coefficients = (-21844.0 / 6081075.0, 1382.0 / 155925.0, -62.0 / 2835.0, 17.0 / 315.0)
    series = xp.zeros_like(square)
    for coefficient in coefficients:
        series = series * square + coefficient
    series = square * (1.0 / 3.0 - square * (2.0 / 15.0 - square * series))
    large = xp.where(small, 1.0, u)
    return xp.where(small, series, 1.0 - xp.tanh(large) / large)
