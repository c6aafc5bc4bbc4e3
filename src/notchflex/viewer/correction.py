"""Correcting fits to photographs by hand: drag points of the chain, fit again, accept."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from dataclasses import replace
from html import escape
from typing import Any

import cv2
import numpy as np
import viser
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.photographs.board import Board, Ruler
from notchflex.photographs.fitting import UNCERTAINTY
from notchflex.photographs.measure import checked_uncertainty, measure_picture
from notchflex.photographs.measured import LONGEST, MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.outline import PlanarRobot, straight_chain
from notchflex.photographs.reading import read_photograph
from notchflex.viewer.readout import notice
from notchflex.viewer.scene import CameraPose, framed
from notchflex.viewer.server import HOST, PORT, check_host, check_installed, serve
from notchflex.viewer.tasks import Tasks

Numbers = NDArray[np.float64]

_ROOT = "/photograph"
_WIDE = 10.0  # of the longer side, in lengths of the scene
# x to the right, y down and z away from the eye, as in photographs, which stand in the plane x-z.
_STANDING = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
_BEFORE = 0.02  # how far in front of the photograph lines are drawn
_POINT, _LINE = 0.025, 3.0
_ARROW = 0.6  # not of the chain: a fit to the wrong thing may be too small to be seized
_FOUND, _MISSED, _CHAIN = (60, 200, 60), (255, 140, 40), (0, 114, 178)


class PicturePlane:
    """A photograph, standing upright, and what is drawn over it.

    Args:
        server: The server.
        picture: Blue, green and red, (height, width, 3).
        chain: Points of the chain, px, (n + 2, 2).
        dragged: Called in the event loop after a point was moved.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        picture: NDArray[np.uint8],
        chain: Numbers,
        dragged: Callable[[], None],
    ) -> None:
        height, width = picture.shape[:2]
        self._scene, self._middle = server.scene, np.array([width - 1.0, height - 1.0]) / 2.0
        self._pixel = _WIDE / max(width, height)
        self._size = self._pixel * np.array([width, height])
        factor = min(1.0, LONGEST / max(width, height))
        small = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        self._root = self._scene.add_frame(_ROOT, wxyz=_STANDING, show_axes=False)
        self._scene.add_image(
            f"{_ROOT}/picture", np.ascontiguousarray(small[..., ::-1]), *self._size,
            jpeg_quality=90, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._handles = [self._handle(number, dragged) for number in range(len(chain))]
        self.chain = chain

    def _handle(self, number: int, dragged: Callable[[], None]) -> Any:
        handle = self._scene.add_transform_controls(
            f"{_ROOT}/point_{number}", scale=_ARROW, active_axes=(True, True, False),
            disable_rotations=True, depth_test=False,
        )  # fmt: skip

        @handle.on_update
        async def _(_event: Any) -> None:
            dragged()

        return handle

    @property
    def chain(self) -> Numbers:
        """Points of the chain as they were dragged, px, (n + 2, 2)."""
        positions = np.array([handle.position[:2] for handle in self._handles])
        return positions / self._pixel + self._middle

    @chain.setter
    def chain(self, points: Numbers) -> None:
        for node, position in zip(self._handles, self._placed(points), strict=True):
            node.position = position
        self.draw_chain()

    def draw_chain(self) -> None:
        """Draw lines between the points of the chain."""
        points = self._placed(self.chain)
        pairs = np.stack([points[:-1], points[1:]], axis=1)
        self._scene.add_line_segments(
            f"{_ROOT}/chain", pairs, _CHAIN, thickness=_LINE, thickness_units="screen"
        )

    def draw_outline(self, photograph: MeasuredPhotograph) -> None:
        """Draw a fitted outline: green points lie on an edge, orange ones on none."""
        within = np.abs(photograph.outline - self._middle).max(axis=1, initial=0.0) < 1e4
        colours = np.where(photograph.seen[within][:, None], _FOUND, _MISSED).astype(np.uint8)
        self._scene.add_point_cloud(
            f"{_ROOT}/outline", self._placed(photograph.outline[within]), colours,
            point_size=_POINT, point_shape="circle", precision="float32",
            point_shading="flat",
        )  # fmt: skip

    def eye(self, aspect: float) -> CameraPose:
        """Return a camera that shows all of the photograph, of a width over height."""
        x, z = 0.5 * self._size
        corners = np.array([[-x, 0.0, -z], [x, 0.0, z]])
        return framed(corners, np.array([0.0, -1.0, 0.0]), aspect, room=1.05)

    def remove(self) -> None:
        """Remove all of it."""
        self._root.remove()

    def _placed(self, points: Numbers) -> Numbers:
        """Return points of the photograph (px) in its plane, in front of it."""
        flat = self._pixel * (points - self._middle)
        return np.concatenate([flat, np.full((len(flat), 1), -_BEFORE)], axis=1)


LEFT_OUT = "left out by hand"
NOT_LOOKED_AT = "not looked at before the page was ended"

_HELP = (
    "Drag the points onto the axis of the tube: one before the first notch, one where that notch "
    "starts, and the end of every body behind a notch."
)


class Correction:
    """A page that shows one photograph after another until each is accepted or left out.

    The fit that is accepted meets the same conditions as one without a page: a photograph whose
    fit is refused can be left out, but not accepted.

    Args:
        measured: What was measured without corrections.
        scale: Pixels of the photographs per mm, as for `measure`.
        board: Board beside the robot, as for `measure`.
        uncertainty_deg: Standard deviations that are allowed, as for `measure`.
        host: Address to serve on.
        port: Port to serve on, or the next one that is free.

    Raises:
        InputError: The extra `viewer` is not installed, or nothing can be served there.
    """

    def __init__(
        self,
        measured: MeasuredPhotographs,
        *,
        scale: float | None = None,
        board: Board | None = None,
        uncertainty_deg: float = math.degrees(UNCERTAINTY),
        host: str = HOST,
        port: int = PORT,
    ) -> None:
        check_installed()
        check_host(host, port)
        self._measured, self.number = measured, 0
        self._ruler = Ruler(scale, board)
        self._uncertainty = checked_uncertainty(uncertainty_deg)
        self.results = list(measured.photographs)
        self._planar = PlanarRobot(measured.robot)
        self._tasks = Tasks()
        self._dragged, self.message = False, ""
        self.server, self.address = serve(host, port)
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.set_panel_label(measured.robot.name)
        self._notice, self._text = gui.add_html(""), gui.add_html("")
        self._button("Refit", self.refit)
        self._accept = self._button("Accept", self.accept)
        self._button("Leave out", self.leave_out, "gray")
        self._button("Look straight", self.look, "gray")
        gui.add_html(f"<p style='margin: 0 1em; font-size: 12px'>{_HELP}</p>")
        self._show()

    @property
    def done(self) -> bool:
        """Whether every photograph was accepted or left out."""
        return self.number >= len(self.results)

    def run(self) -> MeasuredPhotographs:
        """Serve the page until every photograph was accepted or left out; return the results.

        After Ctrl-C, what was accepted and left out by then is kept (`done` tells); the photograph
        that is shown and those behind it are `NOT_LOOKED_AT`.
        """
        try:
            while not self.done:
                if (task := self._tasks.take(0.5)) is not None:
                    task()
        except KeyboardInterrupt:
            # A fit of the photograph that is shown was not accepted.
            for number in range(self.number, len(self.results)):
                self._refuse(number, NOT_LOOKED_AT)
        finally:
            with contextlib.redirect_stdout(io.StringIO()):  # a CSV may go there
                self.server.stop()
        return replace(self._measured, photographs=tuple(self.results))

    def refit(self) -> None:
        """Fit again, from the points as they were dragged."""
        self._notice.content = notice("fitting", waiting=True)
        self.server.flush()
        now = self.results[self.number]
        chain = self.plane.chain
        try:
            fitted = measure_picture(
                self.picture, self._planar, now.source, self._ruler, chain, self._uncertainty
            )
        except InputError as problem:
            self.message = str(problem)
            self._update()
            return
        self.results[self.number] = fitted
        self._dragged, self.message = False, ""
        if len(fitted.chain):
            self.plane.chain = fitted.chain
        self._update()

    def accept(self) -> None:
        """Keep the fit that is shown, and go on to the next photograph."""
        if not self._dragged and self.results[self.number].measured:
            self._next()

    def leave_out(self) -> None:
        """Refuse the photograph, and go on to the next one."""
        self._refuse(self.number, LEFT_OUT)
        self._next()

    def _refuse(self, number: int, reason: str) -> None:
        source = self.results[number].source
        self.results[number] = MeasuredPhotograph.refused(source, self._planar.notches, reason)

    def look(self) -> None:
        """Move the camera of every browser in front of the photograph."""
        for client in self.server.get_clients().values():
            eye = self.plane.eye(client.camera.aspect)
            client.camera.position, client.camera.look_at = eye.position, eye.target

    def moved(self) -> None:
        """Take in that a point was dragged."""
        self._dragged = True
        self.plane.draw_chain()
        self._update()

    def _button(self, label: str, action: Callable[[], None], color: Any = None) -> Any:
        button = self.server.gui.add_button(label, color=color)
        button.on_click(lambda _: self._ask(action, self.number))
        return button

    def _ask(self, action: Callable[[], None], number: int, key: str | None = None) -> None:
        """Act on one photograph; not on the next one after a second click."""
        self._tasks.add(lambda: action() if number == self.number else None, key)

    def _next(self) -> None:
        self.plane.remove()
        self.number += 1
        if not self.done:
            self._show()
            self.look()

    def _show(self) -> None:
        now = self.results[self.number]
        self.picture = read_photograph(now.source)
        height, width = self.picture.shape[:2]
        chain = now.chain if len(now.chain) else straight_chain(self._planar, width, height)
        number = self.number
        self.plane = PicturePlane(
            self.server, self.picture, chain, lambda: self._ask(self.moved, number, "drag")
        )
        self._dragged, self.message = False, ""
        eye, camera = self.plane.eye(4.0 / 3.0), self.server.initial_camera
        camera.position, camera.look_at = eye.position, eye.target
        self._update()

    def _update(self) -> None:
        now = self.results[self.number]
        self.plane.draw_outline(now)
        self._notice.content = notice(self.message)
        self._text.content = _described(now, self.number + 1, len(self.results))
        self._accept.disabled = self._dragged or not now.measured


def _described(photograph: MeasuredPhotograph, number: int, of: int) -> str:
    lines = [f"<b>{escape(photograph.source)}</b> ({number} of {of})"]
    if photograph.reason:
        lines.append(f"refused: {escape(photograph.reason)}")
    columns = np.degrees([photograph.notch_angle, photograph.notch_angle_deviation])
    for notch, (angle, spread) in enumerate(columns.T.tolist(), start=1):
        if math.isfinite(angle):
            lines.append(
                f"notch {notch}: <span data-name='angle_{notch}'>{angle:.2f}</span> "
                f"± {spread:.2f} deg"
            )
    return f"<p data-name='found' style='margin: 0 1em'>{'<br>'.join(lines)}</p>"
