"""The folders of the page: loads, friction and material, visibility, other robots, files."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from notchflex import InputError, Robot, list_robots, load_robot
from notchflex.support import robot_from_text
from notchflex.viewer.controls import POINTING, STROKE, TENSION, Controls
from notchflex.viewer.page import saving
from notchflex.viewer.session import kinds, numbers
from notchflex.viewer.tasks import PAUSE, Task

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer


_FINE = 200  # steps of a slider from end to end
_JUMP = 0.03  # a larger part of the slider at once was typed or clicked, not dragged
_DIGITS = 3  # of the smallest step that a field shows, at least


class NumberField:
    """A field of viser (`handle`); `act` gets a typed number in the solver thread, after a pause.

    The event loop receives what a person sets, the solver thread shows the current value. A value
    from the page is therefore first queued and then noted as shown: `put`, which reads in the
    opposite order, cannot overwrite a number while it is being typed. viser's own `handle.value`
    changes earlier than that, so it is not compared.
    """

    def __init__(
        self, viewer: Viewer, handle: Any, key: tuple[str, str], act: Callable[[float], None]
    ) -> None:
        self._viewer, self._handle, self._key, self._act = viewer, handle, key, act
        self._shown = float(handle.value)

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                self._changed(float(handle.value))

    def _changed(self, value: float) -> None:
        self._send(value, PAUSE)

    def _send(self, value: float, pause: float, now: Task | None = None) -> None:
        self._viewer.tasks.add(lambda: self._act(value), self._key, pause, now)
        self._shown = value

    def put(self, value: float) -> None:
        """Show a number, unless one from the page waits."""
        shown = self._shown
        if not self._viewer.tasks.has(self._key) and abs(shown - value) > 1e-9:
            self._handle.value = self._shown = float(value)

    def show(self, visible: bool) -> None:
        """Show or hide it."""
        self._handle.visible = visible


class Slider(NumberField):
    """A slider for one of the `Controls.numbers`, always in the unit of its label."""

    def __init__(
        self,
        viewer: Viewer,
        number: int,
        label: str,
        ends: tuple[float, float],
        act: Callable[[float], None],
    ) -> None:
        self._number, (low, high) = number, ends
        handle = viewer.server.gui.add_slider(label, low, high, (high - low) / _FINE, 0.0)
        super().__init__(viewer, handle, ("slider", label), act)
        self._divide()

    def _divide(self) -> None:
        """Set steps, and decimals that resolve them."""
        low, high = self._handle.min, self._handle.max
        self._handle.step = (high - low) / _FINE
        self._handle.precision = max(4, _DIGITS - math.floor(math.log10(high)))

    def _changed(self, value: float) -> None:
        low, high = float(self._handle.min), float(self._handle.max)
        before = self._shown
        if value == min(max(before, low), high) != before:
            self._shown = value
            return  # when it is left, the page itself resets what was typed beyond an end
        jump = abs(value - before) > _JUMP * (high - low)
        if not jump:
            self._send(value, 0.0)
        else:  # the robot holds at once, though the new value may still be typed
            self._send(value, PAUSE, lambda: self._viewer.targets.hold(self._number))

    def stretch(self, ends: tuple[float, float]) -> None:
        """Change its ends."""
        if (self._handle.min, self._handle.max) != ends:
            self._handle.min, self._handle.max = ends
            self._divide()

    def put(self, value: float) -> None:
        """Show a value within its ends, unless one from the page waits."""
        super().put(min(max(float(value), float(self._handle.min)), float(self._handle.max)))


class Dropdown:
    """A drop-down list; `act` gets what a person selects of it, in the event loop."""

    def __init__(
        self, gui: Any, label: str, options: tuple[str, ...], act: Callable[[str], None],
        value: str | None = None, **more: Any,
    ) -> None:  # fmt: skip
        self.handle = gui.add_dropdown(label, options, initial_value=value, **more)

        @self.handle.on_update
        async def _(event: Any) -> None:
            value = str(self.handle.value)
            if event.client is not None and value in self.handle.options:
                act(value)

    def put(self, value: str) -> None:
        """Show a selection."""
        if self.handle.value != value:
            self.handle.value = value


def add_button(gui: Any, label: str, act: Callable[[Any], None], hint: str | None = None) -> None:
    """Add a button; `act` is called with the browser's handle, in the event loop."""

    @gui.add_button(label, hint=hint).on_click
    async def _(event: Any) -> None:
        act(event.client)


_BY = {TENSION: "tension [N]", STROKE: "stroke [mm]"}
_AT_TIP = ("force x [N]", "force y [N]", "force z [N]", "hung weight [g]")
_SHOWN = {
    "tendons": "tendons",
    "contacts": "contacts",
    "frames": "base and tip frames",
    "loads": "loads at the tip",
    "see_through": "transparent tube",
}
_OVERLAYS = {
    "handle": "drag the tip",
    "cloud": "reachable cloud",
    "sensed": "sensed force",
}
_HINTS = {
    "handle": "arrows at the tip: the tendons bring it where the mouse pulls them",
    "cloud": "where the tip can be under the loads at the tip: blue loading, orange unloading",
    "sensed": "the force computed from tensions and strokes, with its interval",
}
_CHOOSE = "choose ..."


class LoadControls:
    """The folders "Tendons" and "At the tip", with the current loads."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self.active = 0  # the tendon of the charts
        gui = viewer.server.gui
        count = viewer.session.robot.number_of_tendons
        with gui.add_folder("Tendons", order=1.0) as tendons:
            self._drives = [_Drive(viewer, self, tendon) for tendon in range(count)]
            self._active: Dropdown | None = None
            if count > 1:
                numbers = tuple(str(tendon + 1) for tendon in range(count))
                self._active = Dropdown(gui, "charts show tendon", numbers, self._choose)
            hint = "load and unload the tendon of the charts"
            cycle = "Play a cycle"
            add_button(gui, cycle, lambda _: viewer.ask(lambda: viewer.cycle(self.active)), hint)
            add_button(gui, "Stop", lambda _: viewer.interrupt(viewer.halt), "stop at this state")
            hint = "the free robot, without history"
            add_button(gui, "Reset", lambda _: viewer.interrupt(viewer.reset), hint)
        with gui.add_folder("At the tip", order=2.0) as tip:
            self._at_tip = [self._load(count + i, label) for i, label in enumerate(_AT_TIP)]
            self._pointing = Dropdown(
                gui,
                "tube points",
                tuple(POINTING),
                lambda chosen: viewer.tasks.add(lambda: viewer.point(chosen), "pointing"),
                viewer.session.pointing,
                hint="a weight hangs down; the load history is repeated",
            )
        self.folders: list[Any] = [tendons, tip]
        self.follow(viewer.session.controls)

    def _choose(self, tendon: str) -> None:
        self._viewer.ask(lambda: self.show(int(tendon) - 1))

    def _load(self, number: int, label: str) -> Slider:
        viewer = self._viewer
        ends = viewer.reach.ends(number, TENSION)
        return Slider(viewer, number, label, ends, lambda value: viewer.set(number, value, label))

    def show(self, tendon: int) -> None:
        """Show a tendon (from 0) in the charts."""
        self.active = tendon
        if self._active is not None:
            self._active.put(str(tendon + 1))
        self._viewer.page.update()

    def follow(self, controls: Controls) -> None:
        """Show the settings."""
        for drive, by, value in zip(self._drives, controls.by, controls.value, strict=True):
            drive.follow(by, value)
        at_tip = (*controls.tip_force, controls.tip_mass)
        for slider, value in zip(self._at_tip, at_tip, strict=True):
            slider.put(value)
        if not self._viewer.tasks.has("pointing"):
            self._pointing.put(controls.pointing)


class _Drive:
    """A tendon by tension or stroke: a slider and its end for each, of which one is visible."""

    def __init__(self, viewer: Viewer, owner: LoadControls, tendon: int) -> None:
        self._viewer, self._owner, self._tendon = viewer, owner, tendon
        gui, reach = viewer.server.gui, viewer.reach
        of = f" {tendon + 1}" if viewer.session.robot.number_of_tendons > 1 else ""
        self._key = ("by", tendon)
        self._by = Dropdown(gui, f"tendon{of} by", tuple(_BY.values()), self._choose)
        self._labels = {by: label.replace(" [", f"{of} [") for by, label in _BY.items()}
        self._sliders = {
            by: Slider(viewer, tendon, label, reach.ends(tendon, by), self._setter(by))
            for by, label in self._labels.items()
        }
        self._ends = {by: self._end(by, f"slider{of} to") for by in _BY}
        self._show(TENSION)

    def _choose(self, text: str) -> None:
        chosen = next(by for by in _BY if _BY[by] == text)
        self._viewer.tasks.add(lambda: self._viewer.drive_by(self._tendon, chosen), self._key)
        # At once, so that the next value belongs to the new choice.
        self._sliders[chosen].put(self._viewer.session.where(self._tendon, chosen))
        self._show(chosen)

    def _end(self, by: str, label: str) -> NumberField:
        viewer, tendon = self._viewer, self._tendon
        handle = viewer.server.gui.add_number(
            label, float(viewer.reach.ends(tendon, by)[1]), hint="end of this slider", min=0.0
        )
        return NumberField(
            viewer, handle, ("end", f"{tendon} {by}"), lambda end: viewer.stretch(tendon, by, end)
        )

    def _show(self, shown: str) -> None:
        for by in _BY:
            self._sliders[by].show(by == shown)
            self._ends[by].show(by == shown)

    def _setter(self, by: str) -> Callable[[float], None]:
        def act(value: float) -> None:
            if self._viewer.session.controls.by[self._tendon] != by:
                return  # prescribing it failed, and the page said why
            if self._owner.active != self._tendon:
                self._owner.show(self._tendon)
            self._viewer.set(self._tendon, value, self._labels[by])

        return act

    def follow(self, by: str, value: float) -> None:
        """Show the slider of the prescribed quantity at its target."""
        for one in _BY:
            ends = self._viewer.reach.ends(self._tendon, one)
            self._sliders[one].stretch(ends)
            self._ends[one].put(ends[1])
        if not self._viewer.tasks.has(self._key):
            self._by.put(_BY[by])
            self._show(by)
        self._sliders[by].put(value)


class PartControls:
    """The folder of the friction law or the material: its kind and the numbers of this kind."""

    def __init__(self, viewer: Viewer, section: str, order: float) -> None:
        self._viewer, self._section, self._key = viewer, section, ("kind", section)
        self._fields: dict[str, NumberField] = {}
        gui, robot = viewer.server.gui, viewer.session.robot
        self.folder: Any = gui.add_folder(
            section.capitalize(), order=order, expand_by_default=section == "friction"
        )
        with self.folder:
            laws, kind = tuple(kinds(section)), getattr(robot, section).kind
            self.kind = Dropdown(gui, "law", laws, self._choose, kind)
        self.follow(robot)

    def _choose(self, kind: str) -> None:
        self._viewer.tasks.add(lambda: self._viewer.change_part(self._section, kind), self._key)

    def _field(self, key: str, value: float, unit: str, hint: str) -> NumberField:
        viewer, name = self._viewer, f"{self._section}.{key}"
        label = "μ" if key == "coefficient" else key.replace("_", " ")
        label += f" [{unit}]" if unit else ""
        handle = viewer.server.gui.add_number(label, value, hint=hint)
        return NumberField(
            viewer, handle, ("field", name), lambda value: viewer.change_number(name, value)
        )

    def follow(self, robot: Robot) -> None:
        """Show the kind and its numbers."""
        if not self._viewer.tasks.has(self._key):
            self.kind.put(getattr(robot, self._section).kind)
        with self.folder:
            shown = {number.key: number for number in numbers(robot, self._section)}
            for key, number in shown.items():
                if key not in self._fields:
                    self._fields[key] = self._field(*number)
        for key, field in self._fields.items():
            field.show(key in shown)
            if key in shown:
                field.put(shown[key].value)


def add_robot_folders(viewer: Viewer) -> list[Any]:
    """Add and return the folders "Follow and sense", "Show", "Robot" and "Save"."""
    gui = viewer.server.gui
    with gui.add_folder("Follow and sense", order=2.5) as overlays:
        for name, label in _OVERLAYS.items():
            _add_switch(viewer, name, label, _HINTS[name])
    with gui.add_folder("Show", order=5.0, expand_by_default=False) as show:
        for name, label in _SHOWN.items():
            _add_switch(viewer, name, label)
        side = "View from the side"
        add_button(gui, side, lambda _: viewer.ask(lambda: viewer.page.look(side=True)))
        add_button(gui, "View as at first", lambda _: viewer.ask(viewer.page.look))
    with gui.add_folder("Robot", order=6.0, expand_by_default=False) as robot:
        Dropdown(gui, "ready robot", (_CHOOSE, *list_robots()), lambda name: _load(viewer, name))
        file = gui.add_upload_button("Load a robot file", mime_type=".toml")

        @file.on_upload
        async def _(_: Any) -> None:
            sent = file.value
            viewer.ask(lambda: viewer.load(_robot(sent.name, sent.content)))

    def sender(sentence: str, send: Callable[[Any, Viewer], None]) -> Callable[[Any], None]:
        def act(client: Any) -> None:
            viewer.page.busy(sentence)
            viewer.ask(lambda: send(client, viewer))
            viewer.ask(viewer.page.update)

        return act

    with gui.add_folder("Save", order=7.0, expand_by_default=False) as save:
        for label, hint, sentence, send in (
            ("Picture (PNG)", "with loads, loop, numbers and legend", "drawing the picture",
             saving.send_picture),
            ("Table (CSV)", "all steps, as notchflex simulate writes", "writing the table",
             saving.send_table),
            ("Robot file (TOML)", "with this friction and material", "writing the robot file",
             saving.send_robot),
        ):  # fmt: skip
            add_button(gui, label, sender(sentence, send), hint)
    return [overlays, show, robot, save]


def _load(viewer: Viewer, name: str) -> None:
    if name != _CHOOSE:
        viewer.ask(lambda: viewer.load(load_robot(name)))


def _add_switch(viewer: Viewer, name: str, label: str, hint: str | None = None) -> None:
    box = viewer.server.gui.add_checkbox(label, getattr(viewer.shown, name), hint=hint)

    @box.on_update
    async def _(event: Any) -> None:
        if event.client is not None:
            value = bool(box.value)
            viewer.ask(lambda: viewer.show(name, value))


def _robot(name: str, content: bytes) -> Robot:
    """Read a robot file that a browser sent."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError.FILE_UNREADABLE(
            f"{name} is not UTF-8 text; a robot file is a TOML text file"
        ) from None
    return robot_from_text(text, name)
