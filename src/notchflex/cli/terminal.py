"""Output for people: tables on standard output, everything else on standard error."""

from __future__ import annotations

import codecs
import contextlib
import os
import shutil
import sys
import unicodedata
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from datetime import timedelta
from functools import partial
from typing import TYPE_CHECKING, TextIO

from notchflex.support import let_go

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

DONE, NOT_CONVERGED, BAD_INPUT = 0, 1, 2
INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, as shells expect

Counted = Callable[[int, int], None]
"""Takes what is done and all there is."""

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
    if sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdecimal():
        fallback = shutil.get_terminal_size((fallback, 24)).columns
    return max(fallback, NARROWEST)


def output(columns: int | None = None) -> Console:
    """Return the console of standard output: plain text in a pipe, colours on a terminal.

    Args:
        columns: How wide tables may be; None for the terminal's width, in a pipe `NARROW`.
    """
    return _console(sys.stdout, columns)


def messages() -> Console:
    """Return the console of standard error, for notes, warnings and progress."""
    return _console(sys.stderr)


def table(
    heads: Sequence[str], rows: Iterable[Sequence[str]] = (), *, gap: int = 1, colour: str = ""
) -> Table:
    """Return a table without lines.

    Args:
        heads: Heads of the columns, whose last lines (the units) stand side by side. `>` before one
            marks numbers, which are aligned to the right and never broken; other cells are folded
            where they are too long. No head at all is shown where all are empty.
        rows: The cells of each row.
        gap: Blanks between two columns.
        colour: Of the first column, on a terminal.
    """
    from rich.table import Table

    result = Table(
        box=None,
        padding=(0, gap, 0, 0),
        header_style="bold",
        pad_edge=False,
        show_header=any(heads),
    )
    deepest = max(head.count("\n") for head in heads)
    for number, head in enumerate(heads):
        style = colour if number == 0 else ""
        text = "\n" * (deepest - head.count("\n")) + head.removeprefix(">")
        if head.startswith(">"):
            result.add_column(text, justify="right", no_wrap=True, style=style)
        else:
            result.add_column(text, overflow="fold", style=style)
    for row in rows:
        result.add_row(*row)
    return result


def shortened(text: str, size: int) -> str:
    """Return a text of at most `size` characters; a longer one ends with `…`."""
    return text if len(text) <= size else f"{text[: size - 1]}…"


def note(text: str) -> None:
    """Write one line of information to standard error; nothing with `--quiet`."""
    if not _Quiet.on:
        _write("Note:", "cyan", text)


def warn(text: str) -> None:
    """Write one line of warning to standard error."""
    _write("Warning:", "yellow", text)


def error(text: str) -> None:
    """Write an error to standard error."""
    _write("Error:", "bold red", text)


class _Quiet:
    """Whether `--quiet` was given: set by `be_quiet`, once for each call."""

    on = False


def be_quiet(quiet: bool) -> None:
    """Set whether notes, tables and progress are left out."""
    _Quiet.on = quiet


@contextlib.contextmanager
def working(text: str) -> Generator[Callable[[str], None]]:
    """Show that something is being computed, on a terminal only, and take it away afterwards.

    Yields a function that shows what is being done now.
    """
    if not _is_watched():
        yield lambda step: None
        return
    with messages().status(text) as status:
        yield lambda step: status.update(f"{text} {step}")


@contextlib.contextmanager
def counting(text: str) -> Generator[Counted]:
    """Show a bar, on a terminal only: yields a function that takes what is done and all there is.

    The bar goes when the work is done; in a pipe, in a log or with `--quiet` there is none.
    """
    with bars(text) as show:
        yield (lambda done, total: None) if show is None else partial(show, text)


@contextlib.contextmanager
def bars(first: str = "searching") -> Generator[Callable[[str, int, int], None] | None]:
    """Show how far each stage of a long computation is, on a terminal only.

    Yields a function that is called with the stage, how much of it is done, and how much there is;
    None where nobody watches.
    """
    if not _is_watched():
        yield None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), console=messages(), transient=True) as progress:
        stages = {first: progress.add_task(first, total=None)}

        def show(stage: str, done: int, total: int) -> None:
            if stage not in stages:
                stages[stage] = progress.add_task(stage, total=total)
            progress.update(stages[stage], completed=done, total=total)

        yield show


@contextlib.contextmanager
def rate(text: str) -> Generator[Callable[[int, int, int, int], None] | None]:
    """Show rows done, their rate, the remaining time and how many have no result.

    On a terminal only. Yields a function that takes rows done, rows in all, rows without a result,
    and rows that were done before; None where nobody watches.
    """
    if not _is_watched():
        yield None
        return
    from time import monotonic

    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[status]}"),
    )
    start = monotonic()
    with Progress(*columns, console=messages(), transient=True) as progress:
        task = progress.add_task(text, total=None, status="")

        def show(done: int, total: int, unsolved: int, before: int) -> None:
            each = (monotonic() - start) / max(done - before, 1)
            left = str(timedelta(seconds=round(each * (total - done))))
            status = f"{1.0 / max(each, 1e-9):.3g} rows/s, {left} left, {unsolved} unsolved"
            progress.update(task, completed=done, total=total, status=status)

        yield show


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


def _is_watched() -> bool:
    return not _Quiet.on and sys.stderr.isatty()


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
