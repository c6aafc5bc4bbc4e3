"""Lips opposite a solid spine: they meet where the fibre between them has no length left.

On the concentric arc of Pacheco 2021 the gap is h - (r_o + ybar) theta.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.mechanics.contact.pairs import ContactGroup, GapResponse
from notchflex.mechanics.flexure import (
    FlexureState,
    Rod,
    fibre_slope,
    fibre_stretch,
    in_space,
    of_rod,
)
from notchflex.mechanics.motion import Motion


class SpineContact(ContactGroup):
    """One pair of lips at every notch that has a spine."""

    acts_on_bodies = False

    def fibre(self, rods: Rod) -> Float[Array, "*n 2"]:
        """Locate the fibre between the lips, mm from the neutral axis."""
        return rods.closure

    def gap_response(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> GapResponse:
        """Return the length of the fibre between the lips."""
        del anchors
        to_lip = of_rod(rod, fibre_stretch(rod.closure))[None]
        strain = rod.length @ (rod.reference_strain + flexure.strain)
        return GapResponse(gap=to_lip @ strain, wrench=None, slope=fibre_slope(rod, to_lip))


def closing_travel(rods: Rod) -> Float[np.ndarray, " n"]:
    """Elastic angle at which every notch with a spine closes, rad; infinite for other notches.

    It is where the first mode, whose amplitude is that angle, leaves no length between the lips;
    for an arc h / (r_o + ybar) less the precurvature.
    """
    lip = of_rod(rods, fibre_stretch(constant(rods.closure)))
    free = np.einsum("nc,nic,ni->n", lip, rods.reference_strain, rods.length)
    slope = np.einsum("nc,nic,ni->n", lip, np.asarray(rods.basis)[..., 0], rods.length)
    spine = np.asarray(rods.has_closure) > 0.0
    return np.where(spine, -free / np.where(spine, slope, 1.0), np.inf)


def free_angle(rods: Rod) -> Float[np.ndarray, " n"]:
    """Angle of every notch with a spine before anything pulls: its precurvature, rad."""
    bending = np.asarray(in_space(rods.reference_strain))[..., 1]
    return np.einsum("ni,ni->n", rods.length, bending)
