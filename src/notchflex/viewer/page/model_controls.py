"""Which friction law and material the robot has, and their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.robot import Robot
from notchflex.viewer import parts
from notchflex.viewer.page.sliders import Field

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
        self._parts = {
            section: _Part(viewer, section, float(order))
            for order, section in enumerate(parts.SECTIONS, start=3)
        }

    @property
    def folders(self) -> list[Any]:
        """The folders, to be taken away again."""
        return [part.folder for part in self._parts.values()]

    def follow(self, robot: Robot) -> None:
        """Show what the robot has."""
        for part in self._parts.values():
            part.follow(robot)


class _Part:
    """The folder of one part of the robot: its kind and the numbers of this kind."""

    def __init__(self, viewer: Viewer, section: str, order: float) -> None:
        self._viewer, self._section = viewer, section
        self._key = ("kind", section)
        self._fields: dict[str, Field] = {}
        gui = viewer.server.gui
        self.folder: Any = gui.add_folder(
            section.capitalize(), order=order, expand_by_default=section == "friction"
        )
        with self.folder:
            self._kind = gui.add_dropdown(
                "law",
                tuple(parts.kinds(section)),
                initial_value=getattr(viewer.session.robot, section).kind,
            )
            self._fill(viewer.session.robot)

        @self._kind.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                chosen = str(self._kind.value)
                viewer.tasks.add(lambda: viewer.change_part(section, chosen), self._key)

    def _fill(self, robot: Robot) -> None:
        """Have a field for every number of the kind, and show no other; call it in the folder."""
        found = {number.key: number for number in parts.numbers(robot, self._section)}
        for key, number in found.items():
            if key not in self._fields:
                self._fields[key] = self._field(number)
        for key, field in self._fields.items():
            field.show(key in found)
            if key in found:
                field.put(found[key].value)

    def _field(self, number: parts.Number) -> Field:
        viewer, name = self._viewer, f"{self._section}.{number.key}"
        unit = f" [{number.unit}]" if number.unit else ""
        label = "μ" if number.key == "coefficient" else number.key.replace("_", " ")
        return Field(
            viewer,
            name,
            f"{label}{unit}",
            number.value,
            lambda value: viewer.change_number(name, value),
            hint=number.text,
        )

    def follow(self, robot: Robot) -> None:
        kind = getattr(robot, self._section).kind
        if not self._viewer.tasks.has(self._key) and self._kind.value != kind:
            self._kind.value = kind
        with self.folder:
            self._fill(robot)


__all__ = ["ModelControls"]
