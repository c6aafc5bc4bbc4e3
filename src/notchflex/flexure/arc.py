"""The asymmetric notch of a wrist: what is left of the tube bends to an arc.

Pacheco 2021, eq. 1-3. The rod runs along the neutral axis, ybar from the tube axis toward the
spine, and keeps its length h there. Under a tendon alone its moment is the same all along, so
one constant bending mode is exact; its amplitude is the elastic angle. Nothing else is put in:
s = h - ybar theta at the tube axis (eq. 3) and the closing angle h / (r_o + ybar) follow.
"""

from __future__ import annotations

import numpy as np

from notchflex._jax import constant, jax
from notchflex.errors import InputError
from notchflex.flexure.registry import rod
from notchflex.flexure.rod import Rod
from notchflex.material import FibreSection
from notchflex.robot import ArcNotch, Tube
from notchflex.section import annular_sector, annular_segment

SECTION_OF_CUT = {"on-axis": annular_sector, "off-axis": annular_segment}


@rod.register
def _(notch: ArcNotch, tube: Tube) -> Rod:
    left = SECTION_OF_CUT[notch.cut](
        0.5 * tube.outer_diameter, 0.5 * tube.inner_diameter, notch.depth
    )
    closing = notch.height / (0.5 * tube.outer_diameter + left.centroid)
    if np.radians(notch.precurvature_deg) >= closing:
        raise InputError(
            f"a notch is precurved by {notch.precurvature_deg:g} deg, but it closes at "
            f"{np.degrees(closing):.2f} deg; give a precurvature_deg below that"
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
    bending = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]) / notch.height
    straight = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    precurved = straight + np.radians(notch.precurvature_deg) * bending
    one_interval = jax.tree.map(lambda value: constant([value]), section)
    return Rod(
        start_rotation=constant(turned),
        start_offset=constant(turned @ neutral_axis),
        end_rotation=constant(turned.T),
        end_offset=constant(-neutral_axis),
        length=constant([notch.height]),
        reference_strain=constant(precurved[None]),
        basis=constant(bending[None, :, None]),
        section=one_interval,
        lip=constant([0.5 * tube.outer_diameter + float(left.centroid), 0.0]),
    )
