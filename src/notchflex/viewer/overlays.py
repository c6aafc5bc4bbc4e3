"""Beside the robot: a handle to drag the tip by, the points it can reach, and the sensed force."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from notchflex import InputError, Load, Robot
from notchflex.plotting import BLUE, GREEN, ORANGE
from notchflex.sensing import SensedForce, SensorNoise, sense
from notchflex.viewer.colours import add_arrows, rgb
from notchflex.viewer.controls import POINTING, ControlRanges, Controls
from notchflex.viewer.session import LoopStep, Session
from notchflex.workspaces import Workspace, workspace

_POINT = 0.004  # size of a point of the cloud, in lengths of the robot
STATES = 6000  # of the cloud
MAX_READINGS = 12
# Of good sensors: most of the interval is what friction leaves open.
NOISE = SensorNoise(tension=0.001, stroke=0.001)
_NONE = 1e-9  # N
# Arrow, interval and label of the sensed force below the tip, in outer radii.
_BELOW = (1.8, 2.4, 2.7)

Ask = Callable[[Callable[[], None]], None]


class Background:
    """Work beside the solver thread, on what was requested last.

    Args:
        ask: Adds a task of the solver thread.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._pool = ThreadPoolExecutor(1)
        self._last: Future[Any] | None = None
        self.key: Any = None
        """What is computed; None for nothing, whose result is dropped."""

    def request(self, key: Any, work: Callable[[], Any], use: Callable[[Any], None]) -> None:
        """Work, and hand the result to `use` in the solver thread, which gets errors as well."""

        def finish(done: Future[Any]) -> None:
            if key == self.key and not done.cancelled():
                use(done.result())

        if self._last is not None:
            self._last.cancel()
        self.key, self._last = key, self._pool.submit(work)
        self._last.add_done_callback(lambda done: self._ask(lambda: finish(done)))


class TipHandle:
    """Arrows at the tip, in the frame of the world.

    While a person drags the handle it stays where the mouse is; otherwise it is at the tip. `aim`
    is called in the event loop with each place of the handle [mm], and whether it is the last one
    of a drag.
    """

    def __init__(self, scene: Any, size: float, aim: Callable[[np.ndarray, bool], None]) -> None:
        self._dragged = False
        self.node = scene.add_transform_controls(
            "/target", scale=size, disable_rotations=True, depth_test=False, visible=False
        )

        @self.node.on_update
        async def _(event: Any) -> None:
            last = event.phase == "end"
            self._dragged = not last
            aim(np.array(event.target.position, float), last)

    def update(self, tip: Float[np.ndarray, " 3"], shown: bool) -> None:
        """Show or hide it, and move it to the tip unless it is dragged."""
        self.node.visible = shown
        if shown and not self._dragged:
            self.node.position = tip


class ReachableCloud:
    """Points of a workspace: those while loading in one colour, while unloading in another.

    They are computed again when the robot, the loads at the tip or the sliders change.
    """

    def __init__(self, scene: Any, length: float, ask: Ask) -> None:
        self._scene, self._length = scene, length
        self._background = Background(ask)
        self._node: Any = None

    def update(self, robot: Robot, controls: Controls, ends: ControlRanges, shown: bool) -> None:
        """Show or hide the points; compute them where they are not known."""
        key = (robot, controls.tip_force, controls.tip_mass, controls.pointing, ends.tension)
        if shown and key != self._background.key:
            self.remove()
            self._background.request(key, lambda: explored(robot, controls, ends), self._show)
        if self._node is not None:
            self._node.visible = shown

    def remove(self) -> None:
        """Remove the points."""
        if self._node is not None:
            self._node.remove()
        self._node = self._background.key = None

    @property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """The points that are shown [mm]."""
        node: Any = self._node
        return np.zeros((0, 3)) if node is None or not node.visible else np.asarray(node.points)

    def _show(self, cloud: Workspace) -> None:
        colours = np.where(cloud.loading[:, None], rgb(BLUE), rgb(ORANGE)).astype(np.uint8)
        self._node = self._scene.add_point_cloud(
            "/cloud", cloud.tip, colours, precision="float32",
            point_size=_POINT * self._length, point_shape="circle",
        )  # fmt: skip


def explored(robot: Robot, controls: Controls, ends: ControlRanges) -> Workspace:
    """Return the states that a robot reaches with the tensions of its sliders.

    Raises:
        InputError: There are none.
    """
    load = Load(
        tip_force=controls.tip_force,
        tip_mass=controls.tip_mass,
        base_rotation=POINTING[controls.pointing],
    )
    cloud = workspace(robot, tension=np.array(ends.tension), states=STATES, load=load)
    if not len(cloud):
        raise InputError.NO_DATA("no state of the reachable cloud converged under these loads")
    return cloud


class SensedArrow:
    """The force at the tip computed from readings of the tendons, with its interval, in the world.

    The tensions and strokes of the load history are the readings; of the force it knows nothing.
    """

    def __init__(self, scene: Any, radius: float, longest: float, ask: Ask) -> None:
        self._longest = longest
        self._background = Background(ask)
        self.sensed: SensedForce | None = None
        # Below the tip, beside the arrows of the loads and of the handle.
        self._start, self._bar, label = np.outer(_BELOW, [0.0, 0.0, -radius])
        self._root = scene.add_frame("/sensed", show_axes=False, visible=False)
        self._arrow = add_arrows(scene, "/sensed/force", GREEN, radius)
        self._interval: Any = scene.add_line_segments(
            "/sensed/interval", np.zeros((1, 2, 3)), rgb(GREEN), thickness=0.2 * radius
        )
        self._label = scene.add_label("/sensed/label", "", position=label, anchor="top-left")

    def update(self, session: Session, shown: bool, still: bool) -> None:
        """Show or hide the arrow; sense again where the robot stands still and has moved."""
        solved = session.solved
        if not shown or solved != self._background.key:
            self._root.visible, self.sensed, self._background.key = False, None, None
        if not shown or not still or solved == self._background.key:
            return
        robot, load = session.robot, Load(base_rotation=POINTING[session.pointing])
        tension, stroke = read(session.history)
        if tension.any():
            self._background.request(
                solved,
                lambda: sense(robot, tension, stroke, noise=NOISE, known=load),
                lambda force: self._show(solved.tip_position[0], force),
            )

    def remove(self) -> None:
        """Remove all of it."""
        self._root.remove()
        self._background.key = None

    def _show(self, tip: Float[np.ndarray, " 3"], force: SensedForce) -> None:
        self.sensed = force
        self._label.text = text(force)
        self._root.position, self._root.visible = tip, True
        self._arrow.visible = self._interval.visible = bool(force.converged[-1])
        if force.converged[-1]:
            ends = np.abs([force.low[-1], force.high[-1], force.force[-1]])
            scale = self._longest / max(float(ends.max()), _NONE)
            arrow = np.stack([self._start, self._start + scale * force.vector[-1]])
            self._arrow.points = arrow[None]
            self._interval.points = intervals(force, self._bar, scale)


def turning_points(rows: Float[np.ndarray, "s k"]) -> Int[np.ndarray, " r"]:
    """Return the steps between which every column goes one way, the last one included.

    Example:
        >>> turning_points(np.array([[0.0], [1.0], [2.0], [1.0], [0.5]])).tolist()
        [2, 4]
    """
    way = np.sign(np.round(np.diff(rows, axis=0), 9))
    turns = np.flatnonzero((way[1:] != way[:-1]).any(axis=1)) + 1
    return np.append(turns, len(rows) - 1)


def read(history: Sequence[LoopStep]) -> tuple[Float[np.ndarray, "r t"], Float[np.ndarray, "r t"]]:
    """Return tensions (N) and strokes (mm) of a history, where its loads turn round."""
    tension = np.array([step.tension for step in history])
    stroke = np.array([step.stroke for step in history])
    if len(tension) < 2:
        return tension[:0], stroke[:0]
    # Between turns tendons and force change in proportion, as `sense` takes them to.
    rows = turning_points(np.concatenate([tension, stroke], axis=1))[-MAX_READINGS:]
    return tension[rows], stroke[rows]


def text(force: SensedForce) -> str:
    """Return the force with its interval, component by component."""
    if not force.converged[-1]:
        return f"not sensed: {force.reason}"
    columns = zip(force.components, force.force[-1], force.low[-1], force.high[-1], strict=True)
    parts = [f"{name} {size:.3g} N ({low:.2g} to {high:.2g})" for name, size, low, high in columns]
    return ("sensed " if force.contact[-1] else "no contact: ") + ", ".join(parts)


def intervals(
    force: SensedForce, tip: Float[np.ndarray, " 3"], scale: float
) -> Float[np.ndarray, "d 2 3"]:
    """Return the interval of each component as a segment that an arrow from `tip` ends on, mm."""
    ends = np.stack([force.low[-1], force.high[-1]], axis=1)
    others = force.vector[-1] - force.force[-1][:, None] * force.directions
    return tip + scale * (others[:, None] + ends[..., None] * force.directions[:, None])
