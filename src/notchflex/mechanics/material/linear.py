"""Linear elastic material."""

from __future__ import annotations

from typing import Any

from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.mechanics.material.law import (
    FibreSection,
    Response,
    SectionLaw,
    elastic_resultants,
    elastic_stiffness,
    section_law,
)
from notchflex.robot import Linear


class LinearLaw(SectionLaw):
    """Hooke's law. Moduli in MPa."""

    is_linear = True
    elastic_modulus: Float[Array, ""]
    shear_modulus: Float[Array, ""]

    def stiffness(self, section: FibreSection) -> Float[Array, "*shape 6 6"]:
        """Constant stiffness."""
        return elastic_stiffness(self.elastic_modulus, self.shear_modulus, section)

    def respond(self, strain: Float[Array, " 6"], section: FibreSection, memory: Any) -> Response:
        """Resultants in proportion to the strains."""
        moduli = self.elastic_modulus, self.shear_modulus
        return Response(elastic_resultants(*moduli, section, strain), memory)

    def energy(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> Float[Array, ""]:
        """Half the product of resultants and strains."""
        return 0.5 * strain @ self.respond(strain, section, memory).resultants


@section_law.register
def _(material: Linear) -> LinearLaw:
    modulus = constant(material.elastic_modulus)
    return LinearLaw(modulus, modulus / (2.0 * (1.0 + material.poisson_ratio)))
