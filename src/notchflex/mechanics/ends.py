"""Effective stiffness of a notch with the rings beside it, as the parameters of a rod."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from notchflex._arrays import cached, plain_number, xp
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.flattening import FACTORS, distortion, softening
from notchflex.mechanics.ring import Side, WallSector, arc_of, end_compliance
from notchflex.mechanics.section import Section

# Torsion of a notch whose ends restrain warping of its section, and its shear.
#
# Vlasov's theory of thin-walled bars with an elastic spring for the warping at either end. The
# twist of a torque T is $T\ell/(GJ)$ with
#
# $$\ell = h + t\,(3.11 - 1.60\,a) - \frac{2}{k\,(\coth(kh/2) + \lambda_w k)},\qquad
# k = \sqrt{GJ/EC_w},$$
#
# the second term for what the arc's shear does in the rings, the third for the warping. The two
# numbers and the spring λ_w were fitted to cells of chains of equal notches.


def torsion_length(
    arc: WallSector, outer: float, height: float, poisson_ratio: float, section: Section
) -> float:
    """Compute the effective length ℓ in free torsion of the notch with its ends, mm."""
    r, t, a, diameter = arc.radius, arc.wall, arc.half_angle, 2.0 * outer
    sine, cosine = xp.sin(a), xp.cos(a)
    line = a**3 - 6.0 * (sine - a * cosine) ** 2 / (a - sine * cosine)
    # C_w about the shear centre: of the middle line and of the wall, mm⁶.
    warping_constant = 2.0 / 3.0 * t * r**5 * line + (2.0 * a * r * t) ** 3 / 144.0
    shear_over_young = 0.5 / (1.0 + poisson_ratio)
    rate = xp.sqrt(shear_over_young * section.torsion_constant / warping_constant)
    spring = 0.004 * diameter * (t / diameter) ** -1.98 * xp.exp(0.16 * (2.0 * a * r / diameter))
    warping = 2.0 / (rate * (1.0 / xp.tanh(0.5 * rate * height) + spring * rate))
    return height + t * (3.11 - 1.60 * a) - warping


# Shear of a notch with its ends: relative displacement of its two rings.
#
# A force across the tube, through the middle of the notch and its centre of twist, bends the arc to
# an S and distorts the rings. Its compliance times Young's modulus is
#
# $$E\,C = \frac{\ell^3}{12\,I} +
# \frac{K}{D}\left(\frac{t}{D}\right)^{p}\left(\frac{b}{D}\right)^{q}
# \left(\frac{\ell}{D}\right)^{m}\left(\frac{c}{D}\right)^{n}$$
#
# with the length ℓ of the bending about the axis that the force bends it about, ends included, the
# wall t, the width b of the arc, the uncut length c and the outer diameter D. The five numbers of
# each direction were fitted to cells of chains of equal notches.


def shear_compliances(
    arc: WallSector,
    outer: float,
    lengths: tuple[float, float],
    second_moments: tuple[float, float],
    sides: Sequence[Side],
) -> tuple[float, float]:
    """Compute the compliance of the two directions across the tube, times E, 1/mm."""
    diameter = 2.0 * outer
    wall, width = arc.wall / diameter, 2.0 * arc.half_angle * arc.radius / diameter

    def compliance(of: int, factor: float, p: float, q: float, m: float, n: float) -> float:
        rings = sum((side.length / diameter) ** n for side in sides) / len(sides)
        distorted = factor * (wall**p * width**q * rings) * (lengths[of] / diameter) ** m
        bent = lengths[of] ** 3 / (12.0 * second_moments[of])
        return plain_number(bent + distorted / diameter)

    in_plane = compliance(0, 1.37, -1.80, -2.10, 1.00, 0.30)
    return in_plane, compliance(1, 2.35, -1.17, -0.84, 1.31, 0.06)


class NotchStiffness(NamedTuple):
    """Effective lengths of a notch with its ends, and how it softens with its angle."""

    # The section is the true one of the cut (`annular_sector`, `annular_segment`): its area A,
    # second moments I (weak) and I_y (strong), torsion constant J, centroid ȳ. All fields are plain
    # numbers.

    weak: float  # ℓ = h + δ, mm: θ = M ℓ/(E I) at small angles
    strong: float  # h + δ of the bending sideways, mm: θ = M ℓ/(E I_y)
    axial: float  # h + δ of the stretch of the centroid by an axial force there, mm: u = N ℓ/(E A)
    # b_c, mm²: a tension N at the centroid closes the notch by N b_c/(E I), and a closing moment M
    # stretches the centroid by M b_c/(E I). The neutral axis of the bending lies at ȳ − b_c/ℓ
    coupling: float
    # Effective length, mm: twist = T ℓ/(G J) with the J of the section; the ends hold the section
    # against warping
    torsion: float
    shear_centre: float  # Distance of the centre of twist from the tube axis, toward the spine, mm
    # Compliance in shear times E, 1/mm: how far the rings shift in the plane of bending under a
    # force across the tube through the middle of the notch
    shear: float
    sway: float  # The same sideways, under a force through the centre of twist
    # α, 1/rad: the stiffness K₀ = E I/ℓ falls to K₀/q², q = 1 + αθ/2 + βθ²/2, θ > 0 closing
    alpha: float
    beta: float  # β, 1/rad²
    closing_factor: float  # Angle between the rings at which the edges touch, over h/(r_o + ȳ)
    closed_ratio: float  # Stiffness of the closed notch, its edges in contact, over K₀


def reach_of(arc: WallSector) -> float:
    """Return how far along a ring the effects of its edge reach, mm."""
    # The ovalising load reaches farthest; it decays over a length that grows with r √(r/t). Farther
    # off an added length changes by less than 0.1 % of the diameter, for walls of 0.08 to 0.47 mean
    # radii (tests/mechanics/ends/test_ring.py).
    return plain_number(3.33 * arc.radius * xp.sqrt(arc.radius / arc.wall))


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
    """Compute the stiffness of a notch from the drawing."""
    section = SECTION_OF_CUT[cut](outer_radius, inner_radius, depth)
    arc = arc_of(outer_radius, inner_radius, section)
    sides: list[Side] = []
    for side in (proximal, distal):  # cut where the effects of the edge have died out
        longest = plain_number(reach_of(arc) * (1.0 + side.shares[0]))
        sides.append(side._replace(length=xp.minimum(side.length, longest)))
    distorted = distortion(arc, poisson_ratio)
    factors = FACTORS[cut]
    added = [
        end_compliance(arc, side, poisson_ratio, distorted.loads, factors.relaxation)
        for side in sides
    ]
    weak, strong, axial, coupling, *_ = map(sum, zip(*added, strict=True))
    length = height + weak
    weak_moment = section.second_moment_weak
    alpha, beta = softening(
        arc, distorted, added, weak_moment, height, length, poisson_ratio, factors.odd
    )
    shear, sway = shear_compliances(
        arc,
        outer_radius,
        (length, height + strong),
        (plain_number(section.second_moment_weak), plain_number(section.second_moment_strong)),
        sides,
    )
    # Finite elements with contact of one tube (OD 1.62, ID 1.40, depth 1.4, height 0.8 mm): angle
    # at first contact over h/(r_o + ȳ), and stiffness 1 to 3° beyond over E t r².
    closing_factor = {"on-axis": 1.0248, "off-axis": 1.0203}[cut]
    closed = 0.354 * arc.wall * arc.radius**2 * length / section.second_moment_weak
    width = 2.0 * arc.half_angle * arc.radius
    moved_out = 1.0 + 0.027 * width / (height + 0.72 * width)  # by the ends of short notches
    return NotchStiffness(
        weak=plain_number(length),
        strong=plain_number(height + strong),
        axial=plain_number(height + axial),
        coupling=plain_number(coupling),
        torsion=plain_number(torsion_length(arc, outer_radius, height, poisson_ratio, section)),
        shear_centre=plain_number(section.shear_centre) * moved_out,
        shear=shear,
        sway=sway,
        alpha=plain_number(alpha),
        beta=plain_number(beta),
        closing_factor=closing_factor,
        closed_ratio=plain_number(closed),
    )


# Checked ranges (against finite elements) of the law of a notch with its ends.

Dimension = tuple[str, float, list[tuple[float, float, str]]]
"""A dimension, its value, and checked ranges, widest first: least, most, what is known beyond."""


def left_ranges(dimensions: list[Dimension]) -> list[str]:
    """Return a sentence for each dimension outside a range: number, bound and what is known."""
    sentences: list[str] = []
    for dimension, value, ranges in dimensions:
        for low, high, beyond in ranges:
            if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
                side, bound = ("below", low) if value < low else ("above", high)
                sentences.append(f"{dimension} is {value:.3g}, {side} {bound:g}: {beyond}")
                break
    return sentences


def validity(
    outer_radius: float,
    inner_radius: float,
    cut: str,
    depth: float,
    height: float,
    proximal: Side,
    distal: Side,
) -> list[str]:
    """List the checked ranges that a notch leaves, each with the error found beyond it."""
    radius, diameter = 0.5 * (outer_radius + inner_radius), 2.0 * outer_radius
    sentences: list[str] = []
    if cut == "off-axis" and depth >= outer_radius + inner_radius:
        sentences.append(
            f"depth is {depth:.4g} mm, beyond the far side of the bore at "
            f"{outer_radius + inner_radius:.4g} mm, where a solid strip is left: the stiffness was "
            "found wrong by up to 23 %"
        )
    untested = "the stiffness may be off by more than the 3 % found inside"
    off = "moments near closing were found up to 13 % off"
    depths = [(0.60, 0.90, untested), (0.75, 1.0, "moments near closing were found up to 3 % off")]
    if proximal.boundary == distal.boundary == "between":
        depths.insert(1, (0.68, 1.0, "between notches found up to 3 % off"))
    walls = [(0.0769, 0.47, untested), (0.14, 0.47, off)]
    sentences += left_ranges(
        [
            ("wall / mean radius", (outer_radius - inner_radius) / radius, walls),
            # Of higher notches the rings are a small part.
            ("height / mean radius", height / radius, [(0.39, np.inf, untested)]),
            ("depth / outer diameter", depth / diameter, depths),
        ]
    )
    shape = outer_radius, inner_radius, cut, depth, height, 0.33
    # What short rings change against the shortest ones that were checked, 0.37 outer diameters.
    sides, checked = (proximal, distal), 0.37
    longer = [
        side._replace(length=max(side.length, checked * diameter)) if side.length else side
        for side in sides
    ]
    change = abs(notch_stiffness(*shape, *longer).weak / notch_stiffness(*shape, *sides).weak - 1.0)
    if change > 0.01:
        shortest = min(side.length for side in sides if side.length)
        sentences.append(
            f"ring / outer diameter is {shortest / diameter:.3g}, below {checked:g}: "
            f"{100.0 * change:.0f} % of the stiffness follow from longer rings"
        )
    turned = {side.length for side in sides if side.turned}
    # With a ring of 1.9 outer diameters the chain agrees with finite elements to 2 %.
    return sentences + [
        f"a neighbour opens to another side of the tube, and the ring between them is {length:.3g} "
        "mm long, below 1.5 outer diameters: both were found too stiff, 1.4 times with 0.6 outer "
        "diameters and up to 2 times with 0.4"
        for length in sorted(turned)
        if length < 1.5 * diameter
    ]
