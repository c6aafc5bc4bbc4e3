"""A material as a table of stress over strain."""

from collections.abc import Iterator
from dataclasses import KW_ONLY
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from notchflex.robot.kinds import Material
from notchflex.robot.part import MOST_STRAIN, Float, ProblemError, part, quantity

_MIN_POINTS, _MAX_POINTS = 2, 40
# Where a curve is flatter than this part of Young's modulus the sums over fibres have jumps.
_MIN_RELATIVE_SLOPE = 0.01

Strains = Annotated[
    tuple[Annotated[Float, quantity("", "strain", above=0, at_most=MOST_STRAIN)], ...],
    Field(min_length=_MIN_POINTS, max_length=_MAX_POINTS),
]
Stresses = Annotated[
    tuple[Annotated[Float, quantity("MPa", "stress", above=0)], ...],
    Field(min_length=_MIN_POINTS, max_length=_MAX_POINTS),
]


@part
class StressStrain(Material):
    """A measured curve of stress over strain, in every fibre of the section; without memory.

    The curve runs straight from zero through the points, and beyond the last one as between the
    last two. Its first piece gives Young's modulus. Stress must rise from point to point.

    Args:
        strain: Strains in tension, without zero, rising.
        stress: Stress at each of them [MPa], rising.
        compression_strain: Strains in compression, as positive numbers; None takes the curve in
            tension.
        compression_stress: Stress at each of them, as positive numbers [MPa].
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3].
        allowed_strain: Strain beyond which a simulation warns.

    Raises:
        InputError: A value is not allowed, the lists have unlike lengths, or a curve does not rise.

    Example:
        >>> StressStrain(strain=(0.01, 0.06), stress=(400.0, 500.0)).elastic_modulus
        40000.0
    """

    strain: Annotated[Strains, Field(description="strains in tension, without zero, rising")]
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

    @property
    def by_fibres(self) -> bool:
        """Its sections are summed up fibre by fibre."""
        return True

    @property
    def elastic_modulus(self) -> float:
        """Young's modulus: the slope of the first piece in tension [MPa]."""
        return self.stress[0] / self.strain[0]

    @model_validator(mode="after")
    def _curves_rise(self) -> "StressStrain":
        problems = list(self._problems(self.strain, self.stress, ""))
        strain, stress = self.compression_strain, self.compression_stress
        if strain is not None and stress is not None:
            problems += self._problems(strain, stress, "compression_")
        elif strain is not None or stress is not None:
            missing = "stress" if stress is None else "strain"
            problems.append(
                (
                    f"compression_{missing}",
                    "is missing; give strains and stresses in compression, or neither.",
                )
            )
        if problems:
            raise ProblemError(problems)
        return self

    def _problems(
        self, strain: tuple[float, ...], stress: tuple[float, ...], of: str
    ) -> Iterator[tuple[str, str]]:
        if len(strain) != len(stress):
            yield (
                f"{of}stress",
                f"has {len(stress)} values and `{of}strain` {len(strain)}; give one stress for "
                "each strain.",
            )
            return
        min_slope = _MIN_RELATIVE_SLOPE * self.elastic_modulus
        for number, ((first, low), (second, high)) in enumerate(
            pairwise(zip((0.0, *strain), (0.0, *stress), strict=True)), start=1
        ):
            if second <= first:
                yield (
                    f"{of}strain",
                    f"has {second:g} behind {first:g} (number {number}); strains must rise.",
                )
                return
            if not (high - low) / (second - first) >= min_slope:
                yield (
                    f"{of}stress",
                    f"rises from {low:g} to {high:g} MPa (number {number}) over the strains "
                    f"{first:g} to {second:g}; it must rise by at least a hundredth of Young's "
                    f"modulus, {min_slope:g} MPa per strain.",
                )
                return
