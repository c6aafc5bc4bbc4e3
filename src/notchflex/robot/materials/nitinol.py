"""Nitinol with a plateau, and an unloading plateau where it is known."""

from dataclasses import KW_ONLY, replace
from typing import Annotated, Any, ClassVar, Literal

from notchflex.errors import InputError
from notchflex.robot.kinds import Material, Transforming, celsius
from notchflex.robot.part import MOST_STRAIN, Float, Problems, part, positive, quantity


@part
class Nitinol(Transforming, Material):
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
            Young's modulus again, at the temperature of the test; None has no end.
        temperature: Temperature of use [deg C]; None is `reference_temperature`.
        reference_temperature: Temperature at which the plateaus were measured [deg C]; None where
            it is not known, and the temperature does not count.
        plateau_slope: Change of both plateaus in tension with the temperature [MPa/K];
            None is 6.5 (Confluent), the literature has 3.4 to 7.8.
        austenite_finish: Austenite finish temperature [deg C], below which a warning tells that
            the material is not superelastic.
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
        Float, positive("MPa", "Young's modulus up to the plateau", usual=(200, 300_000))
    ] = 42_000.0
    plateau_stress: Annotated[
        Float,
        positive("MPa", "stress in tension where the plateau begins", usual=(10, 2_000)),
    ] = 350.0
    plateau_modulus: Annotated[Float, quantity("MPa", "slope of the plateau", at_least=0)] = 6_000.0
    compression_ratio: Annotated[
        Float,
        positive("", "plateau stress in compression over that in tension", at_most=10.0),
    ] = 1.0
    unloading_stress: Annotated[
        Float | None,
        positive("MPa", "stress in tension where the plateau of unloading ends"),
    ] = None
    transformation_strain: Annotated[
        Float | None,
        positive("", "strain where the plateau of loading ends", at_most=MOST_STRAIN),
    ] = None
    _: KW_ONLY
    kind: Literal["nitinol"] = "nitinol"
    by_fibres: ClassVar = True

    @property
    def plateaus(self) -> tuple[float, ...]:
        """Stresses of the plateaus of loading and unloading [MPa], at the temperature of use."""
        measured = self.plateau_stress, self.unloading_stress
        return tuple(each + self.plateau_shift for each in measured if each is not None)

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
        yield from super().conflicts()
        begin = self.plateau_stress / self.elastic_modulus
        if self.transformation_strain is not None and self.transformation_strain <= begin:
            yield (
                "transformation_strain",
                f"is {self.transformation_strain}; it must be greater than the strain where the "
                f"plateau begins, {begin:.4g}.",
            )


_LOADED, _UNLOADED, _REVERSED = 0.03, 0.025, 0.06  # strains of ASTM F2516


@part
class TensileTest:
    """What data sheets of nitinol print of a tensile test by ASTM F2516.

    Args:
        upper_plateau: Stress at 3 % strain while loading [MPa].
        lower_plateau: Stress at 2.5 % strain while unloading from 6 % [MPa]; None if not known.
        test_temperature: Temperature of the test [deg C]; None if not known.

    Raises:
        InputError: A value is not allowed.

    Example:
        >>> test = TensileTest(upper_plateau=500.0, lower_plateau=220.0, test_temperature=22.0)
        >>> material = test.nitinol(elastic_modulus=50_000.0, plateau_modulus=2_000.0)
        >>> round(material.plateau_stress, 3), round(material.unloading_stress, 3)
        (458.333, 177.083)
    """

    upper_plateau: Annotated[
        Float | None,
        positive("MPa", "upper plateau of a data sheet: stress at 3 % strain"),
    ] = None
    lower_plateau: Annotated[
        Float | None,
        positive("MPa", "lower plateau: stress at 2.5 % strain, unloading from 6 %"),
    ] = None
    test_temperature: Annotated[Float | None, celsius("temperature of the test")] = None

    def conflicts(self) -> Problems:
        """Find a lower plateau that is not below the upper one."""
        if self.upper_plateau and (self.lower_plateau or 0.0) >= self.upper_plateau:
            yield (
                "lower_plateau",
                f"is {self.lower_plateau:g} MPa; it must be less than `upper_plateau`, "
                f"{self.upper_plateau:g} MPa.",
            )

    def nitinol(self, **keys: Any) -> Nitinol:
        """Make the material whose tensile test gives these stresses.

        Args:
            **keys: Other keys of `Nitinol`, of which the moduli count.

        Raises:
            InputError: No material with these moduli gives these stresses.
        """
        form = Nitinol(**keys)
        modulus, hardening = form.elastic_modulus, form.plateau_modulus
        upper, unloading = (
            stress and (stress - hardening * strain) / (1.0 - hardening / modulus)
            for stress, strain in (
                (self.upper_plateau, _LOADED),
                (self.lower_plateau, _UNLOADED),
            )
        )
        loading = upper or form.plateau_stress
        lowest = unloading or loading
        # Both stresses lie on plateaus: behind the elastic lines from zero and from 6 %.
        begins = 0.0 < lowest <= loading < _LOADED * modulus
        last = min(_REVERSED, form.transformation_strain or _REVERSED)
        reached = last - (loading - lowest) / modulus
        if not (begins and last > _LOADED and reached > _UNLOADED):
            raise InputError.INVALID_ROBOT(
                f"TensileTest: with an elastic_modulus of {modulus:g} MPa and a "
                f"plateau_modulus of {hardening:g} MPa no material has an upper_plateau of "
                f"{self.upper_plateau} and a lower_plateau of {self.lower_plateau}; are all in MPa?"
            )
        return replace(
            form,
            plateau_stress=loading,
            unloading_stress=unloading,
            reference_temperature=self.test_temperature,
        )
