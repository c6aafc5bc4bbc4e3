"""Linear elastic material."""

from __future__ import annotations

from typing import Any

from notchflex.mechanics.material.law import FibreSection, Scalar, SectionLaw, moduli, section_law
from notchflex.robot import Linear


class LinearLaw(SectionLaw):
    """Linear elastic law."""

    is_linear = True

    def moment(self, curvature: Scalar, section: FibreSection) -> Scalar:
        """Return the moment in proportion to the curvature."""
        return self.elastic_modulus * section.second_moment_weak * curvature

    def bending_energy(self, curvature: Scalar, section: FibreSection, memory: Any) -> Scalar:
        """Return half the product of moment and curvature."""
        return 0.5 * curvature * self.moment(curvature, section)


@section_law.register
def _(material: Linear) -> LinearLaw:
    return LinearLaw(*moduli(material))
