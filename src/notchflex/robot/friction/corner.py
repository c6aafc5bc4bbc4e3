"""Friction of a tendon over a sharp edge, as in Gao 2017 and Liu 2022."""

from dataclasses import KW_ONLY
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from notchflex.robot.kinds import GAO, LIU, Friction
from notchflex.robot.part import Float, part, quantity


@part
class Corner(Friction):
    """Coulomb friction at one point, pressed along the bisector of the tendon's two directions.

    Over a turning beta the tension falls at most by the factor (cos(beta/2) - mu sin(beta/2)) /
    (cos(beta/2) + mu sin(beta/2)) (Gao 2017, eq. 23; Liu 2022, eq. 7), which is close to the
    capstan's exp(-mu beta) for a small turning.  It holds while mu tan(beta/2) < 1.

    Args:
        coefficient: Coefficient of friction mu.
        turning: Which rotation of the next body counts where a tendon enters it behind a strip:
            "slope" is the body's own, that of the strip's end; "chord" is the angle of the strip's
            chord (Liu 2022, whose bending angles are chord angles). Behind other notches both are
            the body's own.

    Raises:
        InputError: A value is negative, not finite, of a wrong type or not known.

    Example:
        >>> Corner(0.66).turning
        'slope'
    """

    coefficient: Annotated[Float, quantity("", "coefficient of friction", at_least=0, usual=(0, 2))]
    turning: Annotated[
        Literal["slope", "chord"],
        Field(
            description='"slope" (tendons turn with the body that they enter) or "chord" (with the '
            "chord of the strip before it: Liu 2022)"
        ),
    ] = "slope"
    _: KW_ONLY
    kind: Literal["corner"] = "corner"
    papers: ClassVar = (GAO, LIU)

    @property
    def turns_with_chord(self) -> bool:
        """Whether a tendon turns with the chord of a strip."""
        return self.turning == "chord"
