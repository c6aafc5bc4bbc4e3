"""The points that the tip can reach under the loads at the tip, loading and unloading."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from notchflex import InputError, Load, Robot
from notchflex.plotting import BLUE, ORANGE
from notchflex.viewer.controls import POINTING, ControlRanges, Controls
from notchflex.viewer.overlays.background import Background
from notchflex.viewer.scene.marks import rgb
from notchflex.workspaces import Workspace, workspace

if TYPE_CHECKING:
    import viser

STATES = 6000
_POINT = 0.004  # size of a point in lengths of the robot
NAME = "/cloud"


class ReachableCloud:
    """Points of a workspace: those while loading in one colour, while unloading in another.

    They are computed again, beside the solver thread, when the robot, the loads at the tip or the
    sliders change.

    Args:
        server: The server.
        length: Length of the robot, mm.
        ask: Adds a task of the solver thread.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        length: float,
        ask: Callable[[Callable[[], None]], None],
    ) -> None:
        self._server, self._length = server, length
        self._background: Background[Workspace] = Background(ask)
        self._wanted: Any = None
        self._node: Any = None

    def update(self, robot: Robot, controls: Controls, ends: ControlRanges, shown: bool) -> None:
        """Show or hide the points; compute them where they are not known."""
        key = (robot, controls.tip_force, controls.tip_mass, controls.pointing, ends.tension)
        if not shown:
            if self._node is not None:
                self._node.visible = False
        elif key == self._wanted:
            if self._node is not None and not self._node.visible:
                self._node.visible = True
        else:
            self.remove()
            self._wanted = key
            self._background.request(
                lambda: explored(robot, controls, ends), lambda found: self._show(key, found)
            )

    def remove(self) -> None:
        """Remove the points."""
        if self._node is not None:
            self._node.remove()
        self._node = self._wanted = None

    @property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """The points that are shown, mm."""
        node: Any = self._node
        return np.zeros((0, 3)) if node is None or not node.visible else np.asarray(node.points)

    def _show(self, key: Any, workspace: Workspace) -> None:
        if key != self._wanted:
            return  # of a robot or of loads that are no more
        colours = np.where(workspace.loading[:, None], rgb(BLUE), rgb(ORANGE)).astype(np.uint8)
        self._node = self._server.scene.add_point_cloud(
            NAME,
            workspace.tip.astype(np.float32),
            colours,
            point_size=_POINT * self._length,
            point_shape="circle",
            precision="float32",
        )


def explored(robot: Robot, controls: Controls, ends: ControlRanges) -> Workspace:
    """Return the states that a robot reaches with the tensions of its sliders.

    Raises:
        InputError: There are none.
    """
    load = Load(
        tip_force=controls.tip_force,
        tip_mass=controls.tip_mass,
        base_rotation=POINTING[controls.pointing],
    )
    cloud = workspace(robot, tension=np.array(ends.tension), states=STATES, load=load)
    if not len(cloud):
        raise InputError.NO_DATA("no state of the reachable cloud converged under these loads")
    return cloud
