"""The backbone between two disks: a round rod that bends to all sides, twists, stretches, shears.

Curvature and twist are Legendre polynomials of arc length. Stretch and shear have modes of their
own: a force on the end is nearly constant along a gap. The shear area is the whole area, as
everywhere (`SectionLaw.elastic`): tdcr-modeling and SoRoSim take the same factor of 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    build_rod,
    legendre,
    rod_quadrature,
    shifted,
)
from notchflex.mechanics.flexure.rod import Rod, Site, rod, section_fibres
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.section import FibresAt, Points, gauss_on, gauss_rule
from notchflex.robot import RodGap, Tube


@rod.register
def _(notch: RodGap, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    length = notch.length
    points = rod_quadrature((0.0, length), (5 + refinement,), (5 + 3 * refinement,))
    polynomials = legendre(2.0 * points.positions / length - 1.0, 3 + refinement)
    # Strains by their number (about x, y, z; along x, y, z), those in the plane of bending first.
    # A twist that varies changes the tip by 1e-7 of the length.
    bending, twist, force = 3 + refinement, (1, 3, 4, 5)[refinement], 1 + refinement
    counts = {1: bending, 3: force, 5: force, 0: bending, 2: twist, 4: force}
    modes = xp.stack(
        [
            polynomials[:, degree, None] * np.eye(6)[strain]
            for strain, count in counts.items()
            for degree in range(count)
        ],
        axis=-1,
    )
    in_plane = sum([*counts.values()][:3])
    basis = StrainModes(modes / length, (in_plane, in_plane, modes.shape[-1]))
    free = STRAIGHT + xp.radians(notch.precurvature_deg) * basis.basis[..., 0]
    axis = NeutralAxis(points, shifted(), shifted(), strain=free)
    return build_rod(
        axis,
        ring_section(notch.diameter, notch.inner_diameter),
        basis,
        direction_deg=notch.direction_deg,
    )


def ring_section(outer_diameter: Any, inner_diameter: Any) -> FibreSection:
    """Return the section of a round rod, or of a tube."""
    outer, inner = 0.5 * outer_diameter, 0.5 * inner_diameter
    second = 0.25 * np.pi * (outer**4 - inner**4)
    return FibreSection(
        area=constant(np.pi * (outer**2 - inner**2)),
        second_moment_weak=constant(second),
        second_moment_strong=constant(second),
        torsion_constant=constant(2.0 * second),
        shear_centre=constant(0.0),
        edge_spine=constant(outer),
        edge_near=constant(outer),
        edge_across=constant(0.0),
        outer_radius=constant(outer),
        half_angle=constant(np.pi),
    )


@section_fibres.register
def _(notch: RodGap, tube: Tube) -> FibresAt:

    def fibres(_near: Any, _spine: Any, count: int) -> Points:
        # Points of rings; by symmetry those of half a ring.
        radii, widths = gauss_on(0.5 * notch.inner_diameter, 0.5 * notch.diameter, 24)
        angles, shares = gauss_on(0.0, np.pi, 48)
        arms = xp.outer(radii, xp.cos(angles))
        return gauss_rule(arms.ravel(), xp.outer(2.0 * radii * widths, shares).ravel(), count)

    return fibres
