"""The viewer: one thread that solves and draws, fed by the page and by saved files."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path as FilePath

import numpy as np

from notchflex import InputError, Robot
from notchflex.viewer.controls import STRETCH, Controls, reach_of
from notchflex.viewer.overlays.overlays import Overlays
from notchflex.viewer.page.page import Page
from notchflex.viewer.page.readout import beyond
from notchflex.viewer.scene.scene import Scene, Shown
from notchflex.viewer.server import HOST, PORT, check_host, check_installed, serve
from notchflex.viewer.session import Session, steer, with_kind
from notchflex.viewer.tasks import TargetQueue, TaskLoop, WatchedFile

# A browser does not show more steps a second than this.
MAX_STEPS = 60.0
# Intervals in which charts and numbers are updated, and in which the file is checked [s].
_TEXT, _LOOK = 0.1, 0.5
# Distance of the tip from its target that is worth a note, in outer radii.
_SEEN = 0.05


class Viewer(TaskLoop):
    """A robot in the browser, with sliders for its loads.

    It is solved at rest and served on a host and a port, or the next free one. `read` reads the
    robot again after its file was saved.

    Raises:
        InputError: The extra `viewer` is not installed, or nothing can be served there.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        read: Callable[[], Robot] | None = None,
        file: FilePath | None = None,
        host: str = HOST,
        port: int = PORT,
    ) -> None:
        super().__init__()
        check_installed()
        check_host(host, port)
        self.original = robot
        self.session = Session(robot)
        self.reach = self._first_reach = reach_of(robot)
        stride = self.reach.stride(self.session.controls.by)
        self.targets = TargetQueue(self.session.controls, stride)
        self.shown = Shown()
        self.message = ""  # why something was not done
        self.note = ""  # how the last number was changed
        self._playing = False
        self._read = read
        self._file = WatchedFile(file) if file is not None and read is not None else None
        self._looked, self._updated = 0.0, 0.0
        self.server, self.address = serve(host, port)
        self._make_scene(robot)
        self.page = Page(self)
        self._draw(update=True)

    @property
    def goal(self) -> Controls:
        """The settings that the sliders show: the last target, or, in a cycle, the current one."""
        return self.session.controls if self._playing and len(self.targets) else self.targets.end

    def run(self) -> None:
        """Solve and draw until `stop` is called."""
        super().run()
        self.server.stop()

    def turn(self) -> None:
        """Do all tasks and one step toward the next target, or wait for a task."""
        started = time.monotonic()
        if started - self._looked > _LOOK:
            self._looked = started
            if self._file is not None and self._file.changed():
                self.reload()
        while (task := self.tasks.take(0.0 if len(self.targets) else _LOOK)) is not None:
            task()
        controls = self.targets.next()
        if controls is None:
            return
        self.advance(controls)
        rest = 1.0 / MAX_STEPS - (time.monotonic() - started)
        if rest > 0.0:
            time.sleep(rest)

    def advance(self, controls: Controls, *, goes_on: bool = False) -> None:
        """Solve a setting and draw the result; `goes_on`: another one follows at once."""
        if self.session.is_new(controls):
            self.page.busy("preparing: a new kind of load is compiled once, which takes seconds")
        if reason := self.session.go(controls):
            self.targets.clear(self.session.controls)
            self.message = f"Not reached: {reason}"
        moving = goes_on or len(self.targets) > 0
        self._draw(update=not moving or time.monotonic() - self._updated > _TEXT, moving=moving)

    def _draw(self, update: bool, moving: bool = False) -> None:
        """Move the robot; with `update` also update numbers and charts."""
        self.scene.update(self.session.solved, self.session.controls)
        self.overlays.update(self.session, self.reach, self.shown, still=not moving)
        if update:
            self._updated = time.monotonic()
            self.page.update()

    def _quiet(self) -> None:
        """Clear message and note."""
        self.message = self.note = ""

    def set(self, number: int, value: float, label: str) -> None:
        """Set one of the `Controls.numbers` from the current state, within its slider.

        `label` is that of the slider, with the unit in brackets.
        """
        low, high = self.reach.ends(number, self.session.controls.command(number))
        kept = min(max(value, low), high)
        self._playing = False
        self._quiet()
        if kept != value:
            self.note = beyond(label, value, (low, high), number < len(self.session.controls.by))
        self.targets.set_number(number, kept)
        self.page.follow()

    def steer(self, point: np.ndarray, last: bool = True) -> None:
        """Bring the tip to a point (mm, in the world), or as near as the sliders allow.

        `last`: no other point follows at once.
        """
        self._playing = False
        self._quiet()
        steered = steer(self.session, self.reach, point)
        if steered.error > _SEEN * self.session.robot.tube.outer_radius:
            self.note = f"Out of reach: the tip stays {steered.error:.2g} mm away."
        self.targets.clear(steered.controls)
        self.advance(steered.controls, goes_on=not last)

    def drive_by(self, tendon: int, by: str) -> None:
        """Prescribe the tension or the stroke of a tendon (from 0) from now on; nothing moves."""
        self._playing = False
        self._quiet()
        goal = self.session.controls.with_tendon(tendon, by, self.session.where(tendon, by))
        self.targets.clear(goal)
        self.advance(goal)
        self._restart()

    def cycle(self, tendon: int) -> None:
        """Load a tendon (from 0) to the end of its slider and unload it."""
        self._quiet()
        self.targets.hold(tendon)
        most = self.reach.ends(tendon, self.session.controls.command(tendon))[1]
        for value in (0.0, most, 0.0):
            end = self.targets.end
            self.targets.add(end.with_tendon(tendon, end.by[tendon], value))
        self._playing = True

    def halt(self) -> None:
        """Stop at the current state."""
        self.note = ""
        self.targets.clear(self.session.controls)
        self._restart()

    def reset(self) -> None:
        """Return to the robot at rest without history."""
        self.session.reset()
        self._quiet()
        self.targets.clear()
        self._restart()

    def _restart(self) -> None:
        """Continue from the current state of the session to the targets that are left."""
        controls = self.session.controls
        self.interrupted.clear()
        self.targets.stride = self.reach.stride(controls.by)
        self.targets.restart(controls)
        self._draw(update=True)

    def point(self, pointing: str) -> None:
        """Change the direction of the tube and repeat the load history."""
        self._repeated(self.session.change(pointing=pointing, go_on=self._go_on))
        self.page.look()

    def change(self, robot: Robot) -> None:
        """Replace the robot and repeat the load history.

        A robot with other tendons begins at rest. Solids are replaced only if the shape changed.

        Raises:
            InputError: The robot cannot be solved; the one before stays.
        """
        old = self.session.robot
        self._quiet()
        self.page.busy("preparing the robot")
        reason = self.session.change(robot, go_on=self._go_on)
        if (old.tube, old.notch, old.tendon) != (robot.tube, robot.notch, robot.tendon):
            self._reshape(robot)
        self.scene.robot = robot
        self.page.name()
        self._repeated(reason)

    def change_part(self, section: str, kind: str) -> None:
        """Change the kind of friction or material of the robot."""
        self.change(with_kind(self.session.robot, section, kind, self.original))

    def change_number(self, key: str, value: float) -> None:
        """Change a number of the robot by its name in the robot file."""
        self.change(self.session.robot.with_value(key, value))

    def show(self, name: str, value: bool) -> None:
        """Show or hide something in the scene; see `Shown`."""
        setattr(self.shown, name, value)
        if name == "handle" and value:  # what is compiled now does not hold up the first drag
            self.page.busy("preparing to follow: compiled once, which takes seconds")
            steer(self.session, self.reach, self.session.state.tip_position)
            self.page.follow()
        self._draw(update=False)

    def _repeated(self, reason: str) -> None:
        if reason:
            self.message = f"Not reached: {reason}"
            self.targets.clear()
        self._restart()

    def _reshape(self, robot: Robot) -> None:
        self.reach = self._first_reach = reach_of(robot)
        self.scene.remove()
        self.overlays.remove()
        self._make_scene(robot)
        self.page.rebuild()

    def _make_scene(self, robot: Robot) -> None:
        self.scene = Scene(self.server, robot, self.reach, self.shown)
        self.overlays = Overlays(
            self.server, self.session, self.scene.length, self.ask,
            lambda point, last: self.tasks.add(lambda: self.steer(point, last), "aim"),
        )  # fmt: skip

    def load(self, robot: Robot, file: WatchedFile | None = None) -> None:
        """Begin again with another robot; the former file is no longer watched."""
        self.page.busy("preparing the robot")
        session = Session(robot, self.session.pointing)
        self.session, self.original = session, robot
        self._file = file
        self._quiet()
        self._reshape(robot)
        self.targets.clear(session.controls)
        self.page.rebuild()
        self._restart()
        self.page.look()

    def reload(self) -> None:
        """Read the robot's file again and repeat the load history; report an invalid file."""
        assert self._read is not None
        try:
            robot = self._read()
        except InputError as problem:
            self.fail(f"The file was saved, but cannot be used: {problem}")
            return
        self.change(robot)
        self.original = robot

    def stretch(self, tendon: int, by: str, end: float) -> None:
        """Change the end of the slider of a tendon (from 0) [N or mm], within limits."""
        first = self._first_reach.ends(tendon, by)[1]
        is_commanded = self.session.controls.command(tendon) == by
        now = abs(self.targets.end.value[tendon]) if is_commanded else 0.0
        low, high = max(now, first / STRETCH), first * STRETCH
        kept = min(max(end, low), high)
        self._quiet()
        if kept != end:
            self.note = f"The end of the slider must lie between {low:g} and {high:g}."
        self.reach = self.scene.reach = self.reach.stretched(tendon, by, kept)
        self.targets.stride = self.reach.stride(self.session.controls.by)
        self.page.follow()

    def _go_on(self, done: int, of: int) -> bool:
        """Show the progress of a repeated history; return whether to continue."""
        if done % 20 == 0:
            self.page.busy(f"repeating the load history: step {done} of {of}")
        return not self.interrupted.is_set()

    def fail(self, sentence: str) -> None:
        """Show what failed."""
        self.message = sentence
        self.page.update()
