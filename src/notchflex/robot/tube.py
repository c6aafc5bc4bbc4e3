"""The tube that the notches are cut into."""

from typing import Annotated

from pydantic import model_validator

from notchflex.robot.part import Float, ProblemError, part, quantity


@part
class Tube:
    """A straight round tube before it is cut.

    Args:
        outer_diameter: Outer diameter [mm].
        inner_diameter: Inner diameter [mm], less than the outer one.
        base_length: Uncut length between the held end and the first notch [mm].

    Raises:
        InputError: A value is negative or not finite, or the tube has no wall.

    Example:
        >>> Tube(1.62, 1.40).outer_radius
        0.81
    """

    outer_diameter: Annotated[
        Float, quantity("mm", "outer diameter of the tube", above=0, usual=(0.1, 50))
    ]
    inner_diameter: Annotated[
        Float, quantity("mm", "inner diameter of the tube", above=0, usual=(0.05, 50))
    ]
    base_length: Annotated[
        Float, quantity("mm", "uncut length before the first notch", at_least=0)
    ] = 0.0

    @model_validator(mode="after")
    def _has_a_wall(self) -> "Tube":
        if self.inner_diameter >= self.outer_diameter:
            raise ProblemError(
                [
                    (
                        "inner_diameter",
                        f"is {self.inner_diameter} mm; it must be less than the outer diameter, "
                        f"{self.outer_diameter} mm.",
                    )
                ]
            )
        return self

    @property
    def outer_radius(self) -> float:
        """Half the outer diameter [mm]."""
        return self.outer_diameter / 2

    @property
    def inner_radius(self) -> float:
        """Half the inner diameter [mm]."""
        return self.inner_diameter / 2
