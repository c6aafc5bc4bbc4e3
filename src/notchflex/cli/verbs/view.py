"""`notchflex view`: a robot in the browser."""

from __future__ import annotations

import signal
from typing import Annotated

from cyclopts import Parameter

from notchflex.cli import terminal
from notchflex.cli.options import integer
from notchflex.cli.robots import RobotName, Settings, chosen_robot, robot_files
from notchflex.viewer import HOST, PORT, check_host, check_installed, exposed


def view(
    robot: RobotName,
    /,
    *,
    settings: Settings = (),
    host: Annotated[str, Parameter(allow_leading_hyphen=True, metavar="ADDRESS")] = HOST,
    port: Annotated[int, integer(1, 65535)] = PORT,
    open_browser: Annotated[bool, Parameter(name="--open")] = False,
) -> None:
    """Show a robot in the browser, with sliders for its tendons and loads.

    The robot stays where the sliders left it: friction is history-dependent, and the page draws the
    hysteresis loop. A robot file is read again when it is saved. Ends with Ctrl+C.

    Args:
        host: Address to serve on. The default can be reached from this machine only; `0.0.0.0` from
            everywhere.
        port: Port to serve on, or the next one that is free.
        open_browser: Open a browser there.
    """
    check_installed()
    check_host(host, port)
    chosen = chosen_robot(robot, settings)
    files = robot_files(robot)
    if warning := exposed(host):
        terminal.warn(f"{warning}.")
    with terminal.progress(f"solving {chosen.name} at rest"):
        from notchflex.viewer import Viewer

        viewer = Viewer(
            chosen,
            read=(lambda: chosen_robot(robot, settings)) if files else None,
            file=files[0] if files else None,
            host=host,
            port=port,
        )
    terminal.output().print(f"{chosen.name}: {viewer.address} (Ctrl+C ends)", soft_wrap=True)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: viewer.stop())
    if open_browser:
        import webbrowser

        webbrowser.open(viewer.address)
    viewer.run()
