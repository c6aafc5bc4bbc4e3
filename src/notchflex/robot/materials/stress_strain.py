"""A material as a table of stress over strain."""

from dataclasses import KW_ONLY
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from notchflex.robot.kinds import Material
from notchflex.robot.part import MOST_STRAIN, Float, Problems, part, quantity

_MIN_POINTS, _MAX_POINTS = 2, 10_000

Points = tuple[tuple[float, ...], tuple[float, ...]]
"""Strains, and the stress at each [MPa]."""

Strains = Annotated[
    tuple[Annotated[Float, quantity("", "strain", at_least=0, at_most=MOST_STRAIN)], ...],
    Field(min_length=_MIN_POINTS, max_length=_MAX_POINTS),
]
Stresses = Annotated[
    tuple[Annotated[Float, quantity("MPa", "stress", at_least=0)], ...],
    Field(min_length=_MIN_POINTS, max_length=_MAX_POINTS),
]


@part
class StressStrain(Material):
    """A measured curve of stress over strain, in every fibre of the section; without memory.

    The curve runs straight from zero through the points, and beyond the last one as between the
    last two. Its first piece gives Young's modulus. Stress may stay equal, but not fall. A solve
    takes as many of the points as keep the curve to 1e-6 of its largest stress.

    Args:
        strain: Strains in tension, rising.
        stress: Stress at each of them [MPa]; 0 only at strain 0, which may be left out.
        compression_strain: Strains in compression, as positive numbers; None takes the curve in
            tension.
        compression_stress: Stress at each of them, as positive numbers [MPa].
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3].
        allowed_strain: Strain beyond which a simulation warns.

    Raises:
        InputError: A value is not allowed, the lists have unlike lengths, or a curve falls.

    Example:
        >>> StressStrain(strain=(0.01, 0.06), stress=(400.0, 500.0)).elastic_modulus
        40000.0
    """

    strain: Annotated[Strains, Field(description="strains in tension, rising")]
    stress: Annotated[
        Stresses,
        Field(description="stress at each strain", json_schema_extra={"unit": "MPa"}),
    ]
    compression_strain: Annotated[
        Strains | None, Field(description="strains in compression, as positive numbers")
    ] = None
    compression_stress: Annotated[
        Stresses | None,
        Field(description="stress at each of them, positive", json_schema_extra={"unit": "MPa"}),
    ] = None
    _: KW_ONLY
    kind: Literal["stress-strain"] = "stress-strain"
    by_fibres: ClassVar = True

    @property
    def elastic_modulus(self) -> float:
        """Young's modulus: the slope of the first piece in tension [MPa]."""
        (strain, *_), (stress, *_) = self.in_tension
        return stress / strain

    @property
    def in_tension(self) -> Points:
        """The curve in tension, without zero."""
        return _without_zero(self.strain, self.stress)

    @property
    def in_compression(self) -> Points | None:
        """The curve in compression, as positive numbers without zero; None if that in tension."""
        strain, stress = self.compression_strain, self.compression_stress
        return None if strain is None or stress is None else _without_zero(strain, stress)

    def conflicts(self) -> Problems:
        """Find a curve that falls, and lists of unlike lengths."""
        for of in ("", "compression_"):
            strain, stress = getattr(self, f"{of}strain"), getattr(self, f"{of}stress")
            if strain is not None and stress is not None:
                yield from _curve_problems(strain, stress, of)
            elif strain is not None or stress is not None:
                yield (
                    f"{of}{'stress' if stress is None else 'strain'}",
                    "is missing; give strains and stresses in compression, or neither.",
                )


def _without_zero(strain: tuple[float, ...], stress: tuple[float, ...]) -> Points:
    first = int(strain[0] == 0.0)
    return strain[first:], stress[first:]


def _curve_problems(strain: tuple[float, ...], stress: tuple[float, ...], of: str) -> Problems:
    if len(strain) != len(stress):
        yield (
            f"{of}stress",
            f"has {len(stress)} values and `{of}strain` {len(strain)}; give one stress for "
            "each strain.",
        )
        return
    points = [*zip(strain, stress, strict=True)]
    for number, (low, high) in enumerate(points, start=1):
        if (low == 0.0) != (high == 0.0):
            yield (
                f"{of}stress",
                f"is {high:g} MPa at the strain {low:g} (number {number}); it is 0 at the strain 0 "
                "and nowhere else.",
            )
            return
    for number, ((first, low), (second, high)) in enumerate(pairwise(points), start=2):
        if second <= first:
            yield (
                f"{of}strain",
                f"has {second:g} behind {first:g} (number {number}); strains must rise.",
            )
            return
        if high < low:
            yield (
                f"{of}stress",
                f"falls from {low:g} to {high:g} MPa (number {number}) over the strains {first:g} "
                f"to {second:g}; it must rise or stay equal: a falling piece has no unique "
                "equilibrium. Smooth a noisy curve first.",
            )
            return
