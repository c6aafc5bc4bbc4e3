"""Capstan friction at the edges of the notches."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from notchflex.robot.kinds import PACHECO, Friction
from notchflex.robot.part import Float, part, quantity


@part
class Capstan(Friction):
    """Tension changes by at most exp(coefficient * turning angle) over a contact, plus a loss.

    Pulling over an edge, the tension before it is exp(coefficient * turning) times the tension
    behind it plus `constant_loss`; letting go, the two change places.

    Args:
        coefficient: Coefficient of friction.
        wrap: Where a tendon on a wall arc turns: "geometric" is half the turning at either edge of
            the notch; "whole-before" is all of it ahead of the notch (Pacheco 2021, eq. 10).
        constant_loss: Tension that sliding over an edge of a notch costs whatever the turning [N],
            as in a tight or preloaded channel; None for none.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> Capstan(0.13).wrap
        'geometric'
    """

    coefficient: Annotated[Float, quantity("", "coefficient of friction", at_least=0, usual=(0, 2))]
    wrap: Annotated[
        Literal["geometric", "whole-before"],
        Field(
            description='"geometric" (half the turning at either edge of a notch) or '
            '"whole-before" (all of it ahead of the notch: Pacheco 2021, eq. 10)'
        ),
    ] = "geometric"
    constant_loss: Annotated[
        Float | None,
        quantity("N", "tension that sliding over an edge of a notch costs", at_least=0),
    ] = None
    _: KW_ONLY
    kind: Literal["capstan"] = "capstan"
    papers: ClassVar = (PACHECO,)
