"""The law of a material that softens."""

from notchflex._jax import constant
from notchflex.mechanics.material import law
from notchflex.robot.materials.softening import Softening


class SofteningLaw(law.SectionLaw):
    """Softening in the plane of bending, linear otherwise."""

    modulus: float
    shear_modulus: float
    limit: float

    def stiffness(self, section):
        return law.elastic_stiffness(self.modulus, self.shear_modulus, section)

    def respond(self, strain, section, memory):
        linear = law.elastic_resultants(self.modulus, self.shear_modulus, section, strain)
        part = (strain[1] * section.edge_spine / self.limit) ** 2
        return law.Response(linear.at[1].multiply(1.0 - part / 3.0), memory)

    def energy(self, strain, section, memory):
        linear = law.elastic_resultants(self.modulus, self.shear_modulus, section, strain)
        part = (strain[1] * section.edge_spine / self.limit) ** 2
        return 0.5 * linear @ strain - linear[1] * strain[1] * part / 12.0


@law.section_law.register
def _(material: Softening) -> SofteningLaw:
    modulus = constant(material.elastic_modulus)
    shear = modulus / (2.0 * (1.0 + material.poisson_ratio))
    return SofteningLaw(modulus, shear, constant(material.limit))
