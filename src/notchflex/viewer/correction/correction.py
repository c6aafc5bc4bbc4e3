"""Correcting fits to photographs by hand: drag points of the chain, fit again, accept."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from dataclasses import replace
from html import escape

import numpy as np

from notchflex import InputError
from notchflex.photographs.board import Board
from notchflex.photographs.chain_table import chain_table
from notchflex.photographs.judging import UNCERTAINTY
from notchflex.photographs.measure import checked_uncertainty, measure_picture
from notchflex.photographs.measured import MeasuredPhotograph, MeasuredPhotographs
from notchflex.photographs.outline import straight_chain
from notchflex.photographs.reading import read_photograph
from notchflex.photographs.sighting import Ruler
from notchflex.viewer.correction.picture_plane import PicturePlane
from notchflex.viewer.page.readout import notice
from notchflex.viewer.server import HOST, PORT, check_host, check_installed, serve
from notchflex.viewer.tasks import Tasks

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
        found: What was measured without corrections.
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
        self.found, self.number = measured, 0
        self._ruler = Ruler(scale, board)
        self._uncertainty = checked_uncertainty(uncertainty_deg)
        self.results = list(measured.photographs)
        self._table = chain_table(measured.robot)
        self._tasks = Tasks()
        self._dragged, self.message = False, ""
        self.server, self.address = serve(host, port)
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.set_panel_label(measured.robot.name)
        self._notice, self._text = gui.add_html(""), gui.add_html("")
        self._refit = gui.add_button("Refit")
        self._accept = gui.add_button("Accept")
        self._leave_out = gui.add_button("Leave out", color="gray")
        self._look = gui.add_button("Look straight", color="gray")
        self._refit.on_click(lambda _: self._ask(self.refit))
        self._accept.on_click(lambda _: self._ask(self.accept))
        self._leave_out.on_click(lambda _: self._ask(self.leave_out))
        self._look.on_click(lambda _: self._ask(self.look))
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
            self.results[self.number :] = [
                MeasuredPhotograph.refused(one.source, self._table.notches, NOT_LOOKED_AT)
                for one in self.results[self.number :]
            ]
        finally:
            with contextlib.redirect_stdout(io.StringIO()):  # a CSV may go there
                self.server.stop()
        return replace(self.found, photographs=tuple(self.results))

    def refit(self) -> None:
        """Fit again, from the points as they were dragged."""
        self._notice.content = notice("fitting", waiting=True)
        self.server.flush()
        now = self.results[self.number]
        chain = self.plane.chain
        try:
            fitted = measure_picture(
                self.picture, self._table, now.source, self._ruler, chain, self._uncertainty
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
        now = self.results[self.number]
        self.results[self.number] = MeasuredPhotograph.refused(
            now.source, self._table.notches, LEFT_OUT
        )
        self._next()

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

    def _ask(self, action: Callable[[], None]) -> None:
        """Act on the photograph that is shown now; not on the next one after a second click."""
        number = self.number
        self._tasks.add(lambda: action() if number == self.number else None)

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
        chain = now.chain if len(now.chain) else straight_chain(self._table, width, height)
        number = self.number

        def dragged() -> None:
            self._tasks.add(lambda: self.moved() if number == self.number else None, "drag")

        self.plane = PicturePlane(self.server, self.picture, chain, dragged)
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


def _described(one: MeasuredPhotograph, number: int, of: int) -> str:
    lines = [f"<b>{escape(one.source)}</b> ({number} of {of})"]
    if one.reason:
        lines.append(f"refused: {escape(one.reason)}")
    for notch, (angle, spread) in enumerate(
        zip(np.degrees(one.notch_angle), np.degrees(one.notch_angle_deviation), strict=True), 1
    ):
        if math.isfinite(angle):
            lines.append(
                f"notch {notch}: <span data-name='angle_{notch}'>{angle:.2f}</span> "
                f"± {spread:.2f} deg"
            )
    return f"<p data-name='found' style='margin: 0 1em'>{'<br>'.join(lines)}</p>"
