"""What a person sees: tables on standard output, everything else on standard error."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Generator
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.console import Console

NARROW = 80
"""Columns of a terminal that every table fits; also the width when writing into a pipe."""


def output() -> Console:
    """Return the console of standard output: plain text in a pipe, colours on a terminal."""
    return _console(sys.stdout)


def messages() -> Console:
    """Return the console of standard error, for notes, warnings and progress."""
    return _console(sys.stderr)


def note(text: str) -> None:
    """Write one line of information to standard error."""
    _say("Note:", "cyan", text)


def warn(text: str) -> None:
    """Write one line of warning to standard error."""
    _say("Warning:", "yellow", text)


def error(text: str) -> None:
    """Write what is wrong to standard error."""
    _say("Error:", "bold red", text)


@contextlib.contextmanager
def working(text: str) -> Generator[None]:
    """Show that something is being computed, on a terminal only, and take it away afterwards."""
    if not sys.stderr.isatty():
        yield
        return
    with messages().status(text):
        yield


def _say(head: str, style: str, text: str) -> None:
    from rich.text import Text

    # soft_wrap: a terminal wraps long lines itself, and a log keeps one line a message.
    messages().print(Text.assemble((head, style), " ", text), soft_wrap=True)


def _console(stream: TextIO) -> Console:
    from rich.console import Console

    terminal = stream.isatty()
    width = shutil.get_terminal_size((NARROW, 24)).columns if terminal else NARROW
    return Console(
        file=stream,
        width=width,
        highlight=False,
        markup=False,
        force_terminal=terminal and os.environ.get("TERM") != "dumb",
        no_color=not terminal or "NO_COLOR" in os.environ,
    )
