"""Output for people: tables on standard output, everything else on standard error."""

from __future__ import annotations

import codecs
import contextlib
import os
import shutil
import sys
import unicodedata
import warnings
from collections.abc import Callable, Generator, Iterable
from typing import TYPE_CHECKING, TextIO

from notchflex.support import let_go

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

DONE, NOT_CONVERGED, BAD_INPUT = 0, 1, 2
INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, as shells expect

NARROW = 80
"""Columns that tables of fixed shape fit; also the width of a terminal of unknown width."""

WIDE = 160
"""Columns of tables as wide as the terminal where there is no terminal."""

NARROWEST = 40
"""Tables are never made for fewer columns: a broken line is better than no table."""

_PLAIN = {"–": "-", "—": "-", "−": "-", "…": ".", "·": "."}


def prepare_streams() -> None:
    """Make the standard streams of this process usable.

    A stream that the caller closed (`>&-`) is replaced by the null device. A character that the
    encoding lacks is replaced by a similar one: `mm4` for `mm⁴`, and `?` where there is none.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
    codecs.register_error("notchflex-plain", _plainer)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="notchflex-plain")


def _plainer(problem: UnicodeError) -> tuple[str, int]:
    if not isinstance(problem, UnicodeEncodeError):
        raise problem
    letters = []
    for letter in problem.object[problem.start : problem.end]:
        near = _PLAIN.get(letter) or unicodedata.normalize("NFKD", letter)
        letters.append(near.encode("ascii", "ignore").decode() or "?")
    return "".join(letters), problem.end


def width() -> int:
    """Return how many columns a table on standard output may have.

    Those of the terminal; in a pipe or file a fixed number (`WIDE`), so that the same call writes
    the same text everywhere. The variable `COLUMNS` overrides both.
    """
    fallback = NARROW if sys.stdout.isatty() else WIDE
    return max(shutil.get_terminal_size((fallback, 24)).columns, NARROWEST)


def output(columns: int | None = None) -> Console:
    """Return the console of standard output: plain text in a pipe, colours on a terminal.

    Args:
        columns: How wide tables may be; None for the terminal's width, in a pipe `NARROW`.
    """
    return _console(sys.stdout, columns)


def show(*parts: RenderableType, style: str = "", wide: bool = False) -> None:
    """Print tables, and texts that are broken at their words.

    Args:
        *parts: What is printed.
        style: Style of texts on a terminal.
        wide: Whether tables may be as wide as `width()`.
    """
    console = output(width() if wide else None)
    for part in parts:
        console.print(part, style=style)


def line(text: str, style: str = "") -> None:
    """Print a text in one line, however long it is."""
    output().print(text, style=style, soft_wrap=True)


def messages() -> Console:
    """Return the console of standard error, for notes, warnings and progress."""
    return _console(sys.stderr)


quiet = False
"""Whether notes, tables and progress are left out: `--quiet`, set once for each call."""


def note(text: str) -> None:
    """Write one line of information to standard error; nothing with `--quiet`."""
    if not quiet:
        _write("Note:", "cyan", text)


def note_written(files: Iterable[object]) -> None:
    """Write which files were written."""
    note(f"written: {', '.join(map(str, files))}.")


def warn(text: str) -> None:
    """Write one line of warning to standard error."""
    _write("Warning:", "yellow", text)


def error(text: str) -> None:
    """Write an error to standard error."""
    _write("Error:", "bold red", text)


def failed(text: str) -> int:
    """Write an error of a computation; return the exit code."""
    error(text)
    return NOT_CONVERGED


Progress = Callable[..., None]
"""Shows what is done of a stage: `(stage, done, total, status)`, the status may be left out."""


@contextlib.contextmanager
def progress(text: str, *, compiles: bool = True) -> Generator[Progress]:
    """Show that something is computed, with a bar for each stage, on a terminal only.

    The bars go when the work is done; in a pipe, in a log or with `--quiet` there are none.

    Args:
        text: What is computed: the first stage, whose length is not known before it is told.
        compiles: Whether programs of JAX may be compiled, which are kept.

    Yields:
        A function that is told how far a stage is, and what else is shown behind its bar.
    """
    from rich import progress as shown

    columns = (
        shown.TextColumn("{task.description}"),
        shown.BarColumn(),
        shown.MofNCompleteColumn(),
        shown.TimeElapsedColumn(),
        shown.TimeRemainingColumn(),
        shown.TextColumn("{task.fields[status]}"),
    )
    hidden = quiet or not sys.stderr.isatty()
    with shown.Progress(*columns, console=messages(), transient=True, disable=hidden) as bars:
        stages = {text: bars.add_task(text, total=None, status="")}

        def update(stage: str, done: int, total: int, status: str = "") -> None:
            if stage not in stages:
                stages[stage] = bars.add_task(stage, total=total, status="")
            bars.update(stages[stage], completed=done, total=total, status=status)

        if compiles:
            use_compile_cache()
        yield update


def use_compile_cache() -> None:
    """Let JAX keep its compiled programs beside those of the library.

    The library keeps its own programs in every process (`solver/programs/store.py`). JAX's settings
    belong to the whole process, so that they are changed on the command line only.
    """
    from notchflex.solver.programs import store

    # On a full disk the command's own file says so.
    warnings.filterwarnings("ignore", "Error (reading|writing) persistent compilation cache")
    folder = store.program_folder()
    if folder is None or store.VARIABLE in os.environ:
        return
    from notchflex._jax import jax

    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def _write(head: str, style: str, text: str) -> None:
    from rich.text import Text

    # soft_wrap: a terminal wraps long lines itself, and a log keeps one line per message.
    with contextlib.suppress(OSError):  # a full disk under a log: nowhere to report it
        messages().print(Text.assemble((head, style), " ", text), soft_wrap=True)
        return
    let_go(sys.stderr)


def _console(stream: TextIO, columns: int | None = None) -> Console:
    from rich.console import Console

    class ForgivingConsole(Console):
        """A console whose reader may go away: the work continues, with its exit code."""

        def on_broken_pipe(self) -> None:  # rich would end the process with code 1
            del self._buffer[:]
            let_go(stream)

    terminal = stream.isatty()
    if columns is None:
        columns = shutil.get_terminal_size((NARROW, 24)).columns if terminal else NARROW
    return ForgivingConsole(
        file=stream,
        width=columns,
        highlight=False,
        markup=False,
        force_terminal=terminal and os.environ.get("TERM") != "dumb",
        no_color=not terminal or "NO_COLOR" in os.environ,
    )
