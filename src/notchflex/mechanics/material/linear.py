"""Linear elastic material."""

from __future__ import annotations

from typing import Any

from notchflex._jax import constant
from notchflex.mechanics.material.law import FibreSection, Scalar, SectionLaw, section_law
from notchflex.robot import Linear


class LinearLaw(SectionLaw):
    """Linear elastic law."""

    is_linear = True

    def moment(self, curvature: Scalar, section: FibreSection) -> Scalar:
        """Return the moment in proportion to the curvature."""
        return self.elastic_modulus * section.second_moment_weak * curvature

    def bending_energy(self, curvature: Scalar, section: FibreSection, memory: Any) -> Scalar:
        """Return half the product of moment and curvature."""
        del memory
        return 0.5 * curvature * self.moment(curvature, section)


@section_law.register
def _(material: Linear) -> LinearLaw:
    modulus = constant(material.elastic_modulus)
    return LinearLaw(modulus, modulus / (2.0 * (1.0 + material.poisson_ratio)))
