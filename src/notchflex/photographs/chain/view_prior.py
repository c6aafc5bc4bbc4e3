"""Prior of a view before a fit: scale, tilt and distance of the camera."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from notchflex.photographs.chain.chain_table import Numbers


@dataclass(frozen=True)
class ViewPrior:
    """Prior of the view at one position of a photograph, from a board or a ruler.

    Attributes:
        scale: Pixels per mm there; NaN if it is not known.
        scale_deviation: Standard deviation of its logarithm.
        slope: How a plane through the robot leads away from the camera along the axes of the
            photograph, (2,): mm deeper for every mm to the right, and down.
        slope_deviation: Standard deviation of the tilt that follows from it, rad; infinite if it
            is not known.
        perspective: Inverse distance of the camera, 1/mm.
        perspective_deviation: Its standard deviation; infinite if it is not known.
    """

    scale: float = math.nan
    scale_deviation: float = math.inf
    slope: tuple[float, float] = (0.0, 0.0)
    slope_deviation: float = math.inf
    perspective: float = 0.0
    perspective_deviation: float = math.inf

    @property
    def has_scale(self) -> bool:
        """Whether the scale is known."""
        return math.isfinite(self.scale_deviation)

    def tilt(self, direction: float) -> float:
        """Return the tilt of a tube that lies in the plane, by its direction, rad."""
        return math.atan(self.slope[0] * math.cos(direction) + self.slope[1] * math.sin(direction))

    def smaller(self, factor: float) -> ViewPrior:
        """Return the same for a photograph that was made smaller by a factor."""
        return replace(self, scale=self.scale * factor)

    def contradicted(self, numbers: Numbers) -> bool:
        """Whether a fit has another scale."""
        return (
            self.has_scale
            and abs(numbers[3] - math.log(self.scale)) > _APART * self.scale_deviation
        )


NO_PRIOR = ViewPrior()
_APART = 3.0  # standard deviations
