"""Materials of robots as cards of CalculiX."""

from __future__ import annotations

from notchflex.errors import InputError
from notchflex.robot import Linear, Nitinol, StressStrain, Superelastic
from notchflex.robot.kinds import Material

_FAR = 0.2  # strain up to which a curve is continued


def material_cards(material: Material) -> list[str]:
    """Return the cards of a material.

    A material with a plateau is given as plastic with hardening: right while it is loaded, not when
    it unloads. True stress is taken over logarithmic strain.

    Raises:
        InputError: The kind has no cards.
    """
    elastic = ["*ELASTIC", f"{material.elastic_modulus:.10g},{material.poisson_ratio:.10g}"]
    if isinstance(material, Linear):
        return elastic
    points = _curve(material)
    lines = [
        f"{stress:.10g},{strain - stress / material.elastic_modulus:.10g}"
        for strain, stress in points
    ]
    return [*elastic, "*PLASTIC", *lines]


def _curve(material: Material) -> list[tuple[float, float]]:
    """Strains and stresses (MPa) from the end of the elastic line on."""
    modulus = material.elastic_modulus
    if isinstance(material, Superelastic):
        first, slope = material.transition_strain, material.superelastic_modulus
        return [(e, modulus * first + slope * (e - first)) for e in (first, max(_FAR, 2 * first))]
    if isinstance(material, Nitinol):
        first, slope = material.plateau_stress / modulus, material.plateau_modulus
        return [(e, modulus * first + slope * (e - first)) for e in (first, max(_FAR, 2 * first))]
    if isinstance(material, StressStrain):
        return list(zip(material.strain, material.stress, strict=True))
    raise InputError.UNSUPPORTED(
        f"a material of kind {material.kind!r} has no cards for CalculiX; use a linear, "
        "superelastic, nitinol or stress-strain one"
    )
