r"""End compliance: the compliance that the ring beside a notch adds to the notch.

The stress of the arc, that of a beam, acts on the edge of the ring as loads of a shell. Bending of
the notch, bending sideways and tension are the stresses
$[(r + \zeta)\cos\varphi - \bar y]/I$, $(r + \zeta)\sin\varphi/I_y$ and $1/A$ on |φ| < a, with ζ
through the wall; membrane force and moment of the wall, $\int\sigma(1 + \zeta/r)\,d\zeta$ and
$\int\sigma\zeta(1 + \zeta/r)\,d\zeta$, follow in closed form, and so do their harmonics.

A prescribed stress makes the ring too compliant; that the stress at the interface relaxes is one
fitted factor on the harmonics from n = 2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from notchflex._arrays import decide, plain_number, xp
from notchflex.mechanics.ends.ring import HARMONICS, edge_compliance
from notchflex.mechanics.ends.side import Side
from notchflex.mechanics.section import Section, annular_sector

RELAXATION = 0.833
"""λ, factor on the compliance of the harmonics from n = 2, fitted to finite elements."""


class WallSector(NamedTuple):
    """The arc of wall that a cut leaves, as an annular sector with edges at right angles.

    Attributes:
        radius: Mean radius r, mm.
        wall: Wall t, mm.
        half_angle: a, rad, such that the sector has the area of the section, A = 2 a r t.
        section: The sector of that half angle, whatever the cut.
    """

    radius: float
    wall: float
    half_angle: float
    section: Section


def arc_of(outer: float, inner: float, section: Section) -> WallSector:
    """Replace what the cut leaves by a sector of the same area.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        section: The section that the cut leaves.

    Returns:
        The arc.
    """
    radius, wall = 0.5 * (outer + inner), outer - inner
    angle = plain_number(section.area) / (2.0 * radius * wall)
    return WallSector(
        radius, wall, angle, annular_sector(outer, inner, outer * (1.0 + xp.cos(angle)))
    )


class EndCompliance(NamedTuple):
    """Compliance that one ring adds to a notch.

    Attributes:
        weak: Length δ added to that of the bending of the notch, mm.
        strong: Length added to that of the bending sideways, mm.
        axial: Length added to that of the stretch of the centroid, mm.
        coupling: b_c, mm²: I E times the stretch of the centroid per bending moment.
    """

    weak: float
    strong: float
    axial: float
    coupling: float


def arc_harmonics(arc: WallSector) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Expand the edge loads of the arc's stress in harmonics.

    Args:
        arc: The arc of the notch.

    Returns:
        Coefficients of (N, −M), shape (harmonics, 2), for a unit moment, a unit moment sideways
        and a unit tension: in cos nφ, sin nφ, cos nφ.
    """
    r, t, a = arc.radius, arc.wall, arc.half_angle
    n = xp.arange(HARMONICS, dtype=float)
    # Integrals over |φ| < a of cos nφ, cos φ cos nφ, sin φ sin nφ.
    even = 2.0 * a * xp.sinc(n * (a / np.pi))
    below, above = a * xp.sinc((n - 1.0) * (a / np.pi)), a * xp.sinc((n + 1.0) * (a / np.pi))
    cosine, sine = below + above, below - above
    third = t**3 / 12.0

    def loads(constant: np.ndarray, varying: np.ndarray) -> np.ndarray:
        """Compute loads of the stress `constant` + (1 + ζ/r) `varying`, in harmonics of φ."""
        force = t * (constant + varying) + third / r**2 * varying
        moment = third / r * (constant + 2.0 * varying)
        return xp.stack([force, -moment], axis=-1) / _NORM[:, None]

    section = arc.section
    weak = loads(-plain_number(section.centroid) * even, r * cosine) / section.second_moment_weak
    strong = loads(0.0 * sine, r * sine) / section.second_moment_strong
    return weak, strong, loads(even, 0.0 * even) / section.area


_NORM = np.pi * xp.where(xp.arange(HARMONICS) == 0, 2.0, 1.0)
_RELAXED = xp.where(xp.arange(HARMONICS) < 2, 1.0, RELAXATION)


def end_compliance(
    outer: float,
    inner: float,
    arc: WallSector,
    side: Side,
    poisson_ratio: float,
    relaxation: np.ndarray = _RELAXED,
) -> EndCompliance:
    """Compute the compliance of a ring beyond that of a tube as stiff as a beam of its length.

    Args:
        outer: Outer radius, mm.
        inner: Inner radius, mm.
        arc: The arc of the notch.
        side: The ring; up to the plane of symmetry where it lies between two notches.
        poisson_ratio: Poisson's ratio ν.
        relaxation: Factor on each harmonic.

    Returns:
        The added lengths; none where there is no ring.
    """
    ring_length = 0.5 * side.length if side.boundary == "between" else side.length
    if decide(ring_length == 0.0):
        return EndCompliance(0.0, 0.0, 0.0, 0.0)
    weak, strong, axial = arc_harmonics(arc)
    flexibility = edge_compliance(arc.radius, arc.wall, ring_length, poisson_ratio, side.boundary)
    weights = _NORM * relaxation

    def energy(one: np.ndarray, other: np.ndarray) -> float:
        return arc.radius * xp.einsum("n,ni,nij,nj->", weights, one, flexibility, other)

    # As a beam, the ring has the compliances c/(E I_tube) in bending and c/(E A_tube) in tension.
    bends = ring_length / (0.25 * np.pi * (outer**4 - inner**4))
    stretches = ring_length / (np.pi * (outer**2 - inner**2))
    section, offset = arc.section, arc.section.centroid
    return EndCompliance(
        weak=plain_number(section.second_moment_weak * (energy(weak, weak) - bends)),
        strong=plain_number(section.second_moment_strong * (energy(strong, strong) - bends)),
        axial=plain_number(section.area * (energy(axial, axial) - stretches - bends * offset**2)),
        coupling=plain_number(section.second_moment_weak * (energy(weak, axial) - bends * offset)),
    )
