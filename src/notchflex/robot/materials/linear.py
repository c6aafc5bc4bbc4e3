"""A linear elastic material."""

from dataclasses import KW_ONLY
from typing import Annotated, Literal

from notchflex.robot.kinds import Material
from notchflex.robot.part import Float, part, positive


@part
class Linear(Material):
    """Stress proportional to strain.

    Args:
        elastic_modulus: Young's modulus [MPa].
        poisson_ratio: Poisson's ratio, for shear and torsion.
        density: Density [kg/m3].
        allowed_strain: Strain beyond which a simulation warns.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> Linear(60_000.0).elastic_modulus
        60000.0
    """

    elastic_modulus: Annotated[Float, positive("MPa", "Young's modulus", usual=(200, 300_000))]
    _: KW_ONLY
    kind: Literal["linear"] = "linear"
