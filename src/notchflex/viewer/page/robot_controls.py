"""Visibility, other robots, and files to save."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from notchflex.errors import InputError
from notchflex.robot import Robot, list_robots, load_robot, robot_from_text
from notchflex.viewer.page import saving
from notchflex.viewer.page.sliders import Dropdown, add_button

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_SHOWN = {
    "tendons": "tendons",
    "contacts": "contacts",
    "frames": "base and tip frames",
    "loads": "loads at the tip",
    "see_through": "transparent tube",
}
_CHOOSE = "choose ..."


class RobotControls:
    """The folders "Show", "Robot" and "Save" of a page."""

    def __init__(self, viewer: Viewer) -> None:
        """Add them."""
        self._viewer = viewer
        gui = viewer.server.gui
        with gui.add_folder("Show", order=5.0, expand_by_default=False) as show:
            for field in dataclasses.fields(viewer.shown):
                self._switch(field.name)
            side = "View from the side"
            add_button(gui, side, lambda _: viewer.ask(lambda: viewer.page.look(side=True)))
            add_button(gui, "View as at first", lambda _: viewer.ask(viewer.page.look))
        with gui.add_folder("Robot", order=6.0, expand_by_default=False) as robot:
            Dropdown(gui, "ready robot", (_CHOOSE, *list_robots()), self._load)
            file = gui.add_upload_button("Load a robot file", mime_type=".toml")
        with gui.add_folder("Save", order=7.0, expand_by_default=False) as save:
            hint = "with loads, loop, numbers and legend"
            add_button(gui, "Picture (PNG)", self._picture, hint)
            add_button(gui, "Table (CSV)", self._table, "all steps, as notchflex simulate writes")
            add_button(gui, "Robot file (TOML)", self._file, "with this friction and material")
        self.folders: list[Any] = [show, robot, save]

        @file.on_upload
        async def _(_: Any) -> None:
            found = file.value
            viewer.ask(lambda: viewer.load(_robot(found.name, found.content)))

    def _switch(self, name: str) -> None:
        viewer = self._viewer
        box = viewer.server.gui.add_checkbox(_SHOWN[name], getattr(viewer.shown, name))

        @box.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = bool(box.value)
                viewer.ask(lambda: viewer.show(name, value))

    def _load(self, name: str) -> None:
        if name != _CHOOSE:
            self._viewer.ask(lambda: self._viewer.load(load_robot(name)))

    def _picture(self, client: Any) -> None:
        viewer = self._viewer

        def send() -> None:
            try:
                saving.send_picture(client, viewer.session, viewer.scene, viewer.page.loads.active)
            finally:
                viewer.page.update()

        viewer.page.busy("drawing the picture")
        viewer.ask(send)

    def _table(self, client: Any) -> None:
        self._viewer.page.busy("writing the table")
        self._viewer.ask(lambda: saving.send_table(client, self._viewer.session))
        self._viewer.ask(self._viewer.page.update)

    def _file(self, client: Any) -> None:
        self._viewer.ask(lambda: saving.send_robot(client, self._viewer.session))


def _robot(name: str, content: bytes) -> Robot:
    """Read a robot file that a browser sent."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError.FILE_UNREADABLE(
            f"{name} is not UTF-8 text; a robot file is a TOML text file"
        ) from None
    return robot_from_text(text, name)
