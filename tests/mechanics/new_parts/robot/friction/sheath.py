"""A sheath that takes a constant force."""

from dataclasses import KW_ONLY
from typing import Annotated, Literal

from notchflex.robot.kinds import Friction
from notchflex.robot.part import Float, part, quantity


@part
class Sheath(Friction):
    """Every edge takes the same force from a sliding tendon."""

    loss: Annotated[Float, quantity("N", "tension lost at every edge", above=0)]
    _: KW_ONLY
    kind: Literal["sheath"] = "sheath"
