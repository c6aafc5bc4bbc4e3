"""Sliders and buttons for the loads of the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from notchflex.viewer.controls import POINTING, STROKE, TENSION, Controls
from notchflex.viewer.page.sliders import Dropdown, NumberField, Slider, add_button

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_BY = {TENSION: "tension [N]", STROKE: "stroke [mm]"}
_AT_TIP = ("force x [N]", "force y [N]", "force z [N]", "hung weight [g]")


class LoadControls:
    """The folders "Tendons" and "At the tip" of a page."""

    def __init__(self, viewer: Viewer) -> None:
        """Add them with the current loads."""
        self._viewer = viewer
        self.active = 0  # the tendon of the charts
        gui = viewer.server.gui
        count = viewer.session.robot.number_of_tendons
        with gui.add_folder("Tendons", order=1.0) as tendons:
            self._drives = [_Drive(viewer, self, tendon) for tendon in range(count)]
            self._chosen: Dropdown | None = None
            if count > 1:
                numbers = tuple(str(i + 1) for i in range(count))
                self._chosen = Dropdown(gui, "charts show tendon", numbers, self._choose)
            hint = "load and unload the tendon of the charts"
            add_button(gui, "Play a cycle", lambda _: viewer.ask(self._cycle), hint)
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

    def _cycle(self) -> None:
        self._viewer.cycle(self.active)

    def _choose(self, tendon: str) -> None:
        self._viewer.ask(lambda: self.show(int(tendon) - 1))

    def show(self, tendon: int) -> None:
        """Show a tendon (from 0) in the charts."""
        self.active = tendon
        if self._chosen is not None:
            self._chosen.put(str(tendon + 1))
        self._viewer.page.update()

    def _load(self, number: int, label: str) -> Slider:
        viewer = self._viewer
        ends = viewer.reach.ends(number, TENSION)
        return Slider(viewer, number, label, ends, lambda value: viewer.set(number, value, label))

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
    """The controls of one tendon: tension or stroke, with a slider and its end for each.

    Only those of the prescribed quantity are visible.
    """

    def __init__(self, viewer: Viewer, owner: LoadControls, tendon: int) -> None:
        self._viewer, self._owner, self._tendon = viewer, owner, tendon
        self._of = f" {tendon + 1}" if viewer.session.robot.number_of_tendons > 1 else ""
        self._key = ("by", tendon)
        texts = tuple(_BY.values())
        self._by = Dropdown(viewer.server.gui, f"tendon{self._of} by", texts, self._choose)
        self._sliders = {by: self._slider(by) for by in _BY}
        self._ends = {by: self._end(by) for by in _BY}
        self._show(TENSION)

    def _choose(self, text: str) -> None:
        chosen = next(by for by in _BY if _BY[by] == text)
        self._viewer.tasks.add(lambda: self._viewer.drive_by(self._tendon, chosen), self._key)
        # At once, so that the next value belongs to the new choice.
        self._sliders[chosen].put(self._viewer.session.where(self._tendon, chosen))
        self._show(chosen)

    def _slider(self, by: str) -> Slider:
        ends = self._viewer.reach.ends(self._tendon, by)
        label = self._label(by)
        return Slider(self._viewer, self._tendon, label, ends, lambda value: self._set(by, value))

    def _label(self, by: str) -> str:
        """Return the label of a slider, such as `tension 2 [N]`."""
        return _BY[by].replace(" [", f"{self._of} [")

    def _end(self, by: str) -> NumberField:
        return NumberField(
            self._viewer,
            f"last {self._tendon} {by}",
            f"slider{self._of} to",
            self._viewer.reach.ends(self._tendon, by)[1],
            lambda value: self._viewer.stretch(self._tendon, by, value),
            hint="end of this slider",
            min=0.0,
        )

    def _show(self, shown: str) -> None:
        for by in _BY:
            self._sliders[by].show(by == shown)
            self._ends[by].show(by == shown)

    def _set(self, by: str, value: float) -> None:
        if self._viewer.session.controls.by[self._tendon] != by:
            return  # prescribing it failed, and the page said why
        if self._owner.active != self._tendon:
            self._owner.show(self._tendon)
        self._viewer.set(self._tendon, value, self._label(by))

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
