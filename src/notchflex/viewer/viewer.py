"""The viewer: one thread that solves and draws, fed by the page and by saved files."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from pathlib import Path as FilePath
from threading import Event

import numpy as np

from notchflex import InputError, Robot
from notchflex.viewer.controls import STRETCH, Controls, name_of, reach_of
from notchflex.viewer.page import Page
from notchflex.viewer.scene import Scene, Shown
from notchflex.viewer.server import HOST, PORT, check_host, check_installed, serve
from notchflex.viewer.session import Session, steer, with_kind
from notchflex.viewer.tasks import TargetQueue, Task, Tasks, WatchedFile

# A browser does not show more steps a second than this.
MAX_STEPS = 60.0
# Intervals in which numbers and charts are updated while the robot moves, and in which the file is
# checked [s].
_TEXT, _CHARTS, _LOOK = 0.1, 0.5, 0.5
# Distance of the tip from its target that is worth a note, in outer radii.
_SEEN = 0.05


class Viewer:
    """A robot in the browser, with sliders for its loads.

    It is solved at rest and served on a host and a port, or the next free one. `read` reads the
    robot again after its file was saved.

    Attributes:
        tasks: What the thread that solves has to do.
        interrupted: Set to stop what takes long.

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
        check_installed()
        check_host(host, port)
        self.tasks = Tasks()
        self.interrupted, self._stopped = Event(), Event()
        self.original = robot
        self.session = Session(robot)
        self.reach = self._first_reach = reach_of(robot)
        stride = self.reach.stride(self.session.controls.by)
        self.targets = TargetQueue(self.session.controls, stride)
        self.shown = Shown()
        self.message = ""  # why something was not done, or how a number was changed
        self._playing = False
        self._read = read
        self._file = WatchedFile(file) if file is not None and read is not None else None
        self._looked = self._updated = self._charted = 0.0
        self.server, self.address = serve(host, port)
        self._make_scene(robot)
        self.page = Page(self)
        self._draw()

    @property
    def goal(self) -> Controls:
        """The settings that the sliders show: the last target, or, in a cycle, the current one."""
        return self.session.controls if self._playing and len(self.targets) else self.targets.end

    def ask(self, task: Task) -> None:
        """Add a task of the solver thread; any thread may call this."""
        self.tasks.add(task)

    def interrupt(self, task: Task) -> None:
        """Stop what takes long and add a task; any thread may call this."""
        self.interrupted.set()
        self.ask(task)

    def stop(self) -> None:
        """End `run`; any thread may call this."""
        self._stopped.set()
        self.ask(lambda: None)

    def run(self) -> None:
        """Solve and draw until `stop` is called."""
        while not self._stopped.is_set():
            try:
                self._turn()
            except InputError as problem:
                self._fail(str(problem))
            except Exception as problem:
                traceback.print_exc()
                self._fail(f"this is a bug in notchflex, please report it: {problem!r}")
        self.server.stop()

    def _turn(self) -> None:
        """Do all tasks and one step toward the next target, or wait for a task."""
        started = time.monotonic()
        if started - self._looked > _LOOK:
            self._looked = started
            if self._file is not None and self._file.changed():
                self.reload()
        while (task := self.tasks.take(0.0 if len(self.targets) else _LOOK)) is not None:
            task()
        if (controls := self.targets.next()) is not None:
            self.advance(controls)
            time.sleep(max(0.0, 1.0 / MAX_STEPS - (time.monotonic() - started)))

    def advance(self, controls: Controls, *, goes_on: bool = False) -> None:
        """Solve a setting and draw the result; `goes_on`: another one follows at once."""
        if self.session.is_new(controls):
            self.page.busy("preparing: a new kind of load is compiled once, which takes seconds")
        if reason := self.session.go(controls):
            self.targets.clear(self.session.controls)
            self.message = f"Not reached: {reason}"
        self._draw(moving=goes_on or len(self.targets) > 0)

    def _draw(self, moving: bool = False) -> None:
        """Move the robot, and update numbers and charts; while it moves, not at every step."""
        self.scene.update(self.session, still=not moving)
        now = time.monotonic()
        if not moving or now - self._updated > _TEXT:
            self._updated = now
            charts = not moving or now - self._charted > _CHARTS
            self._charted = now if charts else self._charted
            self.page.update(charts)

    def _begin(self) -> None:
        """Begin something else: clear the message, end a cycle."""
        self.message = ""
        self._playing = False

    def set(self, number: int, value: float, by: str = "") -> None:
        """Set one of the `Controls.numbers` from the current state, within its slider.

        A tendon by tension or stroke; nothing happens if it goes by the other one.
        """
        count = len(self.session.controls.by)
        if by != self.session.controls.command(number):
            return  # prescribing it failed, and the page said why
        low, high = self.reach.ends(number, by)
        kept = min(max(value, low), high)
        self._begin()
        if kept != value:
            name, unit = name_of(number, by, count)
            remedy = "; change the end under 'slider to'" if by and value > high else ""
            self.message = (
                f"{name}: {value:g} {unit} is outside its slider, from {low:g} to {high:g} {unit}. "
                f"It is set to {kept:g} {unit}{remedy}."
            )
        self.targets.set_number(number, kept)
        if number < count and number != self.page.active:
            self.page.chart(number)
        self.page.follow()

    def steer(self, point: np.ndarray, last: bool = True) -> None:
        """Bring the tip to a point (mm, in the world), or as near as the sliders allow.

        `last`: no other point follows at once.
        """
        self._begin()
        controls, error = steer(self.session, self.reach, point)
        if error > _SEEN * self.session.robot.tube.outer_radius:
            self.message = f"Out of reach: the tip stays {error:.2g} mm away."
        self.targets.clear(controls)
        self.advance(controls, goes_on=not last)

    def drive_by(self, tendon: int, by: str) -> None:
        """Prescribe the tension or the stroke of a tendon (from 0) from now on; nothing moves."""
        self._begin()
        goal = self.session.controls.with_tendon(tendon, by, self.session.where(tendon, by))
        self.targets.clear(goal)
        self.advance(goal)
        self._restart()

    def cycle(self, tendon: int) -> None:
        """Load a tendon (from 0) to the end of its slider and unload it."""
        self._begin()
        self.targets.hold(tendon)
        most = self.reach.ends(tendon, self.session.controls.command(tendon))[1]
        for value in (0.0, most, 0.0):
            end = self.targets.end
            self.targets.add(end.with_tendon(tendon, end.by[tendon], value))
        self._playing = True

    def halt(self) -> None:
        """Stop at the current state."""
        self.targets.clear(self.session.controls)
        self._restart()

    def reset(self) -> None:
        """Return to the robot at rest without history."""
        self.session.reset()
        self._begin()
        self.targets.clear()
        self._restart()

    def _restart(self, reason: str = "") -> None:
        """Continue from the current state of the session to the targets that are left.

        They are dropped for a reason why the state was not reached.
        """
        if reason:
            self.message = f"Not reached: {reason}"
            self.targets.clear()
        controls = self.session.controls
        self.interrupted.clear()
        self.targets.stride = self.reach.stride(controls.by)
        self.targets.restart(controls)
        self._draw()

    def point(self, pointing: str) -> None:
        """Change the direction of the tube and repeat the load history."""
        self._restart(self.session.change(pointing=pointing, go_on=self._go_on))
        self.page.look()

    def change(self, robot: Robot) -> None:
        """Replace the robot and repeat the load history.

        A robot with other tendons begins at rest. Solids are replaced only if the shape changed.

        Raises:
            InputError: The robot cannot be solved; the one before stays.
        """
        old = self.session.robot
        self.message = ""
        self.page.busy("preparing the robot")
        reason = self.session.change(robot, go_on=self._go_on)
        if (old.tube, old.notch, old.tendon) != (robot.tube, robot.notch, robot.tendon):
            self._reshape(robot)
        self.scene.robot = robot
        self.page.name()
        self._restart(reason)

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
            # Elsewhere than at the tip, which is reached without a search.
            aside = self.session.state.tip_position + self.session.robot.tube.outer_radius
            steer(self.session, self.reach, aside)
        self._draw()

    def _reshape(self, robot: Robot) -> None:
        self.reach = self._first_reach = reach_of(robot)
        self.scene.remove()
        self._make_scene(robot)
        self.page.rebuild()

    def _make_scene(self, robot: Robot) -> None:
        self.scene = Scene(
            self.server, robot, self.reach, self.shown, self.ask,
            lambda point, last: self.tasks.add(lambda: self.steer(point, last), "aim"),
        )  # fmt: skip

    def load(self, robot: Robot) -> None:
        """Begin again with another robot; the former file is no longer watched."""
        self.page.busy("preparing the robot")
        self.session = Session(robot, self.session.pointing)
        self.original, self._file = robot, None
        self._begin()
        self.targets.clear(self.session.controls)
        self._reshape(robot)
        self._restart()
        self.page.look()

    def reload(self) -> None:
        """Read the robot's file again and repeat the load history; report an invalid file."""
        assert self._read is not None
        try:
            robot = self._read()
        except InputError as problem:
            self._fail(f"The file was saved, but cannot be used: {problem}")
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
        self.message = ""
        if kept != end:
            self.message = f"The end of the slider must lie between {low:g} and {high:g}."
        self.reach = self.scene.reach = self.reach.stretched(tendon, by, kept)
        self.targets.stride = self.reach.stride(self.session.controls.by)
        self.page.follow()

    def _go_on(self, done: int, of: int) -> bool:
        """Show the progress of a repeated history; return whether to continue."""
        if done % 20 == 0:
            self.page.busy(f"repeating the load history: step {done} of {of}")
        return not self.interrupted.is_set()

    def _fail(self, sentence: str) -> None:
        """Show what failed."""
        self.message = sentence
        self.page.update()
