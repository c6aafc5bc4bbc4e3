"""What a notch removes from the tube: cuts as they are seen from the side."""

from typing import NamedTuple

Point = tuple[float, float]


class NotchCut(NamedTuple):
    """One cut, from the outer surface into the tube and back out.

    Its corners lie in the plane through the tube axis and the middle of the cut.  The first
    coordinate runs along the tube from the start of the notch toward the tip, the second from the
    tube axis toward the side of the cut.

    Attributes:
        side_deg: Side of the tube from which it is cut [deg].
        corners: Corners from the base toward the tip [mm]; the first and the last one lie on the
            outer surface.
        radii: Radius of each corner [mm]; 0 is sharp.
        radial: Whether its walls point to the tube axis (a beam on the axis); otherwise they are
            at right angles to the plane of the corners (a beam or saw beside the axis).
    """

    side_deg: float
    corners: tuple[Point, ...]
    radii: tuple[float, ...]
    radial: bool = False

    def moved(self, along: float) -> "NotchCut":
        """Return the cut farther toward the tip [mm]."""
        return self._replace(corners=tuple((x + along, height) for x, height in self.corners))


class CutLayout(NamedTuple):
    """The cuts of one notch.

    Attributes:
        cuts: The cuts, measured from the start of the notch.
        length: Length of tube from the start of the notch to that of the next one, or to the
            tip [mm].
    """

    cuts: tuple[NotchCut, ...]
    length: float


def slot(
    side_deg: float,
    ends: Point,
    bottom: float,
    surface: float,
    *,
    radius: float = 0.0,
    radial: bool = False,
) -> NotchCut:
    """Return a cut with a flat bottom: a window or a slot.

    Args:
        side_deg: Side from which it is cut [deg].
        ends: Its proximal and its distal face along the tube [mm].
        bottom: Height of its bottom above the tube axis [mm].
        surface: Outer radius of the tube [mm].
        radius: Radius of the two corners at the bottom [mm].
        radial: Whether its walls point to the tube axis.
    """
    start, end = ends
    corners = ((start, surface), (start, bottom), (end, bottom), (end, surface))
    return NotchCut(side_deg, corners, (0.0, radius, radius, 0.0), radial)
