"""The viewer: one thread that solves and draws, fed by whoever moves a slider or saves a file."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from pathlib import Path as FilePath
from threading import Event

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.viewer import parts
from notchflex.viewer.controls import Controls
from notchflex.viewer.page.notes import beyond, kept_between
from notchflex.viewer.page.page import Page
from notchflex.viewer.reach import STRETCH, Reach, reach_of
from notchflex.viewer.scene.scene import Scene
from notchflex.viewer.scene.scene.shown import Shown
from notchflex.viewer.server.address import HOST, PORT, check_host, check_installed
from notchflex.viewer.server.origin import bracketed
from notchflex.viewer.server.serving import serve
from notchflex.viewer.session import Session, Step
from notchflex.viewer.target_queue import Way
from notchflex.viewer.tasks import Tasks
from notchflex.viewer.watch import Watched

# What a browser draws: more steps a second than this are not seen.
MOST_STEPS = 60.0
# Charts and numbers are renewed more seldom than shapes, s; and files are looked at, s.
_TEXT, _LOOK = 0.1, 0.5


class Viewer:
    """A robot in the browser, with sliders for its loads.

    Args:
        robot: The robot.
        read: Reads the robot's file again after it was saved; None where there is no file.
        file: The file that is watched.
        host: Address to serve on.
        port: Port to serve on; the next free one is taken where it is not free.

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
        """Solve the robot at rest and begin to serve."""
        check_installed()
        check_host(host, port)
        self.original = robot
        self.session = Session(robot)
        self.reach: Reach = reach_of(robot)
        self._first_reach = self.reach
        self.way = Way(self.session.controls, self.reach.stride(self.session.controls.by))
        self.shown = Shown()
        self.message = ""  # why something was not done
        self.note = ""  # what was made of the last number that was set
        self.tasks = Tasks()
        self.interrupted = Event()  # the page asks to stop what takes long
        self._playing = False
        self._read = read
        self._file = Watched(file) if file is not None and read is not None else None
        self._stopped, self._looked, self._told = Event(), 0.0, 0.0
        self.server = serve(host, port)
        self.scene = Scene(self.server, robot, self.reach, self.shown)
        self.page = Page(self)
        self._draw(told=True)

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        return f"http://{bracketed(self.server.get_host())}:{self.server.get_port()}"

    @property
    def goal(self) -> Controls:
        """What the sliders show: where the robot goes, or, in a cycle, where it is."""
        if self._playing and len(self.way):
            return self.session.controls
        return self.way.end

    def ask(self, task: Callable[[], None]) -> None:
        """Let the thread that solves do something next; any thread may call this."""
        self.tasks.add(task)

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

    def stop(self) -> None:
        """End `run`; any thread may call this."""
        self._stopped.set()
        self.ask(lambda: None)

    def _turn(self) -> None:
        """Do what is to be done next, or wait for it a little."""
        started = time.monotonic()
        if started - self._looked > _LOOK:
            self._looked = started
            if self._file is not None and self._file.changed():
                self.reload()
        while (task := self.tasks.take(0.0 if len(self.way) else _LOOK)) is not None:
            task()
        controls = self.way.next()
        if controls is None:
            return
        self.advance(controls)
        rest = 1.0 / MOST_STEPS - (time.monotonic() - started)
        if rest > 0.0:
            time.sleep(rest)

    def advance(self, controls: Controls) -> Step:
        """Solve the next setting and draw what came of it: one update."""
        if self.session.is_new(controls):
            self.page.busy("preparing: a new kind of load is compiled once, which takes seconds")
        step = self.session.go(controls)
        if step.reason:
            self.way.clear(self.session.controls)
            self.message = f"Not reached: {step.reason}"
        self._draw(told=not len(self.way) or time.monotonic() - self._told > _TEXT)
        return step

    def _draw(self, told: bool) -> None:
        """Move the robot; renew numbers and charts if so told."""
        self.scene.update(self.session.solved, self.session.controls)
        if told:
            self._told = time.monotonic()
            self.page.tell()

    def set(self, number: int, value: float, label: str) -> None:
        """Go to another value of a number of the controls, from wherever the robot is now.

        Args:
            number: Its place in `Controls.numbers`.
            value: Its new value; one beyond its slider becomes the end of the slider.
            label: What the page calls it, with its unit in brackets.
        """
        low, high = self.reach.ends(number, self.session.controls.command(number))
        kept = min(max(value, low), high)
        self._playing = False
        self.message = self.note = ""
        if kept != value:
            self.note = beyond(label, value, (low, high), number < len(self.session.controls.by))
        self.way.turn(number, kept)
        self.page.follow()

    def drive_by(self, tendon: int, by: str) -> None:
        """Command a tendon (from 0) by tension or by stroke from now on; nothing moves."""
        self._playing = False
        self.message = self.note = ""
        goal = self.session.controls.with_tendon(tendon, by, self.session.where(tendon, by))
        self.way.clear(goal)
        self.advance(goal)
        self._stand(self.session.controls)

    def cycle(self, tendon: int) -> None:
        """Pull a tendon (from 0) from nothing to the end of its slider and let it go again."""
        self.message = self.note = ""
        self.way.hold(tendon)
        most = self.reach.ends(tendon, self.session.controls.command(tendon))[1]
        for value in (0.0, most, 0.0):
            end = self.way.end
            self.way.add(end.with_tendon(tendon, end.by[tendon], value))
        self._playing = True

    def halt(self) -> None:
        """Stay where the robot is."""
        self.note = ""
        self.way.clear(self.session.controls)
        self._stand(self.session.controls)

    def reset(self) -> None:
        """Go back to the free robot without memory."""
        self.session.reset()
        self.message = self.note = ""
        self.way.clear()
        self._stand(self.session.controls)

    def _stand(self, here: Controls) -> None:
        """Stand somewhere and show it; what is still ahead and can be reached from there stays."""
        self.interrupted.clear()
        self.way.stride = self.reach.stride(here.by)
        self.way.restart(here)
        self._draw(told=True)

    def point(self, pointing: str) -> None:
        """Point the tube elsewhere and do again what was done."""
        self._again(self.session.change(pointing=pointing, go_on=self._go_on))
        self.page.look()

    def change(self, robot: Robot) -> None:
        """Put another robot in and do to it what was done.

        One with other tendons begins anew. Its solids are made anew only where its shape changed.

        Raises:
            InputError: The robot cannot be solved; the one before stays.
        """
        old = self.session.robot
        self.message = self.note = ""
        self.page.busy("preparing the robot")
        step = self.session.change(robot, go_on=self._go_on)
        if (old.tube, old.notch, old.tendon) != (robot.tube, robot.notch, robot.tendon):
            self._reshape(robot)
            self.page.rebuild()
        self.scene.robot = robot
        self.page.name()
        self._again(step)

    def change_part(self, section: str, kind: str) -> None:
        """Give the robot another kind of friction or material."""
        self.change(parts.with_kind(self.session.robot, section, kind, self.original))

    def change_number(self, key: str, value: float) -> None:
        """Change a number of the robot by its name in the robot file."""
        self.change(self.session.robot.with_value(key, value))

    def show(self, name: str, value: bool) -> None:
        """Show something in the scene or not; see `Shown`."""
        setattr(self.shown, name, value)
        self._draw(told=False)

    def _again(self, step: Step) -> None:
        if step.reason:
            self.message = f"Not reached: {step.reason}"
            self.way.clear()
        self._stand(self.session.controls)

    def _reshape(self, robot: Robot) -> None:
        self.reach = self._first_reach = reach_of(robot)
        self.scene.remove()
        self.scene = Scene(self.server, robot, self.reach, self.shown)

    def load(self, robot: Robot, file: Watched | None = None) -> None:
        """Begin anew with another robot; a file that was watched is no more."""
        self.page.busy("preparing the robot")
        session = Session(robot, self.session.pointing)
        self.session, self.original = session, robot
        self._file = file
        self.message = self.note = ""
        self._reshape(robot)
        self.way.clear(session.controls)
        self.page.rebuild()
        self._stand(session.controls)
        self.page.look()

    def reload(self) -> None:
        """Read the robot's file again and do to the robot what was done; tell if it is no good."""
        assert self._read is not None
        try:
            robot = self._read()
        except InputError as problem:
            self._fail(f"The file was saved, but cannot be used: {problem}")
            return
        self.change(robot)
        self.original = robot

    def stretch(self, tendon: int, by: str, end: float) -> None:
        """Let a slider of a tendon (from 0) go to another end (N or mm), within sensible limits."""
        first = self._first_reach.ends(tendon, by)[1]
        now = (
            abs(self.way.end.value[tendon]) if self.session.controls.command(tendon) == by else 0.0
        )
        low, high = max(now, first / STRETCH), first * STRETCH
        kept = min(max(end, low), high)
        self.message = ""
        self.note = "" if kept == end else kept_between(low, high)
        self.reach = self.scene.reach = self.reach.stretched(tendon, by, kept)
        self.way.stride = self.reach.stride(self.session.controls.by)
        self.page.follow()

    def _go_on(self, done: int, of: int) -> bool:
        """Tell how far the robot is with what it does again, and whether it should go on."""
        if done % 20 == 0:
            self.page.busy(f"doing again what was done: step {done} of {of}")
        return not self.interrupted.is_set()

    def _fail(self, sentence: str) -> None:
        self.message = sentence
        self.page.tell()


__all__ = ["Viewer"]
