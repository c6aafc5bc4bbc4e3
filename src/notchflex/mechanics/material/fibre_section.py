"""Properties of a cross-section of a flexure that material laws need."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import decide, xp
from notchflex._jax import constant
from notchflex._pytree import Pytree


class NotchEnds(Pytree):
    """Compliance of the rings beside a notch, added to that of its section.

    Compliances are fractions of that of the section along the length of the flexure: a stiffness is
    that of the section over 1 + fraction. A fraction may be negative, above -1, for stiff ends.

    Attributes:
        weak: Fraction added in the bending of the notch.
        strong: In sideways bending.
        axial: In stretch.
        torsion: In torsion.
        odd: Flattening by bending: the distance of the fibres falls to 1/q of their own,
            q = 1 + odd * kappa + even * kappa^2, at the elastic curvature kappa about the weak
            axis (positive closes), mm.
        even: Its even part, mm^2.
        material_share: Share of `weak` that follows the material; the rest stays elastic.
        sway: In shear sideways.
        push: In shear in the plane of bending.
        oblique: Moment about x by the twist, and torsion moment by the curvature about x, over
            Young's modulus, mm^4; its square is below the product of both stiffnesses.
    """

    weak: Float[Array, "*shape"]
    strong: Float[Array, "*shape"]
    axial: Float[Array, "*shape"]
    torsion: Float[Array, "*shape"]
    odd: Float[Array, "*shape"]
    even: Float[Array, "*shape"]
    material_share: Float[Array, "*shape"]
    sway: Float[Array, "*shape"] | float = 0.0
    push: Float[Array, "*shape"] | float = 0.0
    oblique: Float[Array, "*shape"] | float = 0.0

    @classmethod
    def rigid(cls, like: Float[Array, "*shape"]) -> NotchEnds:
        """Return rigid ends, in the shape of an array."""
        return cls(*(xp.zeros(xp.shape(like)) for _ in range(10)))  # pyright: ignore

    def flattening(self, curvature: Float[Array, ""]) -> Float[Array, ""]:
        """Compute the factor q by which the distances of the fibres shrink at a curvature."""
        return 1.0 + curvature * (self.odd + curvature * self.even)

    def slope_factor(self, curvature: Float[Array, ""]) -> Float[Array, ""]:
        """Compute the relative tangent stiffness of an elastic notch, times q^3."""
        return 1.0 - curvature * (self.odd + 3.0 * curvature * self.even)


class Fibres(Pytree):
    """Fibres of a section, for laws that sum their stresses.

    Attributes:
        arm: Distance of each fibre from the neutral axis, positive toward the spine, mm.
        area: Its area, mm^2.
    """

    arm: Float[Array, "*shape fibres"]
    area: Float[Array, "*shape fibres"]


class FibreSection(Pytree):
    """Properties of a cross-section about its neutral axis. Units mm.

    The section's x points to the cut side, z along the rod. Leading axes are allowed.

    Attributes:
        area: Area, mm^2.
        second_moment_weak: Second moment for bending that closes the notch (about y), mm^4.
        second_moment_strong: Second moment for sideways bending (about x), mm^4.
        torsion_constant: Torsion constant, mm^4.
        shear_centre: Distance of the shear centre from the neutral axis toward the spine, mm.
        edge_spine: Distance of the outer fibre on the spine from the neutral axis, mm.
        edge_near: Distance of the farthest fibre on the cut side, mm.
        ends: Compliance of the ends of the notch; None where no flexure of a chain has any.
        fibres: Its fibres; None where the material does not use them.
        edge_across: Distance from the line of symmetry to the farthest fibre on the cut side, mm.
        outer_radius: Radius of the arc that bounds the spine, mm; 0 for a straight line.
        half_angle: Half angle of that arc, rad.
    """

    area: Float[Array, "*shape"]
    second_moment_weak: Float[Array, "*shape"]
    second_moment_strong: Float[Array, "*shape"]
    torsion_constant: Float[Array, "*shape"]
    shear_centre: Float[Array, "*shape"]
    edge_spine: Float[Array, "*shape"]
    edge_near: Float[Array, "*shape"]
    ends: NotchEnds | None = None
    fibres: Fibres | None = None
    edge_across: Float[Array, "*shape"] | float = 0.0
    outer_radius: Float[Array, "*shape"] | float = 0.0
    half_angle: Float[Array, "*shape"] | float = 0.0

    def stiffened(self, factor: Float[np.ndarray, "*shape"]) -> FibreSection:
        """Multiply the stiffness in all directions; for plain arrays. Strains stay as they are."""
        names = ("area", "second_moment_weak", "second_moment_strong", "torsion_constant")
        moments = {name: constant(factor * getattr(self, name)) for name in names}
        ends, fibres = self.ends, self.fibres
        if ends is not None:
            ends = dataclasses.replace(ends, oblique=constant(factor * ends.oblique))
        if fibres is not None:
            fibres = dataclasses.replace(fibres, area=constant(factor[..., None] * fibres.area))
        return dataclasses.replace(self, **moments, ends=ends, fibres=fibres)

    @property
    def softens(self) -> bool:
        """Whether any section flattens as it bends; for plain arrays."""
        ends = self.ends
        return ends is not None and decide(xp.any(ends.odd) | xp.any(ends.even))
