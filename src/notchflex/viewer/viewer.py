"""The viewer: one thread that solves and draws, fed by whoever moves a slider or saves a file."""

from __future__ import annotations

import contextlib
import io
import time
import traceback
from collections.abc import Callable
from pathlib import Path as FilePath
from queue import Empty, Queue
from threading import Event
from typing import TYPE_CHECKING

import numpy as np

from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.viewer import parts
from notchflex.viewer.address import HOST, PORT, check_host, check_installed
from notchflex.viewer.controls import STROKE, TENSION, Controls
from notchflex.viewer.page import Page
from notchflex.viewer.reach import Reach, reach_of
from notchflex.viewer.scene import Scene, Shown
from notchflex.viewer.session import Session, Step
from notchflex.viewer.watch import Watched
from notchflex.viewer.way import Way

if TYPE_CHECKING:
    import viser

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
        self.way = Way(self.session.controls, self._stride(self.session.controls))
        self.shown = Shown()
        self.message = ""
        self._read = read
        self._file = Watched(file) if file is not None and read is not None else None
        self._tasks: Queue[Callable[[], None]] = Queue()
        self._stopped, self._looked, self._told = Event(), 0.0, 0.0
        self.server = _server(host, port)
        self.scene = Scene(self.server, robot, self.reach, self.shown)
        self.page = Page(self)
        self._draw(told=True)

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        host = self.server.get_host()
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"

    def ask(self, task: Callable[[], None]) -> None:
        """Let the thread that solves do something next; any thread may call this."""
        self._tasks.put(task)

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
        with contextlib.suppress(Empty):
            while True:
                self._tasks.get_nowait()()
        controls = self.way.next()
        if controls is None:
            with contextlib.suppress(Empty):
                self._tasks.get(timeout=_LOOK)()
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
        self.message = ""
        if step.reason:
            self.way.clear(self.session.controls)
            self.message = f"Not reached: {step.reason}"
        done = not len(self.way)
        now = time.monotonic()
        told = done or now - self._told > _TEXT
        self._draw(told)
        return step

    def _draw(self, told: bool) -> None:
        """Move the robot; renew numbers and charts if so told."""
        self.scene.update(self.session.solved, self.session.controls)
        if told:
            self._told = time.monotonic()
            self.page.tell()

    def drive(self, tendon: int, by: str, value: float) -> None:
        """Go on to another tension or stroke of a tendon (from 0)."""
        self.go(self.way.end.with_tendon(tendon, by, value))

    def go(self, goal: Controls) -> None:
        """Go on to other settings."""
        self.way.stride = self._stride(goal)
        self.way.add(goal)

    def drive_by(self, tendon: int, by: str) -> None:
        """Command a tendon (from 0) by tension or by stroke from now on; nothing moves."""
        self._finish()
        found = self.session.state
        value = float((found.stroke if by == STROKE else found.tension)[tendon])
        self.go(self.session.controls.with_tendon(tendon, by, value))

    def cycle(self, tendon: int) -> None:
        """Pull a tendon (from 0) from nothing to the end of its slider and let it go again."""
        end = self.way.end
        by = end.by[tendon]
        most = (self.reach.tension if by == TENSION else self.reach.stroke)[tendon]
        for value in (0.0, most, 0.0):
            self.drive(tendon, by, value)

    def halt(self) -> None:
        """Stay where the robot is."""
        self.way.clear(self.session.controls)
        self.page.follow()
        self._draw(told=True)

    def reset(self) -> None:
        """Go back to the free robot without memory."""
        self.session.reset()
        self.message = ""
        self._begin()

    def _begin(self) -> None:
        """Stand where the session stands, with nothing ahead."""
        self.way = Way(self.session.controls, self._stride(self.session.controls))
        self.page.follow()
        self._draw(told=True)

    def _finish(self) -> None:
        """Go the whole way that is still ahead."""
        while (controls := self.way.next()) is not None:
            self.advance(controls)

    def point(self, pointing: str) -> None:
        """Point the tube elsewhere and do again what was done."""
        self._finish()
        self._again(self.session.change(pointing=pointing, told=self._replayed))
        self.page.look()

    def change(self, robot: Robot) -> None:
        """Put another robot in and do to it what was done.

        One with other tendons begins anew. Its solids are made anew only where its shape changed.
        """
        self._finish()
        old = self.session.robot
        self.page.busy("preparing the robot")
        try:
            step = self.session.change(robot, told=self._replayed)
            if (old.tube, old.notch, old.tendon) != (robot.tube, robot.notch, robot.tendon):
                self._reshape(robot)
            self.scene.robot = robot
        finally:  # refused, controls show again what the robot has
            self.page.rebuild()
        self._again(step)

    def change_part(self, section: str, kind: str) -> None:
        """Give the robot another kind of friction or material."""
        self._try(lambda: parts.with_kind(self.session.robot, section, kind, self.original))

    def change_number(self, key: str, value: float) -> None:
        """Change a number of the robot by its name in the robot file."""
        self._try(lambda: self.session.robot.with_value(key, value))

    def _try(self, made: Callable[[], Robot]) -> None:
        """Change the robot if that gives one; show in any case what it has."""
        try:
            robot = made()
        except InputError:
            self.page.rebuild()
            raise
        self.change(robot)

    def show(self, name: str, value: bool) -> None:
        """Show something in the scene or not; see `Shown`."""
        setattr(self.shown, name, value)
        self._draw(told=False)

    def _again(self, step: Step) -> None:
        self.message = f"Not reached: {step.reason}" if step.reason else ""
        self._begin()

    def _reshape(self, robot: Robot) -> None:
        self.reach = reach_of(robot)
        self.scene.remove()
        self.scene = Scene(self.server, robot, self.reach, self.shown)

    def load(self, robot: Robot, file: Watched | None = None) -> None:
        """Begin anew with another robot; a file that was watched is no more."""
        self.page.busy("preparing the robot")
        session = Session(robot, self.session.pointing)
        self.session, self.original = session, robot
        self._file = file
        self.message = ""
        self._reshape(robot)
        self.page.rebuild()
        self._begin()
        self.page.look()

    def reload(self) -> None:
        """Read the robot's file again and do to the robot what was done; tell if it is no good."""
        assert self._read is not None
        try:
            robot = self._read()
        except InputError as problem:
            self._fail(f"The file was saved, but cannot be used: {problem}")
            return
        self.original = robot
        self.change(robot)

    def stretch(self, reach: Reach) -> None:
        """Let sliders go to other ends."""
        self.reach = self.scene.reach = reach
        self.way.stride = self._stride(self.way.end)
        self.page.rebuild()

    def _stride(self, controls: Controls) -> np.ndarray:
        return self.reach.stride([by == STROKE for by in controls.by])

    def _replayed(self, done: int, of: int) -> None:
        self.page.busy(f"doing again what was done: step {done} of {of}")

    def _fail(self, sentence: str) -> None:
        self.message = sentence
        self.page.tell()


def _server(host: str, port: int) -> viser.ViserServer:
    """Begin to serve, in silence and without a way round the host."""
    import viser

    with contextlib.redirect_stdout(io.StringIO()):  # its own lines on where it serves
        server = viser.ViserServer(host=host, port=port, verbose=False)
    # A page could ask for a public address, through a server of others.
    server.request_share_url = lambda verbose=True: None
    return server


__all__ = ["Viewer"]
