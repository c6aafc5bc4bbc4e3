"""The page around the scene: controls, numbers, charts, and what a person does with them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer.charts import loop_chart, tendon_chart
from notchflex.viewer.load_controls import LoadControls
from notchflex.viewer.model_controls import ModelControls
from notchflex.viewer.readout import legend, notice, readout
from notchflex.viewer.robot_controls import RobotControls

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

CHARTS_WIDTH, CONTROLS_WIDTH = 400, 340


class Page:
    """What stands beside the scene; all of it is called by the thread that solves.

    Args:
        viewer: Whose page it is.
    """

    def __init__(self, viewer: Viewer) -> None:
        """Lay the page out."""
        self.viewer = viewer
        gui = viewer.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH)
        self._side = gui.add_panel()
        with self._side.add_tab("State"):
            self._readout = gui.add_html("")
            self._loop = gui.add_html("")
            self._tendon = gui.add_html("")
            self._legend = gui.add_html("")
        self._side.dock_left()
        self._side.set_width(CHARTS_WIDTH)
        self._notice = gui.add_html("", order=0.0)
        self._folders: list[Any] = []
        self.rebuild()
        self._first_look()

    def rebuild(self) -> None:
        """Lay the controls out anew, for another robot or other ends of sliders.

        Once for each change: of controls that are taken away before they were sent, viser still
        sends the updates, to a page that does not know them.
        """
        viewer = self.viewer
        for folder in self._folders:
            folder.remove()
        viewer.server.gui.set_panel_label(viewer.session.robot.name)
        self.loads = LoadControls(viewer)
        self.model = ModelControls(viewer)
        self.robot = RobotControls(viewer)
        self._folders = [*self.loads.folders, *self.model.folders, *self.robot.folders]
        self._legend.content = legend(viewer.session.robot, viewer.scene.grid_cell)
        self._first_look()

    def tell(self) -> None:
        """Renew numbers, charts and the notice."""
        session = self.viewer.session
        tendon = min(self.loads.active, session.robot.number_of_tendons - 1)
        self._notice.content = notice(self.viewer.message)
        self._readout.content = readout(session)
        self._loop.content = loop_chart(session, tendon)
        self._tendon.content = tendon_chart(session, tendon)
        if self.loads.following:
            self.loads.follow(session.controls)

    def busy(self, sentence: str) -> None:
        """Say at once what takes longer."""
        self._notice.content = notice(sentence, waiting=True)
        self.viewer.server.flush()

    def follow(self) -> None:
        """Put the sliders where the robot stands."""
        self.loads.follow(self.viewer.session.controls)

    def look(self) -> None:
        """Let every browser look at the robot from where it is seen best."""
        place, target = self._first_look()
        for client in self.viewer.server.get_clients().values():
            client.camera.position, client.camera.look_at = place, target

    def _first_look(self) -> tuple[Any, Any]:
        """The same for browsers that come later."""
        place, target = self.viewer.scene.look(self.viewer.session.pointing)
        camera = self.viewer.server.initial_camera
        camera.position, camera.look_at = place, target
        return place, target


__all__ = ["Page"]
