"""The superelastic material of Pacheco 2021."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from notchflex.robot.kinds import PACHECO, Material, Transforming
from notchflex.robot.part import MOST_STRAIN, Float, Problems, part, positive, quantity


@part
class Superelastic(Transforming, Material):
    """Three branches without memory: elastic, superelastic, plastic (Pacheco 2021, eq. 13).

    The law is odd in strain: a notch bent the other way carries the opposite moment.

    Args:
        elastic_modulus: Modulus of the first branch [MPa].
        superelastic_modulus: Modulus of the second branch [MPa].
        transition_strain: Strain where the second branch begins.
        plastic_strain: Strain where the third branch begins.
        plastic_modulus: Modulus E_p of the third branch, sigma_p + E_p exp(beta / (eps - eps_p))
            [MPa].
        plastic_exponent: beta of the third branch, negative.
        temperature: Temperature of use [deg C]; None is `reference_temperature`.
        reference_temperature: Temperature at which the branches were measured [deg C]; None where
            it is not known, and the temperature does not count.
        plateau_slope: Change of the stress at the transition with the temperature [MPa/K];
            None is 6.5 (Confluent), the literature has 3.4 to 7.8.
        austenite_finish: Austenite finish temperature [deg C], below which a warning tells that
            the material is not superelastic.
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3].
        allowed_strain: Strain beyond which a simulation warns.

    The third branch is not given in the paper; its defaults are those of the authors' code.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> Superelastic(10_000.0, 3_000.0, 0.028).plastic_strain
        0.1
    """

    elastic_modulus: Annotated[
        Float, positive("MPa", "modulus of the elastic branch", usual=(200, 300_000))
    ]
    superelastic_modulus: Annotated[Float, positive("MPa", "modulus of the superelastic branch")]
    transition_strain: Annotated[
        Float,
        positive("", "strain where the superelastic branch begins", at_most=MOST_STRAIN),
    ]
    plastic_strain: Annotated[
        Float, positive("", "strain where the plastic branch begins", at_most=MOST_STRAIN)
    ] = 0.10
    plastic_modulus: Annotated[Float, positive("MPa", "modulus of the plastic branch")] = 1000.0
    plastic_exponent: Annotated[
        Float, quantity("", "exponent of the plastic branch (beta)", below=0)
    ] = -0.01
    _: KW_ONLY
    kind: Literal["superelastic"] = "superelastic"
    papers: ClassVar = (PACHECO,)

    @property
    def plateaus(self) -> tuple[float, ...]:
        """Stress where the superelastic branch begins [MPa], at the temperature of use."""
        return (self.elastic_modulus * self.transition_strain + self.plateau_shift,)

    def conflicts(self) -> Problems:
        """Find a third branch that begins before the second, or too low a temperature."""
        yield from super().conflicts()
        if self.plastic_strain <= self.transition_strain:
            yield (
                "plastic_strain",
                f"is {self.plastic_strain}; it must be greater than the transition strain, "
                f"{self.transition_strain}.",
            )
