"""Nitinol with a plateau, and an unloading plateau where it is known."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from notchflex.robot.kinds import Material
from notchflex.robot.part import MOST_STRAIN, Float, Problems, part, quantity


@part
class Nitinol(Material):
    """Elastic, then a plateau with hardening, in every fibre of the section.

    The defaults are usual values for superelastic tubes; they spread from 30 to 65 GPa, 250 to 520
    MPa and 2 to 9 GPa.

    Args:
        elastic_modulus: Young's modulus up to the plateau [MPa].
        plateau_stress: Stress in tension where the plateau begins [MPa].
        plateau_modulus: Slope of the plateau [MPa], less than Young's modulus; 0 is flat.
        compression_ratio: Plateau stress in compression over that in tension.
        unloading_stress: Stress in tension where the plateau of unloading meets the elastic line
            from zero [MPa], less than `plateau_stress`; None unloads along the way it loaded.
        transformation_strain: Strain in tension where the plateau of loading ends and the slope is
            Young's modulus again; None has no end.
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3].
        allowed_strain: Strain beyond which a simulation warns.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> Nitinol(42_000.0, 350.0, 6_000.0, unloading_stress=150.0).compression_ratio
        1.0
    """

    elastic_modulus: Annotated[
        Float, quantity("MPa", "Young's modulus up to the plateau", above=0, usual=(200, 300_000))
    ] = 42_000.0
    plateau_stress: Annotated[
        Float,
        quantity("MPa", "stress in tension where the plateau begins", above=0, usual=(10, 2_000)),
    ] = 350.0
    plateau_modulus: Annotated[Float, quantity("MPa", "slope of the plateau", at_least=0)] = 6_000.0
    compression_ratio: Annotated[
        Float,
        quantity("", "plateau stress in compression over that in tension", above=0, at_most=10.0),
    ] = 1.0
    unloading_stress: Annotated[
        Float | None,
        quantity("MPa", "stress in tension where the plateau of unloading ends", above=0),
    ] = None
    transformation_strain: Annotated[
        Float | None,
        quantity("", "strain where the plateau of loading ends", above=0, at_most=MOST_STRAIN),
    ] = None
    _: KW_ONLY
    kind: Literal["nitinol"] = "nitinol"
    by_fibres: ClassVar = True

    def conflicts(self) -> Problems:
        """Find a plateau that is too steep, ends before it begins, or lies below unloading."""
        if self.plateau_modulus >= self.elastic_modulus:
            yield (
                "plateau_modulus",
                f"is {self.plateau_modulus} MPa; it must be less than Young's modulus, "
                f"{self.elastic_modulus} MPa; are both in MPa?",
            )
        if self.unloading_stress is not None and self.unloading_stress >= self.plateau_stress:
            yield (
                "unloading_stress",
                f"is {self.unloading_stress} MPa; it must be less than the plateau stress, "
                f"{self.plateau_stress} MPa.",
            )
        begin = self.plateau_stress / self.elastic_modulus
        if self.transformation_strain is not None and self.transformation_strain <= begin:
            yield (
                "transformation_strain",
                f"is {self.transformation_strain}; it must be greater than the strain where the "
                f"plateau begins, {begin:.4g}.",
            )
