"""Sliders and buttons for what loads the robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from notchflex.viewer.controls import POINTING, STROKE, TENSION, Controls
from notchflex.viewer.reach import round_up

if TYPE_CHECKING:
    from notchflex.viewer.viewer import Viewer

_FINE = 200  # steps of a slider from end to end
_DIGITS = 4
_BY = {TENSION: "tension [N]", STROKE: "stroke [mm]"}
_AXES = ("x", "y", "z")


class LoadControls:
    """The folders "Tendons" and "At the tip" of a page, and the buttons below.

    Args:
        viewer: What they act on.
    """

    def __init__(self, viewer: Viewer) -> None:
        """Add them, where the robot stands."""
        self._viewer = viewer
        self.active = 0  # the tendon that the charts show
        self.following = True  # sliders go along, but for those that somebody holds
        gui = viewer.server.gui
        self._drives: list[_Drive] = []
        with gui.add_folder("Tendons", order=1.0) as tendons:
            for tendon in range(viewer.session.robot.number_of_tendons):
                self._drives.append(_Drive(viewer, self, tendon))
            self._chosen = self._charted(gui)
            play = gui.add_button("Play a cycle", hint="pull the tendon of the charts and let go")
            halt = gui.add_button("Stop")
            reset = gui.add_button("Reset", hint="the free robot, which remembers nothing")
        with gui.add_folder("At the tip", order=2.0) as tip:
            self._forces = [self._force(axis) for axis in range(3)]
            mass = viewer.reach.mass
            self._mass = gui.add_slider("hung weight [g]", 0.0, mass, mass / _FINE, 0.0)
            pointing = gui.add_dropdown(
                "tube points",
                tuple(POINTING),
                initial_value=viewer.session.pointing,
                hint="a weight hangs down; the loads so far are done again",
            )
        self._pointing = pointing
        self.folders: list[Any] = [tendons, tip]

        @self._mass.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = float(self._mass.value)
                viewer.ask(lambda: self._load(tip_mass=value))

        @pointing.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                viewer.ask(lambda: viewer.point(pointing.value))

        @play.on_click
        async def _(_: Any) -> None:
            viewer.ask(self._play)

        @halt.on_click
        async def _(_: Any) -> None:
            viewer.ask(viewer.halt)

        @reset.on_click
        async def _(_: Any) -> None:
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

    def _force(self, axis: int) -> Any:
        most = self._viewer.reach.force
        slider = self._viewer.server.gui.add_slider(
            f"force {_AXES[axis]} [N]", -most, most, most / _FINE, 0.0
        )

        @slider.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                value = float(slider.value)
                self._viewer.ask(lambda: self._set_force(axis, value))

        return slider

    def _set_force(self, axis: int, value: float) -> None:
        force = list(self._viewer.way.end.tip_force)
        force[axis] = value
        self._load(tip_force=tuple(force))

    def _load(self, **change: Any) -> None:
        self.following = False
        self._viewer.go(replace(self._viewer.way.end, **change))

    def _play(self) -> None:
        self.following = True
        self._viewer.cycle(self.active)

    def follow(self, controls: Controls) -> None:
        """Put every slider where the settings are."""
        for drive, by, value in zip(self._drives, controls.by, controls.value, strict=True):
            drive.follow(by, value)
        for slider, value in zip(self._forces, controls.tip_force, strict=True):
            _put(slider, value)
        _put(self._mass, controls.tip_mass)
        if self._pointing.value != controls.pointing:
            self._pointing.value = controls.pointing


class _Drive:
    """What drives one tendon: by tension or by stroke, a slider, and how far it goes."""

    def __init__(self, viewer: Viewer, owner: LoadControls, tendon: int) -> None:
        self._viewer = viewer
        gui, reach = viewer.server.gui, viewer.reach
        several = viewer.session.robot.number_of_tendons > 1
        self._of = of = f"{tendon + 1} " if several else ""
        self._ends = {TENSION: reach.tension[tendon], STROKE: reach.stroke[tendon]}
        # Drawn on one side, a tendon on the other is let out.
        self._least = {TENSION: 0.0, STROKE: -self._ends[STROKE] if several else 0.0}
        most = self._ends[TENSION]
        self._by = gui.add_dropdown(
            f"tendon {of}by", tuple(_BY.values()), initial_value=_BY[TENSION]
        )
        # One slider for both, which stays where it is on the page.
        self._slider = gui.add_slider(f"{of}{_BY[TENSION]}", 0.0, most, most / _FINE, 0.0)
        self._slider.precision = _DIGITS
        self._last = gui.add_number(
            f"{of}slider to", most, min=1e-6, hint="how far this slider goes"
        )

        @self._slider.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                # At once: a slider that somebody holds must not be put elsewhere meanwhile.
                owner.following = False
                value = float(self._slider.value)
                viewer.ask(lambda: self._moved(owner, tendon, value))

        @self._by.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                viewer.ask(lambda: viewer.drive_by(tendon, self._chosen()))

        @self._last.on_update
        async def _(event: Any) -> None:
            if event.client is not None:
                viewer.ask(lambda: self._stretch(tendon))

    def _chosen(self) -> str:
        return next(by for by, text in _BY.items() if text == self._by.value)

    def _moved(self, owner: LoadControls, tendon: int, value: float) -> None:
        by = self._viewer.way.end.by[tendon]
        if self._slider.label != f"{self._of}{_BY[by]}":
            return  # it was moved before it came to stand for something else
        if owner.active != tendon:
            owner.show(tendon)
        self._viewer.drive(tendon, by, value)

    def _stretch(self, tendon: int) -> None:
        by, reach = self._chosen(), self._viewer.reach
        now = self._viewer.session.controls.value[tendon]
        most = max(float(self._last.value), round_up(now) if now > 0.0 else 0.0)
        ends = list(reach.tension if by == TENSION else reach.stroke)
        ends[tendon] = most
        self._viewer.stretch(replace(reach, **{by: tuple(ends)}))

    def follow(self, by: str, value: float) -> None:
        """Show the slider that drives the tendon, where it is."""
        if self._by.value != _BY[by]:
            self._by.value = _BY[by]
        slider, label = self._slider, f"{self._of}{_BY[by]}"
        if slider.label != label:
            slider.label, slider.min, slider.max = label, self._least[by], self._ends[by]
            slider.step = self._ends[by] / _FINE
            self._last.value = self._ends[by]
        _put(slider, value)


def _put(slider: Any, value: float) -> None:
    """Put a slider somewhere; one that is there is left alone."""
    value = min(max(float(value), slider.min), slider.max)
    if abs(float(slider.value) - value) > 1e-9:
        slider.value = value


__all__ = ["LoadControls"]
