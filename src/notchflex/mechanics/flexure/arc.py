"""The asymmetric notch of a wrist: the wall that is left bends to an arc (Pacheco 2021, eq. 1-3).

The rod runs along the neutral axis, ybar from the tube axis toward the spine, and keeps its length
h there; s = h - ybar theta at the tube axis (eq. 3) and the closing angle h / (r_o + ybar) follow.
Under a tendon alone its moment is constant, so one mode of bending is exact and its amplitude is
the elastic angle. Other loads add a linear part of bending, both for the strong axis, and torsion
about the shear centre. Shear and stretch, small in a short arc, are left out.
"""

from __future__ import annotations

import numpy as np

from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    about_neutral_axis,
    build_rod,
    legendre_modes,
    shifted,
)
from notchflex.mechanics.flexure.quadrature import RodQuadrature
from notchflex.mechanics.flexure.registry import rod
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.section import SECTION_OF_CUT
from notchflex.robot import ArcNotch, Tube


@rod.register
def _(notch: ArcNotch, tube: Tube, refinement: int = 0) -> Rod:
    cut = SECTION_OF_CUT[notch.cut](tube.outer_radius, tube.inner_radius, notch.depth)
    section, centroid = about_neutral_axis(cut), float(cut.centroid)
    # Smooth all along: one piece, with a node in its middle. With six nodes a notch that bends by a
    # radian in its plane is right to 1e-15; the turns of one that also bends sideways and twists
    # need ten for 3e-8.
    points = RodQuadrature((0.0, notch.height), (7 + 4 * refinement,), (10 + 3 * refinement,))
    bending, twist = 2 + refinement, 1 + refinement
    centre = float(section.shear_centre)
    modes = legendre_modes(points, bending, bending, twist, tendon_modes=1, shear_centre=centre)
    free = STRAIGHT + np.radians(notch.precurvature_deg) * modes.basis[..., 0]
    axis = NeutralAxis(points, start=shifted(-centroid), end=shifted(centroid), strain=free)
    closure = tube.outer_radius + centroid
    return build_rod(axis, section, modes, closure, direction_deg=notch.direction_deg)
