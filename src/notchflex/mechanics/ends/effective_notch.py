"""The numbers that a rod needs to stand for a notch with the rings that it ends in."""

from __future__ import annotations

from typing import NamedTuple

from jax.typing import ArrayLike

from notchflex._jax import jax
from notchflex.mechanics.ends.side import Side


class NotchStiffness(NamedTuple):
    r"""Effective lengths of a notch with its ends, and how it softens with its angle.

    The section is the true one of the cut (`annular_sector`, `annular_segment`): its area A,
    second moments I (weak) and I_y (strong), torsion constant J, centroid ȳ. All fields are
    scalars, differentiable by every number that went in.

    Attributes:
        weak: ℓ = h + δ, mm: θ = M ℓ/(E I) at small angles.
        strong: h + δ of the bending sideways, mm: θ = M ℓ/(E I_y).
        axial: h + δ of the stretch of the centroid by an axial force there, mm: u = N ℓ/(E A).
        coupling: b_c, mm²: an axial force N at the centroid turns the notch by
            −N b_c/(E I), and a moment M stretches the centroid by as much. The neutral axis of
            the bending lies at ȳ − b_c/ℓ.
        torsion: Effective length, mm: twist = T ℓ/(G J) with the J of the section; the ends hold
            the section against warping.
        shear_centre: Distance of the centre of twist from the tube axis, toward the spine, mm.
        shear_weak: Lateral compliance of the middle of the notch in the plane of bending beyond
            that of bending with end springs, times E, 1/mm.
        shear_strong: The same sideways, with the force at the shear centre.
        alpha: α, 1/rad: the stiffness K₀ = E I/ℓ falls to K₀/q², q = 1 + αθ/2 + βθ²/2, θ > 0
            closing.
        beta: β, 1/rad².
        closing_factor: Angle between the rings at which the lips touch, over h/(r_o + ȳ).
        closed_ratio: Tangent stiffness of the closed notch over K₀.
    """

    weak: jax.Array
    strong: jax.Array
    axial: jax.Array
    coupling: jax.Array
    torsion: jax.Array
    shear_centre: jax.Array
    shear_weak: jax.Array
    shear_strong: jax.Array
    alpha: jax.Array
    beta: jax.Array
    closing_factor: jax.Array
    closed_ratio: jax.Array


def notch_stiffness(
    outer_radius: ArrayLike,
    inner_radius: ArrayLike,
    cut: str,
    depth: ArrayLike,
    height: ArrayLike,
    poisson_ratio: ArrayLike,
    proximal: Side,
    distal: Side,
) -> NotchStiffness:
    """Compute the stiffness of a notch from the drawing.

    Args:
        outer_radius: Outer radius of the tube, mm.
        inner_radius: Inner radius, mm.
        cut: "on-axis" or "off-axis".
        depth: Depth g of the cut, mm.
        height: Height h of the notch along the tube, mm.
        poisson_ratio: Poisson's ratio ν.
        proximal: The ring toward the base.
        distal: The ring toward the tip.

    Returns:
        The numbers; computed once for each set of plain numbers.
    """
    raise NotImplementedError
