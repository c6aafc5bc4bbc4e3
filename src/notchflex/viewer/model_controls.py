"""Which friction law and material the robot has, and their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer import parts

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer


class ModelControls:
    """The folders "Friction" and "Material" of a page.

    Whatever is changed, all that was done to the robot is done again; the loop before stays grey.

    Args:
        viewer: What they act on.
    """

    def __init__(self, viewer: Viewer) -> None:
        """Add them, as the robot has them."""
        self._viewer = viewer
        gui = viewer.server.gui
        self.folders: list[Any] = []
        for order, section in enumerate(parts.SECTIONS, start=3):
            with gui.add_folder(
                section.capitalize(), order=float(order), expand_by_default=section == "friction"
            ) as folder:
                self._fill(section)
            self.folders.append(folder)

    def _fill(self, section: str) -> None:
        viewer = self._viewer
        robot = viewer.session.robot
        kind = viewer.server.gui.add_dropdown(
            "law", tuple(parts.kinds(section)), initial_value=getattr(robot, section).kind
        )

        @kind.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                chosen = str(kind.value)
                viewer.ask(lambda: viewer.change_part(section, chosen))

        for number in parts.numbers(robot, section):
            self._number(section, number)

    def _number(self, section: str, number: parts.Number) -> None:
        viewer = self._viewer
        unit = f" [{number.unit}]" if number.unit else ""
        name = "μ" if number.key == "coefficient" else number.key.replace("_", " ")
        field = viewer.server.gui.add_number(f"{name}{unit}", number.value, hint=number.text)

        @field.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = float(field.value)
                viewer.ask(lambda: viewer.change_number(f"{section}.{number.key}", value))


__all__ = ["ModelControls"]
