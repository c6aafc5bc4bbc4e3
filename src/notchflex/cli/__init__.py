"""The command line: `notchflex` and `python -m notchflex`."""

from notchflex.cli.app import main, run

__all__ = ["main", "run"]
