"""The page around the scene: controls, switches, files, numbers and charts.

Handlers of viser run in its event loop: they only queue tasks of the solver thread, which calls all
other methods.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from notchflex import InputError, Robot, list_robots, load_robot
from notchflex.plotting import chart_of
from notchflex.support import robot_from_text
from notchflex.viewer import saving
from notchflex.viewer.controls import POINTING, UNITS, name_of
from notchflex.viewer.readout import along_tendon, legend_html, loop, notice, readout
from notchflex.viewer.session import SECTIONS, kinds, numbers
from notchflex.viewer.tasks import PAUSE

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_FINE = 200  # steps of a slider from end to end
_JUMP = 0.03  # a larger part of the slider at once was typed or clicked, not dragged
_DECIMALS = 9  # that a field takes
_DIGITS = 3  # of the smallest step that a field shows, at least


class Input:
    """A field, list or switch of viser (`handle`); `act` gets in the solver thread what is set.

    The event loop receives what a person sets, the solver thread shows the current value. A value
    from the page is therefore first queued and then noted as shown: `put`, which reads in the
    opposite order, cannot overwrite a number while it is being typed. viser's own `handle.value`
    changes earlier than that, so it is not compared.

    A number that is typed waits for a `pause` [s]; `now` gets a value at once.
    """

    def __init__(
        self,
        viewer: Viewer,
        handle: Any,
        act: Callable[[Any], None],
        pause: float = 0.0,
        now: Callable[[Any], None] = lambda _: None,
    ) -> None:
        self.viewer, self.handle, self.act = viewer, handle, act
        self.pause, self.now, self.shown = pause, now, handle.value

        @handle.on_update
        async def _(event: Any) -> None:
            value = handle.value
            if event.client is not None and value in getattr(handle, "options", (value,)):
                self.changed(value)

    def changed(self, value: Any) -> None:
        """Take in a value from the page."""
        self.send(value, self.pause, self.now)

    def send(self, value: Any, pause: float, now: Callable[[Any], None]) -> None:
        """Queue a value for the solver thread."""
        act = self.act
        self.viewer.tasks.add(lambda: act(value), self, pause, lambda: now(value))
        self.shown = value

    def put(self, value: Any) -> None:
        """Show a value, unless one from the page waits."""
        shown = self.shown
        if not self.viewer.tasks.has(self) and shown != value:
            self.handle.value = self.shown = value


class Slider(Input):
    """A slider for one of the `Controls.numbers`, in the unit of its label."""

    def __init__(self, viewer: Viewer, number: int, by: str = "") -> None:
        self.number = number
        handle = viewer.server.gui.add_slider("", 0.0, 1.0, 0.1, 0.0)
        super().__init__(viewer, handle, lambda _: None)
        self.prescribe(by)

    def prescribe(self, by: str) -> None:
        """Prescribe the tension or the stroke of a tendon from now on; "" for a load at the tip."""
        viewer, number = self.viewer, self.number
        low, high = viewer.reach.ends(number, by)
        self.by, self.act = by, lambda value: viewer.set(number, value, by)
        handle = self.handle
        handle.label = "{} [{}]".format(*name_of(number, by, len(viewer.session.controls.by)))
        handle.min, handle.max, handle.step = low, high, (high - low) / _FINE
        handle.precision = max(4, _DIGITS - math.floor(math.log10(high)))

    def changed(self, value: Any) -> None:
        """Take in a number; after a jump the robot holds at once: it may still be typed."""
        low, high, before = self.handle.min, self.handle.max, self.shown
        if value == min(max(before, low), high) != before:
            self.shown = value  # when it is left, the page itself resets what was typed beyond
        elif abs(value - before) > _JUMP * (high - low):
            self.send(value, PAUSE, lambda _: self.viewer.targets.hold(self.number))
        else:
            self.send(value, 0.0, self.now)

    def put(self, value: Any) -> None:
        """Show a value within its ends, unless one from the page waits."""
        super().put(min(max(float(value), self.handle.min), self.handle.max))


def add_number(gui: Any, label: str, value: float, hint: str, **options: Any) -> Any:
    """Add a field for a number; viser itself takes no more decimals than the first value has."""
    handle = gui.add_number(label, value, hint=hint, **options)
    handle.precision = _DECIMALS
    return handle


def add_button(gui: Any, label: str, act: Callable[[Any], None], hint: str | None = None) -> None:
    """Add a button; `act` is called with the browser's handle, in the event loop."""

    @gui.add_button(label, hint=hint).on_click
    async def _(event: Any) -> None:
        act(event.client)


_BY = {f"{by} [{unit}]": by for by, unit in UNITS.items()}
_SHOWN = {
    "tendons": "tendons",
    "contacts": "contacts",
    "frames": "base and tip frames",
    "loads": "loads at the tip",
    "see_through": "transparent tube",
}
_OVERLAYS = {
    "handle": (
        "drag the tip",
        "arrows at the tip: the tendons bring it where the mouse pulls them",
    ),
    "cloud": (
        "reachable cloud",
        "where the tip can be under the loads at the tip: blue loading, orange unloading",
    ),
    "sensed": (
        "sensed force",
        "the force computed from tensions and strokes, with its interval",
    ),
}
_CHOOSE = "choose ..."


Follow = Callable[[], None]
"""Shows the current settings."""


def add_load_folders(viewer: Viewer) -> tuple[list[Any], Follow, Input]:
    """Add the folders "Tendons" and "At the tip"; return them, and the choice of the charts."""
    gui, count = viewer.server.gui, viewer.session.robot.number_of_tendons
    with gui.add_folder("Tendons", order=1.0) as tendons:
        drives = [_add_drive(viewer, tendon, count) for tendon in range(count)]
        names = tuple(str(tendon + 1) for tendon in range(count))
        tendon = gui.add_dropdown("charts show tendon", names, visible=count > 1)
        charted = Input(viewer, tendon, lambda name: viewer.page.chart(int(name) - 1))
        for label, ask, act, hint in (
            ("Play a cycle", viewer.ask, lambda: viewer.cycle(viewer.page.active),
             "load and unload the tendon of the charts"),
            ("Stop", viewer.interrupt, viewer.halt, "stop at this state"),
            ("Reset", viewer.interrupt, viewer.reset, "the free robot, without history"),
        ):  # fmt: skip
            add_button(gui, label, lambda _, ask=ask, act=act: ask(act), hint)
    with gui.add_folder("At the tip", order=2.0) as tip:
        at_tip = [Slider(viewer, number) for number in range(count, count + 4)]
        hint = "a weight hangs down; the load history is repeated"
        handle = gui.add_dropdown("tube points", tuple(POINTING), hint=hint)
        pointing = Input(viewer, handle, viewer.point)

    def follow() -> None:
        goal = viewer.goal
        for drive in drives:
            drive()
        for slider in at_tip:
            slider.put(goal.numbers[slider.number])
        pointing.put(goal.pointing)

    return [tendons, tip], follow, charted


def _add_drive(viewer: Viewer, tendon: int, count: int) -> Follow:
    """Add a tendon by tension or stroke, its slider, and the end of the slider."""
    gui, of = viewer.server.gui, f" {tendon + 1}" if count > 1 else ""

    def now(label: str) -> None:  # so that the next value belongs to the new choice
        slider.prescribe(_BY[label])
        slider.put(viewer.session.where(tendon, slider.by))
        end.put(slider.handle.max)

    handle = gui.add_dropdown(f"tendon{of} by", tuple(_BY))
    slider = Slider(viewer, tendon, viewer.session.controls.by[tendon])
    most, hint = float(slider.handle.max), "end of this slider"
    field = add_number(gui, f"slider{of} to", most, hint, min=0.0)
    choice = Input(viewer, handle, lambda label: viewer.drive_by(tendon, _BY[label]), now=now)
    end = Input(viewer, field, lambda most: viewer.stretch(tendon, slider.by, most), PAUSE)

    def follow() -> None:
        goal = viewer.goal
        by = goal.by[tendon]
        choice.put(f"{by} [{UNITS[by]}]")
        if _BY[choice.shown] == by:  # no other one waits
            slider.prescribe(by)
            slider.put(goal.value[tendon])
        end.put(slider.handle.max)

    return follow


def add_part_folder(viewer: Viewer, section: str, order: float) -> tuple[Any, Follow, Input]:
    """Add the folder of the friction law or the material; return it, and the choice of its kind.

    It has the numbers of this kind.
    """
    gui = viewer.server.gui
    folder = gui.add_folder(
        section.capitalize(), order=order, expand_by_default=section == "friction"
    )
    with folder:
        laws = gui.add_dropdown("law", tuple(kinds(section)))
    kind = Input(viewer, laws, lambda kind: viewer.change_part(section, kind))
    fields: dict[str, Input] = {}

    def add_field(key: str, value: float, unit: str, hint: str) -> Input:
        label = "μ" if key == "coefficient" else key.replace("_", " ")
        with folder:
            handle = add_number(gui, f"{label} [{unit}]" if unit else label, value, hint)
        name = f"{section}.{key}"
        return Input(viewer, handle, lambda value: viewer.change_number(name, value), PAUSE)

    def follow() -> None:
        robot = viewer.session.robot
        kind.put(getattr(robot, section).kind)
        shown = {number.key: number for number in numbers(robot, section)}
        for key, number in shown.items():
            if key not in fields:
                fields[key] = add_field(*number)
            fields[key].put(number.value)
        for key, field in fields.items():
            field.handle.visible = key in shown

    return folder, follow, kind


def add_robot_folders(viewer: Viewer) -> list[Any]:
    """Add and return the folders "Follow and sense", "Show", "Robot" and "Save"."""
    gui = viewer.server.gui
    with gui.add_folder("Follow and sense", order=2.5) as overlays:
        for name, (label, hint) in _OVERLAYS.items():
            _add_switch(viewer, name, label, hint)
    with gui.add_folder("Show", order=5.0, expand_by_default=False) as show:
        for name, label in _SHOWN.items():
            _add_switch(viewer, name, label)
        side = "View from the side"
        add_button(gui, side, lambda _: viewer.ask(lambda: viewer.page.look(side=True)))
        add_button(gui, "View as at first", lambda _: viewer.ask(viewer.page.look))
    with gui.add_folder("Robot", order=6.0, expand_by_default=False) as robot:
        ready = gui.add_dropdown("ready robot", (_CHOOSE, *list_robots()))
        Input(viewer, ready, lambda name: _load(viewer, name))
        file = gui.add_upload_button("Load a robot file", mime_type=".toml")

        @file.on_upload
        async def _(_: Any) -> None:
            sent = file.value
            viewer.ask(lambda: viewer.load(_robot(sent.name, sent.content)))

    with gui.add_folder("Save", order=7.0, expand_by_default=False) as files:
        _add_save(viewer, "Picture (PNG)", saving.send_picture, "loads, loop, numbers and legend")
        _add_save(viewer, "Table (CSV)", saving.send_table, "all steps, as notchflex simulate")
        _add_save(viewer, "Robot file (TOML)", saving.send_robot, "with this friction and material")
    return [overlays, show, robot, files]


def _add_save(viewer: Viewer, label: str, send: Callable[[Any, Viewer], None], hint: str) -> None:
    def act(client: Any) -> None:
        viewer.page.busy(f"preparing: {label}")
        viewer.ask(lambda: send(client, viewer))
        viewer.ask(viewer.page.update)

    add_button(viewer.server.gui, label, act, hint)


def _load(viewer: Viewer, name: str) -> None:
    if name != _CHOOSE:
        viewer.load(load_robot(name))


def _add_switch(viewer: Viewer, name: str, label: str, hint: str | None = None) -> None:
    box = viewer.server.gui.add_checkbox(label, getattr(viewer.shown, name), hint=hint)
    Input(viewer, box, lambda value: viewer.show(name, value))


def _robot(name: str, content: bytes) -> Robot:
    """Read a robot file that a browser sent."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError.FILE_UNREADABLE(
            f"{name} is not UTF-8 text; a robot file is a TOML text file"
        ) from None
    return robot_from_text(text, name)


CHARTS_WIDTH, CONTROLS_WIDTH = 280, 290
_ASPECT = 0.68  # height over width of a chart: so the page of viser takes it

# viser's messages, such as that there is no graphics card, cover the scene until they are closed.
# This makes them small, at the lower edge. Numbers and charts are grey while others are awaited.
STYLE = """<style>
.mantine-Notifications-root { top: auto !important; bottom: 0.5em !important; max-width: 16em; }
.mantine-Notification-root { padding: 2px 6px 2px 16px; }
.mantine-Notification-title { font-size: 11px; margin: 0; }
.mantine-Notification-root:not(:hover) .mantine-Notification-description { display: none; }
body:has([data-waiting]) :is(table, .js-plotly-plot) { opacity: 0.3; }
</style>"""


class Page:
    """The panels beside the scene."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer = viewer
        self.active = 0  # the tendon of the charts
        gui = viewer.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH)
        side = gui.add_panel()
        style: dict[str, Any] = {"aspect": _ASPECT, "config": {"displayModeBar": False}}
        with side.add_tab("State"):
            self._readout = gui.add_html("")
            self._loop = gui.add_plotly(chart_of(loop(viewer.session, 0)), **style)
            self._legend = gui.add_html("")
            self._along = gui.add_plotly(chart_of(along_tendon(viewer.session, 0)), **style)
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
        viewer, self.active = self.viewer, 0
        for folder in self._folders:
            folder.remove()
        loads, follow, self._charted = add_load_folders(viewer)
        parts = [add_part_folder(viewer, part, order) for order, part in enumerate(SECTIONS, 3)]
        folders, follows, self.laws = zip(*parts, strict=True)
        self._follow = [follow, *follows]
        self._folders = [*loads, *folders, *add_robot_folders(viewer)]
        self.name()
        eye = viewer.scene.eye(viewer.session.pointing)
        camera = viewer.server.initial_camera
        camera.position, camera.look_at = eye.position, eye.target

    def name(self) -> None:
        """Update the name of the robot and the legend."""
        viewer = self.viewer
        viewer.server.gui.set_panel_label(viewer.session.robot.name)
        self._legend.content = legend_html(viewer.session.robot, viewer.scene.grid_cell)

    def chart(self, tendon: int) -> None:
        """Show a tendon (from 0) in the charts."""
        self.active = tendon
        self._charted.put(str(tendon + 1))
        self.update()

    def update(self, charts: bool = True) -> None:
        """Update numbers, controls and notice, and charts: a browser takes long to draw them."""
        session = self.viewer.session
        self._readout.content = readout(session)
        if charts:
            self._loop.figure = chart_of(loop(session, self.active))
            self._along.figure = chart_of(along_tendon(session, self.active))
        self.follow()

    def follow(self) -> None:
        """Update controls and notice."""
        viewer = self.viewer
        self._notice.content = notice(viewer.message)
        for follow in self._follow:
            follow()

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
