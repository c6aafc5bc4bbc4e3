"""The page around the scene: controls, numbers and charts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer.page.chart import loop_chart, tendon_chart
from notchflex.viewer.page.folders import LoadControls, PartControls, add_robot_folders
from notchflex.viewer.page.readout import legend_html, notice, readout
from notchflex.viewer.session import SECTIONS

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

CHARTS_WIDTH, CONTROLS_WIDTH = 280, 290

# viser's messages, such as that there is no graphics card, cover the scene until they are closed.
# This makes them small, at the lower edge. Numbers and charts are grey while others are awaited.
STYLE = """<style>
.mantine-Notifications-root { top: auto !important; bottom: 0.5em !important; max-width: 16em; }
.mantine-Notification-root { padding: 2px 6px 2px 16px; }
.mantine-Notification-title { font-size: 11px; margin: 0; }
.mantine-Notification-root:not(:hover) .mantine-Notification-description { display: none; }
body:has([data-waiting]) :is(table, svg[role=img]) { opacity: 0.3; }
</style>"""


class Page:
    """The panels beside the scene; all methods are called by the solver thread."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        gui = viewer.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH)
        side = gui.add_panel()
        with side.add_tab("State"):
            self._readout = gui.add_html("")
            self._loop = gui.add_html("")
            self._legend = gui.add_html("")
            self._tendon = gui.add_html("")
        side.dock_left()
        side.set_width(CHARTS_WIDTH)
        self._notice = gui.add_html("", order=0.0)
        self._folders: list[Any] = []
        gui.add_html(STYLE, order=99.0)
        self.rebuild()

    def rebuild(self) -> None:
        """Replace the controls, and the camera of browsers that connect later, for a new robot.

        Once for each change, because viser would send updates for controls that had been removed.
        """
        viewer = self.viewer
        for folder in self._folders:
            folder.remove()
        self.loads = LoadControls(viewer)
        self.parts = {
            section: PartControls(viewer, section, order)
            for order, section in enumerate(SECTIONS, start=3)
        }
        folders = [part.folder for part in self.parts.values()]
        self._folders = [*self.loads.folders, *folders, *add_robot_folders(viewer)]
        self.name()
        eye = viewer.scene.eye(viewer.session.pointing)
        camera = viewer.server.initial_camera
        camera.position, camera.look_at = eye.position, eye.target

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
        for part in self.parts.values():
            part.follow(viewer.session.robot)

    def busy(self, sentence: str) -> None:
        """Show at once what takes longer."""
        self._notice.content = notice(sentence, waiting=True)
        self.viewer.server.flush()

    def look(self, side: bool = False) -> None:
        """Move the camera of every browser to the first view; `side`: normal to the bend."""
        viewer = self.viewer
        for client in viewer.server.get_clients().values():
            eye = viewer.scene.eye(viewer.session.pointing, side, client.camera.aspect)
            client.camera.position, client.camera.look_at = eye.position, eye.target
