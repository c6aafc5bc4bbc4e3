"""Materials of robots as cards of CalculiX."""

from __future__ import annotations

from notchflex.errors import InputError
from notchflex.robot import Linear, Nitinol, StressStrain, Superelastic
from notchflex.robot.kinds import Material

_MAX_STRAIN = 0.2  # strain up to which a curve is continued


def material_cards(material: Material) -> list[str]:
    """Return the cards of a material.

    A material with a plateau is given as plastic with hardening: right while it is loaded, not when
    it unloads. True stress is taken over logarithmic strain.

    Raises:
        InputError: The kind has no cards.
    """
    supported = with_cards(material)
    modulus = supported.elastic_modulus
    elastic = ["*ELASTIC", f"{modulus:.10g},{supported.poisson_ratio:.10g}"]
    if isinstance(supported, Linear):
        return elastic
    points = _curve(supported, modulus)
    lines = [f"{stress:.10g},{strain - stress / modulus:.10g}" for strain, stress in points]
    return [*elastic, "*PLASTIC", *lines]


def with_cards(material: Material) -> Linear | Superelastic | Nitinol | StressStrain:
    """Return a material of a kind that has cards.

    Raises:
        InputError: The kind has none.
    """
    if isinstance(material, (Linear, Superelastic, Nitinol, StressStrain)):
        return material
    raise InputError.UNSUPPORTED(
        f"a material of kind {material.kind!r} has no cards for CalculiX; use a linear, "
        "superelastic, nitinol or stress-strain one"
    )


def _curve(
    material: Superelastic | Nitinol | StressStrain, modulus: float
) -> list[tuple[float, float]]:
    """Strains and stresses (MPa) from the end of the elastic line on."""
    if isinstance(material, Superelastic):
        first, slope = material.transition_strain, material.superelastic_modulus
        return [
            (e, modulus * first + slope * (e - first)) for e in (first, max(_MAX_STRAIN, 2 * first))
        ]
    if isinstance(material, Nitinol):
        first, slope = material.plateau_stress / modulus, material.plateau_modulus
        return [
            (e, modulus * first + slope * (e - first)) for e in (first, max(_MAX_STRAIN, 2 * first))
        ]
    return list(zip(material.strain, material.stress, strict=True))
