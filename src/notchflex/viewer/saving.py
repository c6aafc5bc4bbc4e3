"""Sends a picture, a table or the robot to the browser that asked for it."""

from __future__ import annotations

import io
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from notchflex import InputError
from notchflex.plotting import applied_loads, draw_marks, draw_panel, house_style, shape_at
from notchflex.support import robot_text, write_path_csv
from notchflex.viewer.colours import STRAIN, legend
from notchflex.viewer.readout import loop, rows
from notchflex.viewer.scene import quaternion
from notchflex.viewer.session import Session

if TYPE_CHECKING:
    import viser
    from matplotlib.axes import Axes

    from notchflex.viewer.viewer import Viewer

_WAIT = 20.0  # s, for a browser that is asked for a picture
_FOV = 0.5  # rad, of saved pictures: from far away, with little perspective
_SIZE, _DOTS = (12.0, 7.5), 160  # inches, dots per inch
_SHAPE = (1080, 1050)  # pixels of the view of the robot, height and width


def _send(client: viser.ClientHandle, viewer: Viewer, ending: str, content: bytes) -> None:
    plain = re.sub(r"[^a-z0-9]+", "-", viewer.session.robot.name.lower()).strip("-")
    client.send_file_download(f"{plain or 'robot'}.{ending}", content, save_immediately=True)


def table_bytes(session: Session) -> bytes:
    """Return all steps as a CSV table."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "steps.csv"
        write_path_csv(target, session.path())
        return target.read_bytes()


def send_table(client: viser.ClientHandle, viewer: Viewer) -> None:
    """Send all steps as a CSV table."""
    _send(client, viewer, "csv", table_bytes(viewer.session))


def send_robot(client: viser.ClientHandle, viewer: Viewer) -> None:
    """Send the robot as a robot file."""
    _send(client, viewer, "toml", robot_text(viewer.session.robot).encode())


def send_picture(client: viser.ClientHandle, viewer: Viewer) -> None:
    """Send a picture of the robot as that browser sees it, with its loop and a legend.

    Raises:
        InputError: The browser does not answer.
    """
    height, width = _SHAPE
    toward = client.camera.position - client.camera.look_at
    eye = viewer.scene.picture_eye(toward, _FOV, width / height)
    handle = viewer.scene.handle.node
    try:
        handle.visible = False
        view = client.get_render(
            height,
            width,
            wxyz=quaternion(eye.rotation),
            position=eye.position,
            fov=_FOV,
            transport_format="png",
            timeout=_WAIT,
        )
    except (TimeoutError, RuntimeError):
        raise InputError.NO_CONNECTION(
            "the browser sent no picture; bring its window to the front"
        ) from None
    finally:
        handle.visible = viewer.shown.handle
    _send(client, viewer, "png", picture(viewer.session, view, viewer.page.active))


def picture(session: Session, view: NDArray[np.uint8], tendon: int) -> bytes:
    """Return a PNG file: a view (height, width, 4), the loop of a tendon (from 0), a legend."""
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(_SIZE, dpi=_DOTS)
        title = figure.suptitle(session.robot.name, x=0.02, ha="left", fontsize=14)
        title.set_parse_math(False)  # a name may hold any sign
        axes = figure.add_axes((0.01, 0.02, 0.58, 0.9))
        axes.imshow(view)
        axes.set_axis_off()
        draw_panel(figure.add_axes((0.67, 0.52, 0.31, 0.41)), loop(session, tendon))
        _write(figure.add_axes((0.62, 0.02, 0.37, 0.42)), session)
        target = io.BytesIO()
        figure.savefig(target, format="png", dpi=_DOTS)
    return target.getvalue()


def _write(axes: Axes, session: Session) -> None:
    """Write numbers and loads, and a legend of the colours."""
    axes.set_axis_off()
    loads = [load.label for load in applied_loads(session.solved, 0, shape_at(session.solved, 0))]
    lines = [f"{label}: {value}" for _, label, value in rows(session)]
    lines.append(f"loads at the tip: {', '.join(loads) or 'none'}")
    style: dict[str, Any] = {"parse_math": False, "transform": axes.transAxes}
    axes.text(0.0, 1.0, "\n".join(lines), va="top", fontsize=9, **style)
    draw_marks(axes, legend(session.robot))
    position: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (-0.02, -0.02), "ncols": 2}
    axes.legend(fontsize=8, handlelength=1.2, markerscale=2.0, **position)
    if allowed := session.robot.material.allowed_strain:
        scale = axes.inset_axes((0.0, 0.43, 0.34, 0.035))
        scale.imshow(np.linspace(0.0, 1.0, 64)[None], cmap=STRAIN, aspect="auto")
        scale.set_axis_off()
        text = f"notch strain from 0 to {100.0 * allowed:g} % allowed"
        axes.text(0.0, 0.475, text, va="bottom", fontsize=8, **style)
