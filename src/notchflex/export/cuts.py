"""All cuts of a robot, one after the other along its tube."""

from typing import NamedTuple

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.robot.notches.cut import NotchCut


class PlacedCut(NamedTuple):
    """A cut at its place on the tube.

    Attributes:
        notch: Number of the notch that it belongs to, from 1 at the base.
        cut: The cut; its corners are measured from the base along the tube [mm].
    """

    notch: int
    cut: NotchCut

    @property
    def start(self) -> float:
        """Its proximal end along the tube [mm]."""
        return min(along for along, _ in self.cut.corners)

    @property
    def end(self) -> float:
        """Its distal end along the tube [mm]."""
        return max(along for along, _ in self.cut.corners)


class RobotCuts(NamedTuple):
    """The cuts of a robot.

    Attributes:
        cuts: Every cut, base to tip as the notches stand.
        notch_start: Where each notch starts along the straight tube [mm].
        tip: Where the robot ends [mm]. A cut may reach beyond: the strip of Liu 2022 ends at the
            last cut.
    """

    cuts: tuple[PlacedCut, ...]
    notch_start: tuple[float, ...]
    tip: float


def cuts_of(robot: Robot) -> RobotCuts:
    """Return every cut of a robot in its straight tube.

    Raises:
        InputError: A kind of notch does not know its cuts.

    Example:
        >>> from notchflex.robot import load_robot
        >>> cuts = cuts_of(load_robot("pacheco2021-a"))
        >>> len(cuts.cuts), round(cuts.cuts[-1].start, 9), round(cuts.tip, 9)
        (5, 8.0, 10.0)
    """
    at = robot.tube.base_length
    cuts: list[PlacedCut] = []
    starts: list[float] = []
    neighbours = (None, *robot.notches, None)
    for number, notch in enumerate(robot.notches, start=1):
        layout = notch.cut_layout(robot.tube, neighbours[number - 1], neighbours[number + 1])
        if layout is None:
            raise InputError.UNSUPPORTED(
                f'a notch of kind = "{notch.kind}" has no definition of its cuts, so there is no '
                "drawing, pattern or solid of it; give its class a method `cut_layout`."
            )
        cuts += [PlacedCut(number, cut.moved(at)) for cut in layout.cuts]
        starts.append(at)
        at += layout.length
    return RobotCuts(tuple(cuts), tuple(starts), at)
