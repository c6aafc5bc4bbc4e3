"""`notchflex robots`."""

from __future__ import annotations

from notchflex._ready import list_robots
from notchflex.cli import terminal


def robots() -> None:
    """List the robots that come with the program."""
    table = terminal.table(gap=2)
    table.add_column("robot", style="cyan", no_wrap=True)
    table.add_column("what it is")
    for name, title in list_robots().items():
        table.add_row(name, title)
    terminal.output().print(table)
