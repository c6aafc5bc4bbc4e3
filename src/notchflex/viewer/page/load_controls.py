"""Sliders and buttons for what loads the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer.controls import POINTING, STROKE, TENSION, Controls
from notchflex.viewer.page.sliders import Field, Slider

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_BY = {TENSION: "tension [N]", STROKE: "stroke [mm]"}
_AT_TIP = ("force x [N]", "force y [N]", "force z [N]", "hung weight [g]")


class LoadControls:
    """The folders "Tendons" and "At the tip" of a page, and the buttons below.

    Args:
        viewer: What they act on.
    """

    def __init__(self, viewer: Viewer) -> None:
        """Add them, where the robot stands."""
        self._viewer = viewer
        self.active = 0  # the tendon that the charts show
        gui = viewer.server.gui
        count = viewer.session.robot.number_of_tendons
        with gui.add_folder("Tendons", order=1.0) as tendons:
            self._drives = [_Drive(viewer, self, tendon) for tendon in range(count)]
            self._chosen = self._charted(gui)
            play = gui.add_button("Play a cycle", hint="load and unload the tendon of the charts")
            halt = gui.add_button("Stop", hint="stay where the robot is")
            reset = gui.add_button("Reset", hint="the free robot, which remembers nothing")
        with gui.add_folder("At the tip", order=2.0) as tip:
            self._at_tip = [self._load(count + i, label) for i, label in enumerate(_AT_TIP)]
            pointing = gui.add_dropdown(
                "tube points",
                tuple(POINTING),
                initial_value=viewer.session.pointing,
                hint="a weight hangs down; the loads so far are done again",
            )
        self._pointing = pointing
        self.folders: list[Any] = [tendons, tip]

        @pointing.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                chosen = str(pointing.value)
                viewer.tasks.add(lambda: viewer.point(chosen), "pointing")

        @play.on_click
        async def _(_: Any) -> None:
            viewer.ask(lambda: viewer.cycle(self.active))

        @halt.on_click
        async def _(_: Any) -> None:
            viewer.interrupted.set()
            viewer.ask(viewer.halt)

        @reset.on_click
        async def _(_: Any) -> None:
            viewer.interrupted.set()
            viewer.ask(viewer.reset)

        self.follow(viewer.session.controls)

    def _charted(self, gui: Any) -> Any:
        """Choose the tendon of the charts, where there are several."""
        count = self._viewer.session.robot.number_of_tendons
        if count == 1:
            return None
        chosen = gui.add_dropdown("charts show tendon", [str(i + 1) for i in range(count)])

        @chosen.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                self._viewer.ask(lambda: self.show(int(chosen.value) - 1))

        return chosen

    def show(self, tendon: int) -> None:
        """Let the charts show a tendon (from 0)."""
        self.active = tendon
        if self._chosen is not None and self._chosen.value != str(tendon + 1):
            self._chosen.value = str(tendon + 1)
        self._viewer.page.tell()

    def _load(self, number: int, label: str) -> Slider:
        viewer = self._viewer
        ends = viewer.reach.ends(number, TENSION)
        return Slider(viewer, number, label, ends, lambda value: viewer.set(number, value, label))

    def follow(self, controls: Controls) -> None:
        """Put everything where the settings are."""
        for drive, by, value in zip(self._drives, controls.by, controls.value, strict=True):
            drive.follow(by, value)
        at_tip = (*controls.tip_force, controls.tip_mass)
        for slider, value in zip(self._at_tip, at_tip, strict=True):
            slider.put(value)
        waits = self._viewer.tasks.has("pointing")
        if not waits and self._pointing.value != controls.pointing:
            self._pointing.value = controls.pointing


class _Drive:
    """What drives one tendon: by tension or by stroke, a slider for each, and how far it goes.

    Only those of the command that holds are shown.
    """

    def __init__(self, viewer: Viewer, owner: LoadControls, tendon: int) -> None:
        self._viewer, self._owner, self._tendon = viewer, owner, tendon
        self._of = f" {tendon + 1}" if viewer.session.robot.number_of_tendons > 1 else ""
        self._key = ("by", tendon)
        self._by = viewer.server.gui.add_dropdown(
            f"tendon{self._of} by", tuple(_BY.values()), initial_value=_BY[TENSION]
        )
        self._sliders = {by: self._slider(by) for by in _BY}
        self._lasts = {by: self._last(by) for by in _BY}
        self._show(TENSION)

        @self._by.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                chosen = next(by for by, text in _BY.items() if text == self._by.value)
                viewer.tasks.add(lambda: viewer.drive_by(tendon, chosen), self._key)
                # At once, so that what is set next stands for what was chosen.
                self._sliders[chosen].put(viewer.session.where(tendon, chosen))
                self._show(chosen)

    def _slider(self, by: str) -> Slider:
        ends = self._viewer.reach.ends(self._tendon, by)
        label = self._label(by)
        return Slider(self._viewer, self._tendon, label, ends, lambda value: self._moved(by, value))

    def _label(self, by: str) -> str:
        """Text of a slider, such as `tension 2 [N]`."""
        return _BY[by].replace(" [", f"{self._of} [")

    def _last(self, by: str) -> Field:
        return Field(
            self._viewer,
            f"last {self._tendon} {by}",
            f"slider{self._of} to",
            self._viewer.reach.ends(self._tendon, by)[1],
            lambda value: self._viewer.stretch(self._tendon, by, value),
            hint="how far this slider goes",
            min=0.0,
        )

    def _show(self, shown: str) -> None:
        for by in _BY:
            self._sliders[by].show(by == shown)
            self._lasts[by].show(by == shown)

    def _moved(self, by: str, value: float) -> None:
        if self._viewer.session.controls.by[self._tendon] != by:
            return  # the tendon could not be commanded so, and the page said why
        if self._owner.active != self._tendon:
            self._owner.show(self._tendon)
        self._viewer.set(self._tendon, value, self._label(by))

    def follow(self, by: str, value: float) -> None:
        """Show the slider that drives the tendon, where it goes."""
        reach = self._viewer.reach
        for one in _BY:
            self._sliders[one].stretch(reach.ends(self._tendon, one))
            self._lasts[one].put(reach.ends(self._tendon, one)[1])
        if not self._viewer.tasks.has(self._key):
            if self._by.value != _BY[by]:
                self._by.value = _BY[by]
            self._show(by)
        self._sliders[by].put(value)


__all__ = ["LoadControls"]
