"""The tables that the command line prints: columns of values, each with the form of its cells."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from notchflex.cli import terminal
from notchflex.support import described_at

if TYPE_CHECKING:
    from rich.table import Table

    from notchflex import Robot
    from notchflex.support import Tolerance

NO_NUMBER = "–"

FORMS = {
    "deg": ".2f",
    "%": ".2f",
    "mm": ".3f",
    "mm2": ".4f",
    "mm4": ".4e",
    "N": ".3f",
    "N/mm": ".4g",
}
"""Rounding by unit."""

_HEAD = 8
"""Letters in a line of a head, where its words can be broken."""

Column = tuple[str, Sequence[Any], str]
"""Head, whose last line is the unit; values; and the form of numbers, as Python formats them: ""
for words, ">" for words that are aligned to the right."""

Data = Mapping[str, Iterable[Any]] | Sequence[Mapping[str, Any]]
"""Columns, or rows, by names such as `force_low_N`."""


def cell(value: Any, form: str = "") -> str:
    """Return a value as a table shows it: a dash where there is none, an interval by its ends.

    Example:
        >>> cell(-0.0001, ".2f"), cell(float("nan"), ".2f"), cell(True)
        ('0.00', '–', 'yes')
    """
    if isinstance(value, str):
        return value
    value = getattr(value, "tolist", lambda: value)()
    if isinstance(value, list | tuple):
        if len(value) > 2:
            return f"{len(value)} values"
        ends: Iterable[Any] = value
        return " to ".join("open" if end is None else cell(end, form) for end in ends)
    if value is None or not math.isfinite(value):
        return NO_NUMBER
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = format(value, "d" if isinstance(value, int) else form)
    return text.lstrip("-") if not text.strip("-0.") else text  # no minus sign of a rounded zero


def named(data: Data, keys: str = "", forms: Mapping[str, str] | None = None) -> list[Column]:
    r"""Return data as columns of a table; their names, broken at words, become heads.

    Args:
        data: Columns or rows; columns without any value are left out.
        keys: Names of what is shown, with blanks between; "" for all.
        forms: By name, the form of its numbers, where it is another than that of its unit.

    Example:
        >>> named({"tip_x_mm": [1.5], "reason": [None]})
        [('tip x\nmm', [1.5], '.3f')]
    """
    if not isinstance(data, Mapping):
        names = dict.fromkeys(name for row in data for name in row)
        data = {name: [row.get(name) for row in data] for name in names}
    columns: list[Column] = []
    for name in keys.split() or data:
        column: Any = data.get(name, ())
        values: list[Any] = list(getattr(column, "tolist", column.__iter__)())
        if all(cell(value) == NO_NUMBER for value in values):
            continue
        words, _, unit = name.rpartition("_")
        words, unit = (words, f"\n{unit}") if unit in FORMS else (name, "")
        is_text = any(isinstance(value, str) for value in values)
        form = (forms or {}).get(name, "" if is_text else FORMS.get(unit.strip(), ".3g"))
        widest = max(_HEAD, *(len(cell(value, form).partition("\n")[0]) for value in values))
        words = re.sub(r"^(interval|inside) (\d+)$", r"\2 % \1", words.replace("_", " "))
        words = textwrap.fill(words, widest, break_long_words=False)
        columns.append((words + unit, values, form))
    return columns


def table(
    columns: Iterable[Column], *, gap: int = 1, colour: str = "", styles: Sequence[str] = ()
) -> Table:
    """Return a table without lines, and without heads where all are empty.

    Numbers are aligned to the right and never broken; words are folded where they are too long.

    Args:
        columns: Heads, values and forms.
        gap: Blanks between two columns.
        colour: Of the first column, on a terminal.
        styles: Of every row, on a terminal.
    """
    from rich.table import Table

    heads, values, forms = zip(*columns, strict=True)
    result = Table(
        box=None,
        padding=(0, gap, 0, 0),
        header_style="bold",
        pad_edge=False,
        show_header=any(heads),
        row_styles=styles or None,
    )
    deepest = max(head.count("\n") for head in heads)
    for head, form in zip(heads, forms, strict=True):
        result.add_column(
            "\n" * (deepest - head.count("\n")) + head,
            justify="right" if form else "left",
            no_wrap=bool(form),
            overflow="fold",
            style="" if result.columns else colour,
        )
    for row in zip(*values, strict=True):
        result.add_row(*map(cell, row, forms))
    return result


def show(
    data: Data,
    keys: str = "",
    forms: Mapping[str, str] | None = None,
    *,
    colour: str = "",
    wide: bool = False,
    most: int | None = None,
) -> None:
    """Print a table of columns or rows, with two blanks between columns where these fit.

    Args:
        data: Columns or rows; see `named`.
        keys: Names of what is shown; "" for all.
        forms: By name, the form of its numbers.
        colour: Of the first column, on a terminal.
        wide: Whether it may be as wide as the terminal.
        most: Number of rows beyond which they are thinned; None for no limit.
    """
    columns = named(data, keys, forms)
    if not columns:
        return
    count = len(columns[0][1])
    stride = -(-count // (most or count))
    rows = sorted({*range(0, count, stride), count - 1})
    columns = [(head, [values[row] for row in rows], form) for head, values, form in columns]
    console = terminal.output(terminal.width() if wide else None)
    shown = table(columns, gap=2, colour=colour)
    if console.measure(shown).maximum >= console.width:
        shown = table(columns, colour=colour)
    console.print(shown)
    if stride > 1:
        terminal.note(f"{len(rows)} of {count} rows are shown; --csv and --json have all.")


def wrapped(text: str, indent: str = "") -> str:
    """Break a paragraph at its words; its further lines are indented."""
    return textwrap.fill(text, width=terminal.NARROW - 1, subsequent_indent=indent)


def shortened(text: str, size: int) -> str:
    """Return a text of at most `size` characters; a longer one ends with `…`."""
    return text if len(text) <= size else f"{text[: size - 1]}…"


def tolerance_words(
    robot: Robot, tolerances: Iterable[Tolerance], assumed: Collection[str]
) -> list[str]:
    """Return the tolerances of a robot in paragraphs: those of its file, and assumed ones."""
    words: dict[bool, list[str]] = {False: [], True: []}
    for tolerance in tolerances:
        words[tolerance.value in assumed].append(_words(robot, tolerance))
    more = " A [tolerance] table in the robot file replaces them."
    return [
        wrapped(f"Tolerances{' assumed' * is_assumed}: {', '.join(texts)}.{more * is_assumed}")
        for is_assumed, texts in words.items()
        if texts
    ]


def _words(robot: Robot, tolerance: Tolerance) -> str:
    """Return a tolerance in words, such as "notch.depth 0.01 mm"."""
    unit = described_at(robot, tolerance.value).unit

    def size(value: object) -> str:
        return value if isinstance(value, str) else f"{value:g} {unit}".strip()

    if tolerance.sd is not None:
        words = f"{size(tolerance.sd)} (SD)"
    elif tolerance.plus == tolerance.minus:
        words = f"±{size(tolerance.plus)}"
    else:
        words = f"+{size(tolerance.plus)} −{size(tolerance.minus)}"
    return f"{tolerance.value} {words}{' each' * tolerance.per_notch}"
