"""Loading other robots, saving what is seen, and what is shown."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from notchflex.robot import list_robots, load_robot, robot_from_text
from notchflex.viewer.page import saving

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_SHOWN = {
    "tendons": "tendons",
    "contacts": "contacts",
    "frames": "base and tip frames",
    "loads": "loads at the tip",
    "see_through": "tube to see through",
}
_CHOOSE = "choose ..."


class RobotControls:
    """The folders "Show", "Robot" and "Save" of a page.

    Args:
        viewer: What they act on.
    """

    def __init__(self, viewer: Viewer) -> None:
        """Add them."""
        self._viewer = viewer
        gui = viewer.server.gui
        with gui.add_folder("Show", order=5.0, expand_by_default=False) as show:
            for field in dataclasses.fields(viewer.shown):
                self._switch(field.name)
            view = gui.add_button("View from the side")
            whole = gui.add_button("View as at first")
        with gui.add_folder("Robot", order=6.0, expand_by_default=False) as robot:
            ready = gui.add_dropdown("ready robot", (_CHOOSE, *list_robots()))
            file = gui.add_upload_button("Load a robot file", mime_type=".toml")
        with gui.add_folder("Save", order=7.0, expand_by_default=False) as save:
            picture = gui.add_button("Picture (PNG)", hint="with loads, loop, numbers and legend")
            table = gui.add_button("Table (CSV)", hint="all steps, as notchflex simulate writes")
            toml = gui.add_button("Robot file (TOML)", hint="with the friction and material set")
        self.folders: list[Any] = [show, robot, save]

        @view.on_click
        async def _(_: Any) -> None:
            viewer.ask(lambda: viewer.page.look(side=True))

        @whole.on_click
        async def _(_: Any) -> None:
            viewer.ask(viewer.page.look)

        @ready.on_update
        async def _(event: Any) -> None:
            name = str(ready.value)
            if event.client is not None and name != _CHOOSE:
                viewer.ask(lambda: viewer.load(load_robot(name)))

        @file.on_upload
        async def _(_: Any) -> None:
            found = file.value
            viewer.ask(lambda: viewer.load(_robot(found.name, found.content)))

        @picture.on_click
        async def _(event: Any) -> None:
            viewer.page.busy("drawing the picture")
            viewer.ask(lambda: _picture(viewer, event.client))

        @table.on_click
        async def _(event: Any) -> None:
            viewer.page.busy("writing the table")
            viewer.ask(lambda: saving.send_table(event.client, viewer.session))
            viewer.ask(viewer.page.tell)

        @toml.on_click
        async def _(event: Any) -> None:
            viewer.ask(lambda: saving.send_robot(event.client, viewer.session))

    def _switch(self, name: str) -> None:
        viewer = self._viewer
        box = viewer.server.gui.add_checkbox(_SHOWN[name], getattr(viewer.shown, name))

        @box.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = bool(box.value)
                viewer.ask(lambda: viewer.show(name, value))


def _picture(viewer: Viewer, client: Any) -> None:
    """Send a picture of what is seen, and say again what there is to say."""
    try:
        saving.send_picture(client, viewer.session, viewer.scene, viewer.page.loads.active)
    finally:
        viewer.page.tell()


def _robot(name: str, content: bytes) -> Any:
    """The robot of a file that a browser sent."""
    from notchflex.errors import InputError

    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError.FILE_UNREADABLE(
            f"{name} is not UTF-8 text; a robot file is a TOML text file"
        ) from None
    return robot_from_text(text, name)


__all__ = ["RobotControls"]
