"""The asymmetric notch of a wrist: what is left of the tube bends to an arc.

Pacheco 2021, eq. 1-3. The rod runs along the neutral axis, ybar from the tube axis toward the
spine, and keeps its length h there. Under a tendon alone its moment is the same all along, so
one constant bending mode is exact; its amplitude is the elastic angle. Nothing else is put in:
s = h - ybar theta at the tube axis (eq. 3) and the closing angle h / (r_o + ybar) follow.

Under other loads the moment changes along the notch, and there may be a sideways moment and a
torque: a linear part of the bending, both for the strong axis, and torsion about the shear centre.
Shear and stretch, which a short arc hardly gives, are left out.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander

from notchflex._jax import constant, jax
from notchflex.mechanics.flexure.quadrature import RodQuadrature
from notchflex.mechanics.flexure.registry import rod
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.section import SECTION_OF_CUT
from notchflex.robot import ArcNotch, Tube


@rod.register
def _(notch: ArcNotch, tube: Tube, refinement: int = 0) -> Rod:
    left = SECTION_OF_CUT[notch.cut](
        0.5 * tube.outer_diameter, 0.5 * tube.inner_diameter, notch.depth
    )
    section = FibreSection(
        area=left.area,
        second_moment_weak=left.second_moment_weak,
        second_moment_strong=left.second_moment_strong,
        torsion_constant=left.torsion_constant,
        shear_centre=left.shear_centre - left.centroid,
        edge_spine=left.edge_spine,
        edge_near=left.edge_near,
    )
    cosine, sine = np.cos(np.radians(notch.direction_deg)), np.sin(np.radians(notch.direction_deg))
    turned = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    neutral_axis = np.array([-1.0, 0.0, 0.0]) * left.centroid
    # Smooth all along: one piece, with a node in its middle. With six nodes a notch that bends by a
    # radian in its plane is right to 1e-15; the turns of one that also bends sideways and twists
    # need ten for 3e-8.
    nodes = (7 + 4 * refinement,)
    places = RodQuadrature((0.0, notch.height), nodes, (10 + 3 * refinement,))
    place = 2.0 * places.every / notch.height - 1.0
    basis = _modes(place, float(section.shear_centre), refinement) / notch.height
    straight = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    reference = straight + np.radians(notch.precurvature_deg) * basis[..., 0]
    count = nodes[0]
    return Rod(
        # The followed curve is a point.
        **places.fields(None, basis, reference),
        start_rotation=constant(turned),
        start_offset=constant(turned @ neutral_axis),
        curve_rotation=constant(np.eye(3)),
        curve_offset=constant(np.zeros(3)),
        end_rotation=constant(turned.T),
        end_offset=constant(-neutral_axis),
        reference_strain=constant(reference[:count]),
        section=jax.tree.map(lambda value: constant(np.full(count, value)), section),
        closure=constant([0.5 * tube.outer_diameter + float(left.centroid), 0.0]),
        has_closure=constant(1.0),
        linear_kinematics=constant(0.0),
        chord=constant(0.0),
        padding_mask=constant(np.zeros(basis.shape[-1])),
        levels=(1, 2 + refinement, basis.shape[-1]),
    )


def _modes(part: np.ndarray, shear_centre: float, refinement: int) -> np.ndarray:
    """Strain per mode, times the notch's height, at places from -1 to 1: (nodes, 6, modes)."""
    bending = 2 + refinement
    twist = 1 + refinement
    modes = np.zeros((len(part), 6, 2 * bending + twist))
    modes[:, 1, :bending] = modes[:, 0, bending : 2 * bending] = legvander(part, bending - 1)
    modes[:, 2, 2 * bending :] = legvander(part, twist - 1)
    # Twist about the shear centre shears the neutral axis, which lies off it, sideways.
    modes[:, 4, 2 * bending :] = shear_centre * modes[:, 2, 2 * bending :]
    return modes
