"""The numbers that a rod needs to stand for a notch with the rings that it ends in."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from numbers import Real
from typing import NamedTuple

from jax.typing import ArrayLike

from notchflex._jax import array_module, jax
from notchflex.mechanics.ends.edge_loads import arc_of, end_compliance
from notchflex.mechanics.ends.flattening import edge_and_brazier, flattening_numbers
from notchflex.mechanics.ends.side import Side
from notchflex.mechanics.ends.vlasov import shear_centre, torsion_length
from notchflex.mechanics.section import SECTION_OF_CUT

# Finite elements with contact of one tube (OD 1.62, ID 1.40, depth 1.4, height 0.8 mm): angle at
# first contact over h/(r_o + ȳ), and stiffness 1 to 3° beyond over E t r², the same for both cuts.
_CLOSING_FACTOR = {"on-axis": 1.0248, "off-axis": 1.0203}
_CLOSED_STIFFNESS = 0.354


class NotchStiffness(NamedTuple):
    r"""Effective lengths of a notch with its ends, and how it softens with its angle.

    The section is the true one of the cut (`annular_sector`, `annular_segment`): its area A,
    second moments I (weak) and I_y (strong), torsion constant J, centroid ȳ. All fields are
    scalars, differentiable by every number that went in.

    Attributes:
        weak: ℓ = h + δ, mm: θ = M ℓ/(E I) at small angles.
        strong: h + δ of the bending sideways, mm: θ = M ℓ/(E I_y).
        axial: h + δ of the stretch of the centroid by an axial force there, mm: u = N ℓ/(E A).
        coupling: b_c, mm²: a tension N at the centroid closes the notch by N b_c/(E I), and a
            closing moment M stretches the centroid by M b_c/(E I). The neutral axis of the
            bending lies at ȳ − b_c/ℓ.
        torsion: Effective length, mm: twist = T ℓ/(G J) with the J of the section; the ends hold
            the section against warping.
        shear_centre: Distance of the centre of twist from the tube axis, toward the spine, mm.
        alpha: α, 1/rad: the stiffness K₀ = E I/ℓ falls to K₀/q², q = 1 + αθ/2 + βθ²/2, θ > 0
            closing.
        beta: β, 1/rad².
        closing_factor: Angle between the rings at which the lips touch, over h/(r_o + ȳ).
        closed_ratio: Stiffness of the closed notch, its lips in contact, over K₀.
    """

    weak: jax.Array
    strong: jax.Array
    axial: jax.Array
    coupling: jax.Array
    torsion: jax.Array
    shear_centre: jax.Array
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
    numbers = (outer_radius, inner_radius, depth, height, poisson_ratio)
    plain = all(isinstance(value, Real) for value in (*numbers, proximal.length, distal.length))
    return (_of_plain_numbers if plain else _compute)(*numbers, cut, proximal, distal)


def _compute(
    outer_radius: ArrayLike,
    inner_radius: ArrayLike,
    depth: ArrayLike,
    height: ArrayLike,
    poisson_ratio: ArrayLike,
    cut: str,
    proximal: Side,
    distal: Side,
) -> NotchStiffness:
    """Compute what `notch_stiffness` returns."""
    sides = (proximal, distal)
    numbers = (outer_radius, inner_radius, depth, height, poisson_ratio)
    lengths = tuple(side.length for side in sides)
    xp = array_module(*numbers, *lengths)
    outer, inner, g, h, nu = (xp.asarray(value, dtype=float) for value in numbers)
    near, far = (xp.asarray(value, dtype=float) for value in lengths)
    boundaries = (proximal.boundary, distal.boundary)

    section = SECTION_OF_CUT[cut](outer, inner, g)
    arc = arc_of(outer, inner, section)
    added = [
        end_compliance(
            outer, inner, arc, 0.5 * length if boundary == "between" else length, nu, boundary
        )
        for length, boundary in zip((near, far), boundaries, strict=True)
    ]
    weak = h + added[0].weak + added[1].weak

    outer_angle, phi, brazier = flattening_numbers(outer, inner, cut, g, nu, section)
    edge, share = edge_and_brazier(arc.radius, (near, far), boundaries)
    imposed = 3.0 * nu * h + edge * outer_angle**3 * arc.radius**2 / arc.wall
    return NotchStiffness(
        weak=weak,
        strong=h + added[0].strong + added[1].strong,
        axial=h + added[0].axial + added[1].axial,
        coupling=added[0].coupling + added[1].coupling,
        torsion=torsion_length(arc, outer, h, nu, section),
        shear_centre=shear_centre(arc, h, section),
        alpha=arc.radius * phi * imposed / weak**2,
        beta=share * brazier * h / weak**3,
        closing_factor=xp.asarray(_CLOSING_FACTOR[cut]),
        closed_ratio=(
            _CLOSED_STIFFNESS * arc.wall * arc.radius**2 * weak / section.second_moment_weak
        ),
    )


# Plain numbers are computed by NumPy, once for each set of them.
_of_plain_numbers: Callable[..., NotchStiffness] = lru_cache(maxsize=1024)(_compute)
