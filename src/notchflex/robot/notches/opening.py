"""Where a tendon leaves one body and enters the next: the openings that a notch has in the wall."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # for the type only: `kinds` imports this file
    from notchflex.robot.kinds import Notch


class Opening(NamedTuple):
    """An opening of the wall through which a tendon enters the body behind a notch.

    A tendon may pass a body by: where its side of the wall is not cut, the wall piece beside it
    belongs to a body nearer the base or nearer the tip.

    Attributes:
        side_deg: Side of the tube that is open [deg]; None is open all round.
        leaves: How far beyond its nominal distal face the last body that the tendon was in has its
            edge here [mm]; the nominal face is `Notch.spacing` beyond the body's origin, and
            `Tube.base_length` for the base.
        enters: How far beyond its origin the body behind the notch has its edge here [mm].

    Example:
        >>> Opening(90.0, 0.0, 0.0).admits(60.0), Opening(90.0, 0.0, 0.0).admits(-60.0)
        (True, False)
    """

    side_deg: float | None
    leaves: float
    enters: float

    def admits(self, direction_deg: float) -> bool:
        """Tell whether a tendon on this side of the tube [deg] comes through."""
        if self.side_deg is None:
            return True
        return math.cos(math.radians(direction_deg - self.side_deg)) > 0.0

    def faces(self, direction_deg: float) -> bool:
        """Tell whether this side of the tube [deg] is the middle of the opening."""
        if self.side_deg is None:
            return False
        return math.cos(math.radians(direction_deg - self.side_deg)) > 1.0 - 1e-9


def openings_along(
    notches: Sequence["Notch"], direction_deg: float
) -> Iterator[tuple[int, Opening]]:
    """Follow one side of the tube: the bodies that a tendon there enters, base to tip.

    Args:
        notches: Every notch of a robot, base to tip, each with `repeat` 1.
        direction_deg: Side of the tube on which the tendon runs [deg].

    Returns:
        The number of each body (1 behind the first notch) and the opening that leads into it; the
        tendon comes to it from the body named before, at first from body 0, the base.
    """
    neighbours = (None, *notches, None)
    for number, notch in enumerate(notches, start=1):
        for opening in notch.openings(neighbours[number - 1], neighbours[number + 1]):
            if opening.admits(direction_deg):
                yield number, opening
