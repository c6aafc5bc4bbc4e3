"""`notchflex robots`."""

from __future__ import annotations

from notchflex import list_robots
from notchflex.cli import terminal


def robots() -> None:
    """List the robots that come with the program."""
    rows = list_robots().items()
    terminal.output().print(terminal.table(["robot", "what it is"], rows, gap=2, colour="cyan"))
