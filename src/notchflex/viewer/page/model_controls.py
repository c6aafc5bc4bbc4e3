"""Kinds and numbers of the friction law and the material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.robot import Robot
from notchflex.viewer import parts
from notchflex.viewer.page.sliders import Dropdown, NumberField

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer


class ModelControls:
    """The folders "Friction" and "Material" of a page; a change repeats the load history."""

    def __init__(self, viewer: Viewer) -> None:
        """Add them with the values of the robot."""
        self._parts = {
            section: _PartFolder(viewer, section, float(order))
            for order, section in enumerate(parts.SECTIONS, start=3)
        }
        self.folders: list[Any] = [part.folder for part in self._parts.values()]

    def follow(self, robot: Robot) -> None:
        """Show the values of the robot."""
        for part in self._parts.values():
            part.follow(robot)


class _PartFolder:
    """The folder of one part of the robot: its kind and the numbers of this kind."""

    def __init__(self, viewer: Viewer, section: str, order: float) -> None:
        self._viewer, self._section = viewer, section
        self._key = ("kind", section)
        self._fields: dict[str, NumberField] = {}
        gui, robot = viewer.server.gui, viewer.session.robot
        self.folder: Any = gui.add_folder(
            section.capitalize(), order=order, expand_by_default=section == "friction"
        )
        with self.folder:
            kinds, kind = tuple(parts.kinds(section)), getattr(robot, section).kind
            self._kind = Dropdown(gui, "law", kinds, self._choose, kind)
            self._fill(robot)

    def _choose(self, kind: str) -> None:
        self._viewer.tasks.add(lambda: self._viewer.change_part(self._section, kind), self._key)

    def _fill(self, robot: Robot) -> None:
        """Show a field for every number of the kind and no other; called inside the folder."""
        found = {number.key: number for number in parts.numbers(robot, self._section)}
        for key, number in found.items():
            if key not in self._fields:
                self._fields[key] = self._field(number)
        for key, field in self._fields.items():
            field.show(key in found)
            if key in found:
                field.put(found[key].value)

    def _field(self, number: parts.PartNumber) -> NumberField:
        viewer, name = self._viewer, f"{self._section}.{number.key}"
        unit = f" [{number.unit}]" if number.unit else ""
        label = "μ" if number.key == "coefficient" else number.key.replace("_", " ")
        return NumberField(
            viewer,
            name,
            f"{label}{unit}",
            number.value,
            lambda value: viewer.change_number(name, value),
            hint=number.text,
        )

    def follow(self, robot: Robot) -> None:
        if not self._viewer.tasks.has(self._key):
            self._kind.put(getattr(robot, self._section).kind)
        with self.folder:
            self._fill(robot)
