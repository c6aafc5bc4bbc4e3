"""Lips opposite a solid spine: they meet where the fibre between them has no length left.

On the concentric arc of Pacheco 2021 the gap is h - (r_o + ybar) theta.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jnp
from notchflex.contact.lip import LipGroup, Touch
from notchflex.flexure import FlexureState, Rod, fibre_stretch


class SpineLips(LipGroup):
    """One pair of lips at every notch that has a spine."""

    acts_on_bodies = False
    closes: Float[Array, "*n l"]

    def leave_base(self) -> Any:
        """Nothing is carried: these lips concern their own flexure alone."""
        return ()

    def no_reaction(self) -> Any:
        """Nothing is handed back."""
        return ()

    def touch(
        self,
        rod: Rod,
        flexure: FlexureState,
        force: Float[Array, " l"],
        carried: Any,
        reaction: Any,
    ) -> Touch:
        """Length of the fibre between the lips."""
        to_lip = rod.length[:, None] * fibre_stretch(rod.lip)[None]
        gap = jnp.sum(to_lip * (rod.reference_strain + flexure.strain))
        slope = jnp.einsum("ic,icm->m", to_lip, rod.basis)
        return Touch(
            gap=gap[None],
            pull=-force[0] * self.closes[0] * slope,
            wrench=None,
            carried=carried,
            reaction=reaction,
        )


def closing_travel(rods: Rod) -> Float[np.ndarray, " n"]:
    """Elastic angle at which every notch with a spine closes, rad; infinite for other notches.

    It is where the first mode, whose amplitude is that angle, leaves no length between the lips;
    for an arc h / (r_o + ybar) less the precurvature.
    """
    lip = fibre_stretch(constant(rods.lip))
    free = np.einsum("nc,nic,ni->n", lip, rods.reference_strain, rods.length)
    slope = np.einsum("nc,nic,ni->n", lip, np.asarray(rods.basis)[..., 0], rods.length)
    spine = np.asarray(rods.lip_closes) > 0.0
    return np.where(spine, -free / np.where(spine, slope, 1.0), np.inf)


def free_angle(rods: Rod) -> Float[np.ndarray, " n"]:
    """Angle of every notch with a spine before anything pulls: its precurvature, rad."""
    return np.einsum("ni,ni->n", rods.length, np.asarray(rods.reference_strain)[..., 1])
