"""Contact opposite a solid spine: it closes where its fibre between the edges has zero length.

On the concentric arc of Pacheco 2021 the gap is h - (r_o + ybar) theta.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
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
    """One contact at every notch that has a spine."""

    acts_on_bodies = False

    def fibre(self, rods: Rod) -> Float[Array, "*n 2"]:
        """Locate the fibre between the edges, mm from the neutral axis."""
        return rods.closure

    def gap_response(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> GapResponse:
        """Return the length of the fibre between the edges."""
        del anchors
        weights = of_rod(rod, fibre_stretch(rod.closure))[None]
        strain = rod.length @ (rod.reference_strain + flexure.strain)
        return GapResponse(gap=weights @ strain, wrench=None, slope=fibre_slope(rod, weights))


def closing_angles(rods: Rod) -> Float[np.ndarray, " n"]:
    """Compute the elastic angle at which every notch closes, rad; infinite without a spine.

    It is the amplitude of the first mode at which the fibre between the edges has zero length: for
    an arc h / (r_o + ybar) less the precurvature.
    """
    weights = of_rod(rods, fibre_stretch(constant(rods.closure)))
    free = xp.einsum("nc,nic,ni->n", weights, rods.reference_strain, rods.length)
    slope = xp.einsum("nc,nic,ni->n", weights, xp.asarray(rods.basis)[..., 0], rods.length)
    spine = xp.asarray(rods.has_closure) > 0.0
    return xp.where(spine, -free / xp.where(spine, slope, 1.0), np.inf)


def free_angle(rods: Rod) -> Float[np.ndarray, " n"]:
    """Return the precurvature of every notch with a spine, rad."""
    bending = xp.asarray(in_space(rods.reference_strain))[..., 1]
    return xp.einsum("ni,ni->n", rods.length, bending)
