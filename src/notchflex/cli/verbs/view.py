"""`notchflex view`: a robot in the browser."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Annotated

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.arguments.options import RobotName, Settings, chosen_robot, robot_files
from notchflex.errors import InputError
from notchflex.viewer import HOST, PORT, check_host, check_installed, exposed


def view(
    robot: RobotName,
    /,
    *,
    settings: Settings = (),
    host: Annotated[
        str,
        Parameter(
            allow_leading_hyphen=True,
            help="Address to serve on. The default can be reached from this machine only; "
            "`0.0.0.0` from everywhere.",
        ),
    ] = HOST,
    port: Annotated[
        str,
        Parameter(
            allow_leading_hyphen=True, help="Port to serve on, or the next one that is free."
        ),
    ] = str(PORT),
    open_browser: Annotated[
        bool,
        Parameter(name="--open", negative=(), show_default=False, help="Open a browser there."),
    ] = False,
) -> None:
    """Show a robot in the browser, with sliders for its tendons and loads.

    Sliders leave the robot where they were moved to: friction remembers, and a loop grows beside
    it. A robot file is read again when it is saved. Ends with Ctrl+C.
    """
    check_installed()
    number = _port(port)
    check_host(host, number)
    chosen = chosen_robot(robot, settings)
    files = robot_files(robot)
    if warning := exposed(host):
        terminal.warn(f"{warning}.")
    with terminal.working(f"solving {chosen.name} at rest"):
        from notchflex.cli.compile_cache import use_compile_cache
        from notchflex.viewer import Viewer

        use_compile_cache()
        viewer = Viewer(
            chosen,
            read=(lambda: chosen_robot(robot, settings)) if files else None,
            file=files[0] if files else None,
            host=host,
            port=number,
        )
    terminal.output().print(f"{chosen.name}: {viewer.address} (Ctrl+C ends)", soft_wrap=True)

    def end(_number: int, _frame: FrameType | None) -> None:
        viewer.stop()

    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, end)
    if open_browser:
        import webbrowser

        webbrowser.open(viewer.address)
    viewer.run()


def _port(text: str) -> int:
    if not text.isdecimal() or len(text) > 5:
        raise InputError.OUT_OF_RANGE(f"--port {text}: give a whole number from 1 to 65535.")
    return int(text)
