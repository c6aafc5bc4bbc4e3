"""The force at the tip computed from readings of the tendons: an arrow with its interval."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int

from notchflex import Load, Robot
from notchflex.plotting import GREEN
from notchflex.sensing import SensedForce, SensorNoise, sense
from notchflex.viewer.controls import POINTING
from notchflex.viewer.overlays.background import Background
from notchflex.viewer.scene.marks import linear, rgb
from notchflex.viewer.session import LoopHistory, Session

if TYPE_CHECKING:
    import viser

MAX_READINGS = 12
# Of good sensors: most of the interval is what friction leaves open.
NOISE = SensorNoise(tension=0.001, stroke=0.001)
_NONE = 1e-9
# Arrow, interval and label below the tip, in outer radii.
_BELOW = (1.8, 2.4, 2.7)
NAME = "/sensed"


class SensedArrow:
    """The sensed force at the tip, in the frame of the world.

    The tensions and strokes of the load history are its readings; of the force it knows nothing.
    It is computed beside the solver thread, when the robot stands still.

    Args:
        server: The server.
        radius: Outer radius of the tube, mm.
        longest: Length of what is drawn, mm; the label holds the size of the force.
        ask: Adds a task of the solver thread.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        radius: float,
        longest: float,
        ask: Callable[[Callable[[], None]], None],
    ) -> None:
        self._radius, self._longest = radius, longest
        self._background: Background[SensedForce] = Background(ask)
        self._wanted: Any = None
        self.found: SensedForce | None = None
        scene, nothing = server.scene, np.zeros((1, 2, 3))
        self._arrow = scene.add_arrows(
            f"{NAME}/force",
            nothing,
            linear([GREEN]),
            shaft_radius=0.15 * radius,
            head_radius=0.32 * radius,
            head_length=0.8 * radius,
            visible=False,
        )
        self._interval = scene.add_line_segments(
            f"{NAME}/interval", nothing, rgb(GREEN), thickness=0.2 * radius, visible=False
        )
        self._label = scene.add_label(f"{NAME}/label", "", visible=False, anchor="top-left")

    def update(self, session: Session, shown: bool, still: bool) -> None:
        """Show or hide the arrow; sense again where the robot stands still and has moved.

        Args:
            session: The robot with its load history.
            shown: Whether it is to be seen.
            still: Whether the robot stands still.
        """
        key = session.history, len(session.history), session.pointing
        same = self._wanted is not None and (
            self._wanted[0] is key[0] and self._wanted[1:] == key[1:]
        )
        if not shown or not same:
            self.found = None
            for node in (self._arrow, self._interval, self._label):
                if node.visible:
                    node.visible = False
        if not shown:
            self._wanted = None
        elif still and not same:
            self._wanted = key
            robot, tip = session.robot, np.asarray(session.state.tip_position)
            readings = read(session.history)
            if len(readings[0]) and readings[0].any():
                self._background.request(
                    lambda: sensed(robot, session.pointing, *readings),
                    lambda found: self._show(key, tip, found),
                )

    @property
    def label(self) -> str:
        """The text that is shown; "" where there is none."""
        return str(self._label.text) if self._label.visible else ""

    def remove(self) -> None:
        """Remove all of it."""
        for node in (self._arrow, self._interval, self._label):
            node.remove()
        self._wanted = None

    def _show(self, key: Any, tip: Float[np.ndarray, " 3"], force: SensedForce) -> None:
        if self._wanted is not key:
            return  # the robot has moved on
        self.found = force
        self._label.text, self._label.visible = text(force), True
        # Below the tip, beside the arrows of the loads and of the handle.
        below = np.array([0.0, 0.0, -self._radius])
        start, bar, self._label.position = (tip + far * below for far in _BELOW)
        if not force.converged[-1]:
            return
        ends = np.abs([force.low[-1], force.high[-1], force.force[-1]])
        scale = self._longest / max(float(ends.max()), _NONE)
        end = start + scale * force.vector[-1]
        self._arrow.points = np.stack([start, end])[None].astype(np.float32)
        self._arrow.visible = bool(np.abs(force.vector[-1]).max() > _NONE)
        self._interval.points = intervals(force, bar, scale).astype(np.float32)
        self._interval.visible = True


def turning_points(rows: Float[np.ndarray, "s k"]) -> Int[np.ndarray, " r"]:
    """Return the steps between which every column goes one way, the last one included.

    Example:
        >>> turning_points(np.array([[0.0], [1.0], [2.0], [1.0], [0.5]])).tolist()
        [2, 4]
    """
    way = np.sign(np.round(np.diff(rows, axis=0), 9))
    turns = np.flatnonzero((way[1:] != way[:-1]).any(axis=1)) + 1
    return np.append(turns, len(rows) - 1)


def read(history: LoopHistory) -> tuple[Float[np.ndarray, "r t"], Float[np.ndarray, "r t"]]:
    """Return tensions (N) and strokes (mm) of a history, where its loads turn round."""
    tension, stroke = np.array(history.tension), np.array(history.stroke)
    if len(tension) < 2:
        return tension[:0], stroke[:0]
    # Between turns tendons and force change in proportion, as `sense` takes them to.
    rows = turning_points(np.concatenate([tension, stroke], axis=1))[-MAX_READINGS:]
    return tension[rows], stroke[rows]


def sensed(
    robot: Robot,
    pointing: str,
    tension: Float[np.ndarray, "r t"],
    stroke: Float[np.ndarray, "r t"],
) -> SensedForce:
    """Return the force at the tip computed from the readings.

    Raises:
        InputError: Readings without information about a force.
    """
    given = Load(base_rotation=POINTING[pointing])
    return sense(robot, tension, stroke, noise=NOISE, known=given)


def text(found: SensedForce) -> str:
    """Return the force with its interval, component by component."""
    if not found.converged[-1]:
        return f"not sensed: {found.reason}"
    parts = [
        f"{name} {force:.3g} N ({low:.2g} to {high:.2g})"
        for name, force, low, high in zip(
            found.components, found.force[-1], found.low[-1], found.high[-1], strict=True
        )
    ]
    return ("sensed " if found.contact[-1] else "no contact: ") + ", ".join(parts)


def intervals(
    found: SensedForce, tip: Float[np.ndarray, " 3"], scale: float
) -> Float[np.ndarray, "d 2 3"]:
    """Return the interval of each component as a segment that an arrow from `tip` ends on, mm."""
    force = found.force[-1]
    ends = np.stack([found.low[-1], found.high[-1]], axis=1)
    others = found.vector[-1] - force[:, None] * found.directions
    return tip + scale * (others[:, None] + ends[..., None] * found.directions[:, None])
