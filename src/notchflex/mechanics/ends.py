"""Effective stiffness of a notch with the rings beside it, as the parameters of a rod."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from notchflex._arrays import cached, plain_number, xp
from notchflex.mechanics.cuts import SECTION_OF_CUT
from notchflex.mechanics.flattening import FACTORS, distortion, softening
from notchflex.mechanics.ring import (
    HARMONICS,
    Side,
    WallSector,
    arc_of,
    edge_compliance,
    end_compliance,
)
from notchflex.mechanics.section import Section, gauss_on

# Torsion of a notch whose ends restrain warping of its section.
#
# Vlasov's theory of thin-walled bars: of the torque T, $GJ\theta'$ is Saint-Venant's and B' that of
# the bimoment $B = B_h\sinh kz/\sinh(kh/2)$, with $k^2 = GJ/EC_w$. On the edge of the ring, a
# cylindrical shell, B acts as a membrane force in proportion to the sectorial area ω and as a
# moment of the wall; B' as a shear flow and a radial force, whose harmonics follow from those by
# equilibrium; $GJ\theta'$ as an even shear flow $1/(2ar^2)$ with opposite radial forces
# $1/(2ar)$ at the corners of the arc. The energy of the arc and of both rings is least for one
# $B_h$, and the twist is $T\ell/(GJ)$ with
#
# $$\ell = \frac{1}{1 + k_a a^3 r\sqrt{r/t}/h}
# \Big[h + e_{TT} - \frac{(2 - e_{TB})^2}{2\kappa + e_{BB}}\Big] + k_t t,\qquad
# \kappa = k\coth(kh/2),$$
#
# where the e are GJ times the work in the rings by the loads of T = 1 and of $B_h$ = 1. A
# prescribed stress makes the rings too compliant; it relaxes as in bending, and more so in wide and
# short arcs: $k_a$ and $k_t$ were fitted to cells of chains of equal notches.


def torsion_length(
    arc: WallSector,
    height: float,
    poisson_ratio: float,
    section: Section,
    sides: Sequence[Side],
    relaxation: float,
) -> float:
    """Compute the effective length ℓ in free torsion of the notch with its ends, mm."""
    r, t, a, n = arc.radius, arc.wall, arc.half_angle, np.arange(1.0, HARMONICS)
    sine, cosine = xp.sin(a), xp.cos(a)
    pole = 2.0 * r * (sine - a * cosine) / (a - sine * cosine)
    # C_w about the shear centre: of the middle line and of the wall, mm⁶.
    line = a**3 - 6.0 * (sine - a * cosine) ** 2 / (a - sine * cosine)
    warping_constant = 2.0 / 3.0 * t * r**5 * line + (2.0 * a * r * t) ** 3 / 144.0
    rigidity = 0.5 / (1.0 + poisson_ratio) * plain_number(section.torsion_constant)
    rate = xp.sqrt(rigidity / warping_constant)
    growth = rate / xp.tanh(0.5 * rate * height)
    # Harmonics of sin φ and φ on the arc.
    sideways = a * (xp.sinc((n - 1.0) * (a / np.pi)) - xp.sinc((n + 1.0) * (a / np.pi)))
    turned = 2.0 * (xp.sin(n * a) / n - a * xp.cos(n * a)) / n
    membrane = r * t * (r * turned - pole * sideways) / (np.pi * warping_constant)
    bent = t**3 / 12.0 * pole * sideways / (np.pi * warping_constant)
    corners = -xp.sin(n * a) / (np.pi * a * r**2)
    through = xp.stack([corners / n, corners, 0.0 * n, 0.0 * n], -1)
    warped = -xp.stack([growth * r / n * membrane, growth * bent, membrane, bent], -1)
    loads = xp.stack([through, relaxation**0.5 * warped - growth * through])
    energy = 0.0
    for side in sides:
        ring = Side(side.boundary, side.own_length)
        flexibility = edge_compliance(r, t, ring, poisson_ratio, True)[1:]
        energy = energy + xp.einsum("ani,nij,bnj->ab", loads, flexibility, loads)
    (torque, mixed), (_, warping) = np.pi * r * rigidity * energy
    length = height + torque - (2.0 - mixed) ** 2 / (2.0 * growth + warping)
    return length / (1.0 + 0.048 * a**3 * r * xp.sqrt(r / t) / height) + 0.365 * t


# Shear of a notch with its ends: relative displacement of its two rings.
#
# A force across the tube, through the middle of the notch and its centre of twist, bends the arc to
# an S, shears it, and distorts the rings. Its compliance times Young's modulus is
#
# $$E\,C = \frac{h^3}{12\,I} + \frac{\delta\,(h + \psi)^2}{4\,I} + s\,(h + \chi)$$
#
# with the length δ that the ends add to the bending about the axis that the force bends it about,
# and the compliance s of the arc's shear, by equilibrium with the stress of bending. The ends
# yield to bending not at the edge but ψ/2 inside the ring, and to shear as χ more of the arc. Both
# grow with the uncut length c; in radii r, walls t and half angles a of the arc, and the length
# $r\sqrt{r/t}$ over which an ovalised ring recovers, they were fitted to cells of chains of equal
# notches.


def shear_compliances(
    arc: WallSector,
    section: Section,
    height: float,
    added: tuple[Any, Any],
    poisson_ratio: float,
    sides: Sequence[Side],
) -> tuple[float, float]:
    """Compute the compliance of the two directions across the tube, times E, 1/mm."""
    r, t, a = arc.radius, arc.wall, arc.half_angle
    angle, weights = gauss_on(0.0, a)
    sine, cosine, centroid = xp.sin(angle), xp.cos(angle), plain_number(arc.section.centroid)
    # Flow of the shear stress round the tube and across its wall, times second moment over wall.
    curl, plate = r**2 + t**2 / 12.0, t**2 / 12.0
    flows = (
        (curl * sine - r * centroid * angle, plate * (2.0 * cosine - centroid / r)),
        (curl * (cosine - xp.cos(a)), plate * 2.0 * sine),
    )
    uncut, reach = xp.stack([1.0 * side.length for side in sides]), r * xp.sqrt(r / t)
    part, deep = uncut / reach, 1.032 * xp.sqrt(r * t)
    recovered = 1.0 - xp.exp(-part / 1.478)
    more = (1.0 + 0.655 * part) / (1.0 + 0.328 * part**2)
    ends = (
        (deep * uncut / xp.hypot(deep, uncut), 0.195 * xp.sqrt(a * r / t) * uncut * more),
        (0.45 * r * (r / t) ** 0.75 * xp.sqrt(a) * recovered, 0.427 * reach / a * recovered),
    )
    moments, true = (
        (of.second_moment_weak, of.second_moment_strong) for of in (arc.section, section)
    )
    # The bending of the rings as beams is no part of the shear.
    bends = sum(side.own_length for side in sides) / (np.pi * r * t * (r**2 + 0.25 * t**2))

    def compliance(of: int) -> float:
        (along, across), (inside, further) = flows[of], map(xp.mean, ends[of])
        # The shear across a wall is a parabola: 6/5 of the energy of an even one.
        work = (along**2 + 1.2 * across**2) @ weights / moments[of] ** 2
        sheared = 4.0 * (1.0 + poisson_ratio) * r * t * work * (height + further)
        turned = added[of] - moments[of] * bends
        bent = height**3 / 12.0 + 0.25 * turned * (height + inside) ** 2
        return plain_number(bent / true[of] + sheared)

    return compliance(0), compliance(1)


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
    alpha_rings: float  # The part of α by the rings, which goes with the moment
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
    reach = reach_of(arc)
    sides = [  # cut where the effects of the edge have died out
        side._replace(length=xp.minimum(side.length, reach * (1.0 + side.shares[0])))
        for side in (proximal, distal)
    ]
    distorted = distortion(arc, poisson_ratio)
    factors = FACTORS[cut]
    added = [
        end_compliance(arc, side, poisson_ratio, distorted.loads, factors.relaxation)
        for side in sides
    ]
    weak, strong, axial, coupling, *_ = map(sum, zip(*added, strict=True))
    length, second = height + weak, plain_number(section.second_moment_weak)
    alpha, alpha_rings, beta = softening(
        arc, distorted, added, second, height, length, poisson_ratio, factors.odd
    )
    shear, sway = shear_compliances(arc, section, height, (weak, strong), poisson_ratio, sides)
    # Finite elements with contact of one tube (OD 1.62, ID 1.40, depth 1.4, height 0.8 mm): angle
    # at first contact over h/(r_o + ȳ), and stiffness 1 to 3° beyond over E t r².
    closing_factor = {"on-axis": 1.0248, "off-axis": 1.0203}[cut]
    closed = 0.354 * arc.wall * arc.radius**2 * length / second
    width = 2.0 * arc.half_angle * arc.radius
    # Fitted: the centre of twist moves out, where the notch is short between long rings.
    between = 0.5 * (sides[0].length + sides[1].length)
    moved_out = 1.0 + 0.027 * between / (height + 0.33 * width)
    return NotchStiffness(
        weak=plain_number(length),
        strong=plain_number(height + strong),
        axial=plain_number(height + axial),
        coupling=plain_number(coupling),
        torsion=plain_number(
            torsion_length(arc, height, poisson_ratio, section, sides, factors.relaxation)
        ),
        shear_centre=plain_number(section.shear_centre) * moved_out,
        shear=shear,
        sway=sway,
        alpha=plain_number(alpha),
        alpha_rings=plain_number(alpha_rings),
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
