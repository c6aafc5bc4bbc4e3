"""What is saved from the page: a picture, a table and the robot, sent to the browser that asked."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from notchflex.errors import InputError
from notchflex.results.files.csv import write_path_csv
from notchflex.robot import Robot, robot_text
from notchflex.viewer.scene.camera import quaternions
from notchflex.viewer.session import Session

if TYPE_CHECKING:
    import viser

    from notchflex.viewer.scene.scene import Scene

_WAIT = 20.0  # s, for a browser that is asked for a picture
_FOV = 0.5  # rad, of saved pictures: from far away, with little perspective


def file_name(robot: Robot, ending: str) -> str:
    """Return a plain name for a file of a robot.

    Example:
        >>> from notchflex import load_robot
        >>> file_name(load_robot("pacheco2021-a"), "csv")
        'pacheco-2021-wrist-a.csv'
    """
    plain = re.sub(r"[^a-z0-9]+", "-", robot.name.lower()).strip("-")
    return f"{plain or 'robot'}.{ending}"


def table_bytes(session: Session) -> bytes:
    """Return all steps as a CSV table."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "steps.csv"
        write_path_csv(target, session.path())
        return target.read_bytes()


def send_table(client: viser.ClientHandle, session: Session) -> None:
    """Send all steps as a CSV table."""
    client.send_file_download(
        file_name(session.robot, "csv"), table_bytes(session), save_immediately=True
    )


def send_robot(client: viser.ClientHandle, session: Session) -> None:
    """Send the robot as a robot file."""
    text = robot_text(session.robot)
    client.send_file_download(
        file_name(session.robot, "toml"), text.encode(), save_immediately=True
    )


def send_picture(client: viser.ClientHandle, session: Session, scene: Scene, tendon: int) -> None:
    """Send a picture of the robot from where that browser sees it, with its loop and a legend.

    Args:
        client: The browser.
        session: What was done to the robot.
        scene: The scene that the browser draws.
        tendon: The tendon of the loop, from 0.

    Raises:
        InputError: The browser does not answer.
    """
    from notchflex.viewer.page.picture import SHAPE, picture

    height, width = SHAPE
    toward = client.camera.position - client.camera.look_at
    eye = scene.picture_eye(toward, _FOV, width / height)
    try:
        view = client.get_render(
            height,
            width,
            wxyz=quaternions(eye.rotation[None])[0],
            position=eye.position,
            fov=_FOV,
            transport_format="png",
            timeout=_WAIT,
        )
    except (TimeoutError, RuntimeError):
        raise InputError.NO_CONNECTION(
            "the browser sent no picture; bring its window to the front"
        ) from None
    content = picture(session, view, tendon)
    client.send_file_download(file_name(session.robot, "png"), content, save_immediately=True)


__all__ = ["file_name", "send_picture", "send_robot", "send_table", "table_bytes"]
