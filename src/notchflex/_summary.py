"""A few lines about a result or a robot, as text and as an HTML table for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from math import floor, log10

MOST = 4
"""Rows or values of one kind that are listed; of more, the first or their range."""

_TURNS = 6
"""A series with more turning points than this is described by its range."""


@dataclass(frozen=True)
class Summary:
    """What `repr` and a notebook show of an object.

    Attributes:
        title: First line.
        rows: Name and value of each further line.
        hint: Last line: what to type next; "" for none.
    """

    title: str
    rows: Sequence[tuple[str, str]] = ()
    hint: str = ""

    @property
    def text(self) -> str:
        """The summary as aligned lines of text.

        Example:
            >>> print(Summary("A wrist", [("total angle", "51.5 deg"), ("tip", "(1, 2) mm")]).text)
            A wrist
              total angle  51.5 deg
              tip          (1, 2) mm
        """
        width = max((len(name) for name, _ in self.rows), default=0)
        lines = [f"  {name:<{width}}  {value}" for name, value in self.rows]
        return "\n".join([self.title, *lines, *([f"  {self.hint}"] if self.hint else [])])

    @property
    def html(self) -> str:
        """The summary as a table; every text is escaped."""
        left = ' style="text-align: left"'
        rows = [
            f"<tr><th{left}>{escape(name)}</th><td{left}>{escape(value)}</td></tr>"
            for name, value in self.rows
        ]
        hint = f"<div><small>{escape(self.hint)}</small></div>" if self.hint else ""
        return (
            f"<div><strong>{escape(self.title)}</strong></div><table>{''.join(rows)}</table>{hint}"
        )


def round_number(most: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above a positive number.

    Example:
        >>> round_number(29.8), round_number(0.2)
        (20.0, 0.2)
    """
    power = 10.0 ** floor(log10(most))
    return max(
        factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= most * (1.0 + 1e-9)
    )


class Displayed:
    """Base of objects that show a summary in a terminal and in a notebook."""

    def _summary(self) -> Summary:
        raise NotImplementedError

    def __repr__(self) -> str:
        """A few lines of text."""
        return self._summary().text

    def _repr_html_(self) -> str:
        return self._summary().html


def short(value: float, digits: int | None = None) -> str:
    """Return a number with four significant digits or some decimals, without a minus before a zero.

    Example:
        >>> short(-0.0), short(153.1234), short(10_000.0), short(float("nan"))
        ('0', '153.1', '10000', 'none')
    """
    if digits is not None:
        return f"{round(value, digits) + 0.0:.{digits}f}"
    if value != value:
        return "none"
    # Large moduli and stiffnesses are read more easily without an exponent.
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value + 0.0:.4g}"


def vector(values: Iterable[float], digits: int | None = None) -> str:
    """Return numbers in brackets, with a fixed number of decimals if one is given.

    Example:
        >>> vector([1.0, -1e-9, 2.5]), vector([1.0, -1e-9, 2.5], 2)
        ('(1, -1e-09, 2.5)', '(1.00, 0.00, 2.50)')
    """
    return f"({', '.join(short(value, digits) for value in values)})"


def course(values: Iterable[float], digits: int | None = None) -> str:
    """Return where a series starts, turns and ends; its range where it turns often; NaN left out.

    Example:
        >>> course([0.0, 1.0, 3.0, 1.5, 0.0])
        '0 to 3 to 0'
        >>> course([2.0, 2.0]), course([float("nan")])
        ('2', 'none')
    """
    series = [value for value in values if value == value]
    if not series:
        return "none"
    # Rounding errors are not turns.
    tolerance = 1e-9 * max(map(abs, series))
    ends = [series[0]]
    direction = 0.0
    for before, after in pairwise(series):
        change = after - before
        if abs(change) <= tolerance:
            continue
        if direction * change < 0.0:
            ends.append(before)
        direction = change
    if direction:
        ends.append(series[-1])
    if len(ends) > _TURNS:
        return f"between {short(min(series), digits)} and {short(max(series), digits)}"
    return " to ".join(short(end, digits) for end in ends)
