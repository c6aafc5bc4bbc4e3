"""The law of a material that softens."""

from notchflex._jax import constant
from notchflex.mechanics.material import law
from notchflex.robot.materials.softening import Softening


class SofteningLaw(law.SectionLaw):
    """Softening in the plane of bending, linear otherwise."""

    limit: float

    def moment(self, curvature, section):
        linear = self.elastic_modulus * section.second_moment_weak * curvature
        return linear * (1.0 - (curvature * section.edge_spine / self.limit) ** 2 / 3.0)

    def bending_energy(self, curvature, section, memory):
        linear = self.elastic_modulus * section.second_moment_weak * curvature
        part = (curvature * section.edge_spine / self.limit) ** 2
        return linear * curvature * (0.5 - part / 12.0)


@law.section_law.register
def _(material: Softening) -> SofteningLaw:
    modulus = constant(material.elastic_modulus)
    shear = modulus / (2.0 * (1.0 + material.poisson_ratio))
    return SofteningLaw(modulus, shear, constant(material.limit))
