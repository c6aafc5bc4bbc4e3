"""The tables that the command line prints: columns of values, each with the form of its cells."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from notchflex.cli import terminal
from notchflex.support import described_at

if TYPE_CHECKING:
    from rich.table import Table

    from notchflex import Bands, Robot
    from notchflex.support import Tolerance

NO_NUMBER = "–"

FORMS = {"deg": ".2f", "%": ".2f", "mm": ".3f", "N": ".3f"}
"""Rounding by unit."""

Columns = Sequence[tuple[str, Iterable[Any], str]]
"""Of each column the head, whose last line is the unit; the values; and the form of its numbers, as
Python formats them: "" for words, ">" for words that are aligned to the right."""


def cell(value: Any, form: str = "") -> str:
    """Return a value as a table shows it: a dash where there is none, an interval by its ends.

    Example:
        >>> cell(-0.0001, ".2f"), cell(float("nan"), ".2f"), cell(True)
        ('0.00', '–', 'yes')
    """
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple):
        ends: Iterable[Any] = value
        return " to ".join("open" if end is None else cell(end, form) for end in ends)
    if value is None or not math.isfinite(value):
        return NO_NUMBER
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        form = "d"
    text = format(value, form)
    return text.lstrip("-") if not text.strip("-0.") else text  # no minus sign of a rounded zero


def table(
    columns: Columns, *, gap: int = 1, colour: str = "", styles: Sequence[str] | None = None
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

    heads = [head for head, _, _ in columns]
    result = Table(
        box=None,
        padding=(0, gap, 0, 0),
        header_style="bold",
        pad_edge=False,
        show_header=any(heads),
    )
    deepest = max(head.count("\n") for head in heads)
    for number, (head, _, form) in enumerate(columns):
        result.add_column(
            "\n" * (deepest - head.count("\n")) + head,
            justify="right" if form else "left",
            no_wrap=bool(form),
            overflow="fold",
            style="" if number else colour,
        )
    cells = [
        [cell(value, form) for value in getattr(values, "tolist", lambda values=values: values)()]
        for _, values, form in columns
    ]
    for number, row in enumerate(zip(*cells, strict=True)):
        result.add_row(*row, style=None if styles is None else styles[number])
    return result


def frame(columns: Mapping[str, Iterable[Any]], **forms: str) -> Columns:
    r"""Return the columns of a file or a document as those of a table.

    Args:
        columns: Values by their names, such as `force_low_N`, which become heads.
        **forms: By name, the form of its numbers, where it is another than that of its unit.

    Example:
        >>> frame({"tip_x_mm": [1.5]})
        [('tip x\nmm', [1.5], '.3f')]
    """
    result: list[tuple[str, Iterable[Any], str]] = []
    for name, values in columns.items():
        values = list(values)
        words, _, unit = name.rpartition("_")
        known = unit in FORMS
        head = f"{words if known else name}".replace("_", " ") + (f"\n{unit}" if known else "")
        form = "" if any(isinstance(value, str) for value in values) else FORMS.get(unit, ".3g")
        result.append((head, values, forms.get(name, form)))
    return result


def records(rows: Sequence[Mapping[str, Any]], **forms: str) -> Columns:
    """Return rows, values by their names, as columns of a table; see `frame`."""
    names = dict.fromkeys(name for row in rows for name in row)
    return frame({name: [row.get(name) for row in rows] for name in names}, **forms)


def width_of(table: Table) -> int:
    """Return how many characters a table needs."""
    console = terminal.output()
    return console.measure(table, options=console.options.update(max_width=10_000)).maximum


def show(columns: Columns, *, gap: int = 1, colour: str = "") -> None:
    """Print a table."""
    terminal.output().print(table(columns, gap=gap, colour=colour))


def wrapped(text: str) -> list[str]:
    """Break a paragraph at its words."""
    return textwrap.wrap(text, width=terminal.NARROW - 1)


def say(*paragraphs: str) -> None:
    """Print paragraphs, broken at their words, with blank lines between."""
    text = "\n\n".join("\n".join(wrapped(paragraph)) for paragraph in paragraphs)
    terminal.output().print(text, soft_wrap=True)


def shortened(text: str, size: int) -> str:
    """Return a text of at most `size` characters; a longer one ends with `…`."""
    return text if len(text) <= size else f"{text[: size - 1]}…"


def shown_of(count: int, most: int) -> tuple[list[int], int]:
    """Return which of many rows are shown, the first and the last among them, and their stride."""
    stride = -(-count // most)
    return sorted({*range(0, count, stride), count - 1}), stride


def tolerance_lines(bands: Bands) -> list[str]:
    """Return the tolerances that bands were made with, and which of them were assumed."""
    return tolerance_words(bands.path.robot, bands.tolerances, bands.assumed)


def tolerance_words(
    robot: Robot, tolerances: Iterable[Tolerance], assumed: Collection[str]
) -> list[str]:
    """Return tolerances in lines of text.

    Args:
        robot: The robot.
        tolerances: Its tolerances.
        assumed: Names of the values whose tolerance is assumed.
    """
    words: dict[bool, list[str]] = {False: [], True: []}
    for tolerance in tolerances:
        words[tolerance.value in assumed].append(_words(robot, tolerance))
    lines: list[str] = []
    if words[False]:
        lines += wrapped(f"Tolerances: {', '.join(words[False])}.")
    if words[True]:
        text = f"Tolerances assumed: {', '.join(words[True])}."
        lines += wrapped(f"{text} A [tolerance] table in the robot file replaces them.")
    return lines


def _words(robot: Robot, tolerance: Tolerance) -> str:
    """Return a tolerance in words, such as "notch.depth 0.01 mm"."""
    unit = described_at(robot, tolerance.value).unit

    def size(value: object) -> str:
        return value if isinstance(value, str) else f"{value:g} {unit}".strip()

    if tolerance.sd is not None:
        words = f"{tolerance.value} {size(tolerance.sd)} (SD)"
    elif tolerance.plus == tolerance.minus:
        words = f"{tolerance.value} ±{size(tolerance.plus)}"
    else:
        words = f"{tolerance.value} +{size(tolerance.plus)} −{size(tolerance.minus)}"
    return f"{words} each" if tolerance.per_notch else words
