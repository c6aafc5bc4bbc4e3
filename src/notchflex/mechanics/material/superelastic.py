"""Pacheco's superelastic Nitinol: three branches of stress over strain, odd in strain.

Pacheco 2021, eq. 13. Their notch takes its moment from the strain of one fibre, the outer one on
the spine (eq. 14 and 16 with the secant modulus of that fibre). With theta = kappa h along the
neutral axis eq. 16 is strain = kappa (r_o - ybar), and eq. 14 at its fixed point is
moment = I stress(strain) / (r_o - ybar): a law of the cross-section, no iteration.
"""

from __future__ import annotations

from typing import Any

from jaxtyping import Array

from notchflex._jax import constant, jnp
from notchflex.mechanics.material.law import (
    NODES,
    WEIGHTS,
    FibreSection,
    Scalar,
    SectionLaw,
    moduli,
    moves_of,
    section_law,
)
from notchflex.robot import Superelastic


class SuperelasticLaw(SectionLaw):
    """Linear, then the flat superelastic branch, then plastic stiffening."""

    # Stresses in MPa.
    # Weak-axis bending follows the curve; everything else (sideways bending, torsion, shear,
    # stretch) stays on the linear branch, of which the paper says nothing.

    moving = "transition_strain", "plastic_strain"
    superelastic_modulus: Scalar
    transition_strain: Scalar
    plastic_strain: Scalar
    plastic_modulus: Scalar
    plastic_exponent: Scalar

    def _branches(self, strain: Scalar) -> tuple[Array, Array, Array]:
        """Split a strain into its parts on the three branches, each with the strain's sign."""
        linear = jnp.clip(strain, -self.transition_strain, self.transition_strain)
        before_plastic = jnp.clip(strain, -self.plastic_strain, self.plastic_strain)
        return linear, before_plastic - linear, strain - before_plastic

    def stress(self, strain: Scalar) -> Scalar:
        """Return the stress of a fibre (MPa), Pacheco 2021 eq. 13, odd in strain."""
        linear, superelastic, plastic = self._branches(strain)
        # exp(b/x) with b < 0 vanishes with all its derivatives at x = 0
        safe = jnp.where(plastic == 0.0, 1.0, jnp.abs(plastic))
        hardening = jnp.sign(plastic) * jnp.exp(self.plastic_exponent / safe)
        return (
            self.elastic_modulus * linear
            + self.superelastic_modulus * superelastic
            + self.plastic_modulus * hardening
        )

    def energy_density(self, strain: Scalar) -> Scalar:
        """Return the area under the curve of `stress` up to a strain, N mm/mm^3."""
        linear, superelastic, plastic = (jnp.abs(part) for part in self._branches(strain))
        at_transition = self.elastic_modulus * linear
        at_plastic = at_transition + self.superelastic_modulus * superelastic
        # The integral of exp(b/x) has no elementary form (it is x exp(b/x) + b E1(-b/x), and
        # E1 is slow here); Gauss's rule is right to 1e-9 for strains up to ten times -b.
        safe = jnp.where(plastic == 0.0, 1.0, plastic)
        hardening = safe * (jnp.exp(self.plastic_exponent / (safe * NODES)) @ WEIGHTS)
        return (
            0.5 * at_transition * linear
            + 0.5 * (at_transition + at_plastic) * superelastic
            + at_plastic * plastic
            + jnp.where(plastic == 0.0, 0.0, self.plastic_modulus * hardening)
        )

    def moment(self, curvature: Scalar, section: FibreSection) -> Scalar:
        """Return the moment taken from the outer fibre on the spine."""
        stress = self.stress(curvature * section.edge_spine)
        return section.second_moment_weak / section.edge_spine * stress

    def bending_energy(self, curvature: Scalar, section: FibreSection, memory: Any) -> Scalar:
        """Return the area under the moment over the curvature."""
        density = self.energy_density(curvature * section.edge_spine)
        return section.second_moment_weak / section.edge_spine**2 * density


@section_law.register
def _(material: Superelastic) -> SuperelasticLaw:
    shift = material.plateau_shift / material.elastic_modulus
    strains = material.transition_strain + shift, material.plastic_strain + shift
    others = material.plastic_modulus, material.plastic_exponent
    numbers = map(constant, (material.superelastic_modulus, *strains, *others))
    return SuperelasticLaw(*moduli(material), *numbers, moves=moves_of(material, 1.0, 1.0))
