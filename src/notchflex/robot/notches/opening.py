"""Openings of the wall at a notch, through which a tendon passes from body to body."""

import math
from typing import NamedTuple


class Opening(NamedTuple):
    """An opening of the wall through which a tendon enters the body beyond a notch.

    A tendon may bypass a body: where its side of the wall is not cut, the wall there belongs to a
    body nearer the base or nearer the tip.

    Attributes:
        side_deg: Side of the tube that is open [deg]; None is open all round.
        leaves: How far beyond its nominal distal face the last body that the tendon was in has its
            edge here [mm]; the nominal face is `Notch.spacing` beyond the body's origin, and
            `Tube.base_length` for the base.
        enters: Distance of the edge of the body beyond the notch from its origin [mm].
        leaves_rise: How much farther the first of these edges lies for each mm that it lies inside
            the outer surface, across the tube: the edge of a triangular notch leans.
        enters_rise: The same of the second edge.

    Example:
        >>> Opening(90.0, 0.0, 0.0).admits(60.0), Opening(90.0, 0.0, 0.0).admits(-60.0)
        (True, False)
    """

    side_deg: float | None
    leaves: float
    enters: float
    leaves_rise: float = 0.0
    enters_rise: float = 0.0

    def admits(self, direction_deg: float) -> bool:
        """Return whether a tendon on this side of the tube [deg] passes through."""
        if self.side_deg is None:
            return True
        return math.cos(math.radians(direction_deg - self.side_deg)) > 0.0

    def inside(self, direction_deg: float, outer_radius: float, radius: float) -> float:
        """Return the depth of a line below the outer surface, across the tube [mm].

        Args:
            direction_deg: Side of the tube on which the line runs [deg].
            outer_radius: Outer radius of the tube [mm].
            radius: Distance of the line from the tube axis [mm].
        """
        if self.side_deg is None:
            return outer_radius - radius
        return outer_radius - radius * math.cos(math.radians(direction_deg - self.side_deg))

    def faces(self, direction_deg: float) -> bool:
        """Return whether this side of the tube [deg] is the middle of the opening."""
        if self.side_deg is None:
            return False
        return math.cos(math.radians(direction_deg - self.side_deg)) > 1.0 - 1e-9
