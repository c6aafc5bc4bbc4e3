"""A notch that leaves a flat strip along the tube."""

from dataclasses import KW_ONLY
from typing import Annotated, Literal

from notchflex.robot.kinds import Notch
from notchflex.robot.part import Float, part, quantity


@part
class FlatNotch(Notch):
    """A notch with a flat strip as its spine."""

    height: Annotated[Float, quantity("mm", "height of the notch along the tube", above=0)]
    thickness: Annotated[Float, quantity("mm", "thickness of the strip", above=0)]
    width: Annotated[Float, quantity("mm", "width of the strip", above=0)]
    offset: Annotated[Float, quantity("mm", "distance of the strip from the tube axis", above=0)]
    _: KW_ONLY
    kind: Literal["flat"] = "flat"
