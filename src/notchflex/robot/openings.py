"""The openings of a robot that a tendon comes through, one after the other."""

from collections.abc import Iterator, Sequence

from notchflex.robot.kinds import Notch
from notchflex.robot.notches.opening import Opening


def openings_along(notches: Sequence[Notch], direction_deg: float) -> Iterator[tuple[int, Opening]]:
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
