"""Handle, cloud and sensed force of one robot, shown and hidden together with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from notchflex.viewer.controls import ControlRanges
from notchflex.viewer.overlays.cloud import ReachableCloud
from notchflex.viewer.overlays.handle import TipHandle
from notchflex.viewer.overlays.sensed import SensedArrow
from notchflex.viewer.scene.marks import Shown
from notchflex.viewer.session import Session

if TYPE_CHECKING:
    import viser

# Lengths of the arrows of the handle and of the sensed force in lengths of the robot.
_HANDLE, _ARROW = 0.25, 0.3


class Overlays:
    """Overlays of a robot; see `Shown`.

    Args:
        server: The server.
        session: The robot.
        length: Its length, mm.
        ask: Adds a task of the solver thread.
        aim: Called in the event loop with each place of the dragged handle; see `TipHandle`.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        length: float,
        ask: Callable[[Callable[[], None]], None],
        aim: Callable[[np.ndarray, bool], None],
    ) -> None:
        outer = session.robot.tube.outer_radius
        self.handle = TipHandle(server, _HANDLE * length, aim)
        self.cloud = ReachableCloud(server, length, ask)
        self.sensed = SensedArrow(server, outer, _ARROW * length, ask)

    def update(self, session: Session, ends: ControlRanges, shown: Shown, still: bool) -> None:
        """Move what is shown to the present state.

        Args:
            session: The robot with its load history.
            ends: Ends of the sliders.
            shown: What is shown.
            still: Whether the robot stands still.
        """
        tip = np.asarray(session.state.tip_position, float)
        self.handle.update(tip, shown.handle)
        self.cloud.update(session.robot, session.controls, ends, shown.cloud)
        self.sensed.update(session, shown.sensed, still)

    def remove(self) -> None:
        """Remove all of it."""
        for one in (self.handle, self.cloud, self.sensed):
            one.remove()
