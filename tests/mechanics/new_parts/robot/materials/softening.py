"""A material that softens with strain."""

from dataclasses import KW_ONLY
from typing import Annotated, Literal

from notchflex.robot.kinds import Material
from notchflex.robot.part import Float, part, quantity


@part
class Softening(Material):
    """Stress E e (1 - (e / limit)^2 / 3), flat at the limit."""

    elastic_modulus: Annotated[Float, quantity("MPa", "Young's modulus", above=0)]
    limit: Annotated[Float, quantity("", "strain at which the stress is largest", above=0)]
    _: KW_ONLY
    kind: Literal["softening"] = "softening"
