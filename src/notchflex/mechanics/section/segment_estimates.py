"""Estimates of torsion constant and shear centre of an annular segment, one for each shape.

They have the right form (Bredt's closed tube, the thin open arc, the flat solid), so that the
factors which correct them, see `segment_torsion`, are smooth and of the order of one.
"""

from notchflex._jax import array_module, jax
from notchflex.mechanics.section.angles import half_angle


def closed_estimate(
    outer: jax.Array, inner: jax.Array, depth: jax.Array
) -> tuple[jax.Array, jax.Array]:
    r"""Estimate the closed tube with a flat after Bredt.

    $J \approx 4A_m^2/C + \int t^3 ds/3$ with $C = \oint ds/t$. Under the flat, within an angle
    b of the middle of the cut, the wall is $|d|/\cos\varphi - r_i$ thick, which integrates in
    closed form. The part f of C that the flat adds moves the shear centre from the tube axis
    to $2mf$; with f = 1 this is that of a slit tube.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        depth: Depth of the cut, mm, greater than 0 and less than the wall.

    Returns:
        Torsion constant, mm⁴, and shear centre, mm.
    """
    xp = array_module(outer)
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


def open_estimate(
    outer: jax.Array, inner: jax.Array, depth: jax.Array, area: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Estimate the open arc: J = A t²/3 and the shear centre of the thin arc.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        depth: Depth of the cut, mm, such that the plane passes through the bore.
        area: Area of the section, mm².

    Returns:
        Torsion constant, mm⁴, and shear centre, mm.
    """
    xp = array_module(outer)
    mean, wall = 0.5 * (outer + inner), outer - inner
    a = half_angle(mean, mean + outer - depth, mean - outer + depth)
    sine, cosine = xp.sin(a), xp.cos(a)
    shear = 2.0 * mean * (sine - a * cosine) / (a - sine * cosine)
    return area * wall**2 / 3.0, shear


def solid_estimate(
    outer: jax.Array, depth: jax.Array, area: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Estimate the solid segment of the wall: J = A h²/3 and the top of the circle.

    Args:
        outer: Outer radius, mm.
        depth: Depth of the cut, mm, such that the plane passes beyond the bore.
        area: Area of the section, mm².

    Returns:
        Torsion constant, mm⁴, and shear centre, mm.
    """
    return area * (2.0 * outer - depth) ** 2 / 3.0, outer
