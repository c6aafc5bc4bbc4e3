"""Effective stiffness of a notch with the rings beside it, as the parameters of a rod."""

from __future__ import annotations

from typing import NamedTuple

from notchflex._arrays import cached, plain_number, xp
from notchflex.mechanics.ends.edge_loads import WallSector, arc_of, end_compliance
from notchflex.mechanics.ends.flattening import edge_and_brazier, flattening_numbers
from notchflex.mechanics.ends.shear import shear_compliances
from notchflex.mechanics.ends.side import Side
from notchflex.mechanics.ends.vlasov import shear_centre, torsion_length
from notchflex.mechanics.section import SECTION_OF_CUT

# Finite elements with contact of one tube (OD 1.62, ID 1.40, depth 1.4, height 0.8 mm): angle at
# first contact over h/(r_o + ȳ), and stiffness 1 to 3° beyond over E t r², the same for both cuts.
_CLOSING_FACTOR = {"on-axis": 1.0248, "off-axis": 1.0203}
_CLOSED_STIFFNESS = 0.354

# Reach of the edge of a ring, in r √(r/t). Beyond it an added length changes by less than 0.1 % of
# the diameter, for walls of 0.08 to 0.47 mean radii (tests/mechanics/ends/test_ring.py).
_REACH = 3.33


class NotchStiffness(NamedTuple):
    r"""Effective lengths of a notch with its ends, and how it softens with its angle.

    The section is the true one of the cut (`annular_sector`, `annular_segment`): its area A,
    second moments I (weak) and I_y (strong), torsion constant J, centroid ȳ. All fields are
    plain numbers.

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
        shear: Compliance in shear times E, 1/mm: how far the rings shift in the plane of bending
            under a force across the tube through the middle of the notch.
        sway: The same sideways, under a force through the centre of twist.
        alpha: α, 1/rad: the stiffness K₀ = E I/ℓ falls to K₀/q², q = 1 + αθ/2 + βθ²/2, θ > 0
            closing.
        beta: β, 1/rad².
        closing_factor: Angle between the rings at which the edges touch, over h/(r_o + ȳ).
        closed_ratio: Stiffness of the closed notch, its edges in contact, over K₀.
    """

    weak: float
    strong: float
    axial: float
    coupling: float
    torsion: float
    shear_centre: float
    shear: float
    sway: float
    alpha: float
    beta: float
    closing_factor: float
    closed_ratio: float


def reach_of(arc: WallSector) -> float:
    """Return how far along a ring the effects of its edge reach, mm.

    The ovalising load reaches farthest; it decays over a length that grows with r √(r/t).
    """
    return plain_number(_REACH * arc.radius * xp.sqrt(arc.radius / arc.wall))


@cached(1024)
def notch_stiffness(
    outer_radius: float,
    inner_radius: float,
    cut: str,
    depth: float,
    height: float,
    poisson_ratio: float,
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
        The numbers, smooth in every argument; cached.

    Example:
        >>> ring = Side("between", 1.2)
        >>> round(notch_stiffness(0.81, 0.70, "on-axis", 1.4, 0.8, 0.33, ring, ring).weak, 3)
        1.291
    """
    section = SECTION_OF_CUT[cut](outer_radius, inner_radius, depth)
    arc = arc_of(outer_radius, inner_radius, section)
    sides: list[Side] = []
    for side in (proximal, distal):  # cut where the effects of the edge have died out
        longest = reach_of(arc) * (2.0 if side.boundary == "between" else 1.0)
        sides.append(side._replace(length=xp.minimum(side.length, longest)))
    added = [end_compliance(outer_radius, inner_radius, arc, side, poisson_ratio) for side in sides]
    weak, strong, axial, coupling = (sum(each) for each in zip(*added, strict=True))
    length = height + weak
    outer_angle, phi, brazier = flattening_numbers(
        outer_radius, inner_radius, cut, depth, poisson_ratio, section
    )
    edge, share = edge_and_brazier(arc.radius, sides)
    imposed = 3.0 * poisson_ratio * height + edge * outer_angle**3 * arc.radius**2 / arc.wall
    shear, sway = shear_compliances(
        arc,
        outer_radius,
        (length, height + strong),
        (plain_number(section.second_moment_weak), plain_number(section.second_moment_strong)),
        sides,
    )
    closed = _CLOSED_STIFFNESS * arc.wall * arc.radius**2 * length / section.second_moment_weak
    return NotchStiffness(
        weak=plain_number(length),
        strong=plain_number(height + strong),
        axial=plain_number(height + axial),
        coupling=plain_number(coupling),
        torsion=plain_number(torsion_length(arc, outer_radius, height, poisson_ratio, section)),
        shear_centre=shear_centre(arc, height, section),
        shear=shear,
        sway=sway,
        alpha=plain_number(arc.radius * phi * imposed / length**2),
        beta=plain_number(share * brazier * height / length**3),
        closing_factor=_CLOSING_FACTOR[cut],
        closed_ratio=plain_number(closed),
    )
