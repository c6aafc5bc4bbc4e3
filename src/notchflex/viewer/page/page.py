"""The page around the scene: controls, numbers and charts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer.page.charts import loop_chart, tendon_chart
from notchflex.viewer.page.legend import legend_html
from notchflex.viewer.page.load_controls import LoadControls
from notchflex.viewer.page.model_controls import ModelControls
from notchflex.viewer.page.readout import notice, readout
from notchflex.viewer.page.robot_controls import RobotControls

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

CHARTS_WIDTH, CONTROLS_WIDTH = 280, 290

# viser's messages, such as that there is no graphics card, cover the scene until they are closed.
# This makes them small, at the lower edge.
STYLE = """<style>
.mantine-Notifications-root { top: auto !important; bottom: 0.5em !important; max-width: 16em; }
.mantine-Notification-root { padding: 2px 6px 2px 16px; }
.mantine-Notification-title { font-size: 11px; margin: 0; }
.mantine-Notification-root:not(:hover) .mantine-Notification-description { display: none; }
</style>"""


class Page:
    """The panels beside the scene; all methods are called by the solver thread."""

    def __init__(self, viewer: Viewer) -> None:
        """Add all panels."""
        self.viewer = viewer
        gui = viewer.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH)
        self._side = gui.add_panel()
        with self._side.add_tab("State"):
            self._readout = gui.add_html("")
            self._loop = gui.add_html("")
            self._legend = gui.add_html("")
            self._tendon = gui.add_html("")
        self._side.dock_left()
        self._side.set_width(CHARTS_WIDTH)
        self._notice = gui.add_html("", order=0.0)
        self._folders: list[Any] = []
        gui.add_html(STYLE, order=99.0)
        self.rebuild()

    def rebuild(self) -> None:
        """Replace the controls for another robot.

        Once for each change, because viser would send updates for controls that had been removed.
        """
        viewer = self.viewer
        for folder in self._folders:
            folder.remove()
        self.loads = LoadControls(viewer)
        self.model = ModelControls(viewer)
        self.robot = RobotControls(viewer)
        self._folders = [*self.loads.folders, *self.model.folders, *self.robot.folders]
        self.name()
        self._first_look()

    def name(self) -> None:
        """Update the name of the robot and the legend."""
        viewer = self.viewer
        viewer.server.gui.set_panel_label(viewer.session.robot.name)
        self._legend.content = legend_html(viewer.session.robot, viewer.scene.grid_cell)

    def update(self) -> None:
        """Update numbers and charts, controls and notice."""
        session = self.viewer.session
        tendon = min(self.loads.active, session.robot.number_of_tendons - 1)
        self._readout.content = readout(session)
        self._loop.content = loop_chart(session, tendon)
        self._tendon.content = tendon_chart(session, tendon)
        self.follow()

    def follow(self) -> None:
        """Update controls and notice."""
        viewer = self.viewer
        self._notice.content = notice(viewer.message or viewer.note)
        self.loads.follow(viewer.goal)
        self.model.follow(viewer.session.robot)

    def busy(self, sentence: str) -> None:
        """Show at once what takes longer."""
        self._notice.content = notice(sentence, waiting=True)
        self.viewer.server.flush()

    def look(self, side: bool = False) -> None:
        """Move the camera of every browser to the default view of the robot.

        Args:
            side: Look normal to the plane in which the robot bends.
        """
        viewer = self.viewer
        for client in viewer.server.get_clients().values():
            eye = viewer.scene.eye(viewer.session.pointing, side, client.camera.aspect)
            client.camera.position, client.camera.look_at = eye.position, eye.target

    def _first_look(self) -> None:
        """Set the first camera of browsers that connect later."""
        eye = self.viewer.scene.eye(self.viewer.session.pointing)
        camera = self.viewer.server.initial_camera
        camera.position, camera.look_at = eye.position, eye.target
