"""The notches of a robot as tables that fit a terminal: how they are cut, and how they close."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from itertools import compress, groupby, pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from notchflex import Robot
from notchflex.cli import terminal
from notchflex.robot.part import unit_of
from notchflex.support import fields_of, is_unsaid, to_table

if TYPE_CHECKING:
    from rich.table import Table

NO_NUMBER = "–"
CLOSES, NEVER, NOT_FOUND = "closes", "never", "not found"
_MEANINGS = {
    NEVER: "no tension closes the notch",
    NOT_FOUND: "the solver did not converge at the tensions in question, so the notch may close; "
    "`notchflex simulate` shows how far it bends",
}
SHORTER = {"precurvature_deg": "precurved_deg", "direction_deg": "toward_deg"}
"""Heads for what every notch has, so that there is room for what is its own."""


# Values that a table leaves out where all notches have them.
_USUAL = (None, "rigid", "outer")


def print_robot(robot: Robot, title: str, length: float, notches: list[dict[str, Any]]) -> None:
    """Print what `notchflex show` shows."""
    console = terminal.output()
    tube = robot.tube
    console.print(title, style="bold", soft_wrap=True)
    console.print(
        f"tube      outer diameter {tube.outer_diameter:g} mm, inner diameter "
        f"{tube.inner_diameter:g} mm, length {length:g} mm"
    )
    for part in ("material", "friction"):
        console.print(_summary(robot, part))
    for index, tendon in enumerate(robot.tendon, start=1):
        number = f" {index}" if len(robot.tendon) > 1 else ""
        end = robot.number_of_notches if tendon.end_body is None else tendon.end_body
        console.print(
            f"tendon{number}".ljust(10)
            + f"radius {tendon.radius:g} mm, direction {tendon.direction_deg:g} deg, "
            f"{tendon.path}, ends behind notch {end}"
        )
    console.print()
    for table in description_tables(robot):
        console.print(table)
        console.print()
    console.print(closing_table(notches))
    console.print()
    console.print(textwrap.fill(closing_legend(notches), width=terminal.NARROW - 1))


def description_tables(robot: Robot) -> list[Table]:
    """Return how the notches are cut, with one table for each kind; equal notches share a row."""
    from notchflex.analysis.closing_loads import named_values

    kinds: dict[str, dict[tuple[Any, ...], list[int]]] = {}
    names: dict[str, list[str]] = {}
    for number, notch in enumerate(robot.notches, start=1):
        values = named_values(notch)
        kind = values.pop("kind")
        names[kind] = list(values)
        kinds.setdefault(kind, {}).setdefault(tuple(values.values()), []).append(number)
    tables: list[Table] = []
    for kind, of_kind in kinds.items():
        used = [
            any(value not in _USUAL and not is_unsaid(name, value) for value in column)
            for name, *column in zip(names[kind], *of_kind, strict=True)
        ]
        heads = [SHORTER.get(name, name).replace("_", "\n") for name in names[kind]]
        rows = [
            [run_of(numbers), *map(_value, compress(values, used))]
            for values, numbers in of_kind.items()
        ]
        tables.append(_filled([f"{kind}\nnotch", *compress(heads, used)], rows))
    return tables


def run_of(numbers: list[int]) -> str:
    """Write rising numbers shortly.

    Example:
        >>> run_of([1, 2, 3, 7]), run_of([1, 3, 5, 7]), run_of([2, 6])
        ('1–3, 7', '1, 3 … 7', '2, 6')
    """
    steps = {after - before for before, after in pairwise(numbers)}
    if len(numbers) > 3 and len(steps) == 1 and steps != {1}:
        return f"{numbers[0]}, {numbers[1]} … {numbers[-1]}"
    runs = groupby(enumerate(numbers), key=lambda item: item[1] - item[0])
    ends = [[number for _, number in run] for _, run in runs]
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]}–{r[-1]}" for r in ends)


def closing_table(notches: list[dict[str, Any]]) -> Table:
    """Return the sections and the closing of all notches; columns without a number are left out."""
    several = len(notches[0]["moment_arm_mm"]) > 1
    columns = {
        "notch": [str(row["notch"]) for row in notches],
        "A\nmm²": _numbers(notches, "area_mm2", ".4f"),
        "y\nmm": _numbers(notches, "centroid_mm", ".4f"),
        "I\nmm⁴": _numbers(notches, "second_moment_mm4", ".4e"),
        "tendon": [str(row["closing_tendon"]) if several else NO_NUMBER for row in notches],
        "arm\nmm": [f"{row['moment_arm_mm'][row['closing_tendon'] - 1]:.4f}" for row in notches],
        "closing\ndeg": _numbers(notches, "closing_angle_deg", ".2f"),
        "tension\nN": [
            f"{row['closing_tension_N']:.3f}"
            if row["closing_status"] == CLOSES
            else row["closing_status"]
            for row in notches
        ],
        "strain\n%": _numbers(notches, "closing_outer_strain", ".2f", 100.0),
        "peak\n%": _numbers(notches, "closing_peak_strain", ".2f", 100.0),
    }
    shown = {head: cells for head, cells in columns.items() if {*cells} != {NO_NUMBER}}
    return _filled(list(shown), [list(row) for row in zip(*shown.values(), strict=True)])


def closing_legend(notches: list[dict[str, Any]]) -> str:
    """Return what the columns of the closing table mean."""
    pulled = "the tendon" if len(notches[0]["moment_arm_mm"]) == 1 else "the tendon named"
    spine = any("centroid_mm" in row for row in notches)
    shown = {row["closing_status"] for row in notches}
    words = (
        "A, y, I: area, centroid (from the tube axis toward the spine) and second moment"
        if spine
        else "A, I: area and second moment"
    )
    strains = (
        ", and the strain there of the outer fibre (Pacheco 2021, eq. 16) and of the farthest "
        "fibre (peak)"
        if spine
        else ""
    )
    return (
        f"{words} of what the cut leaves, where it is weakest. arm: moment arm of {pulled}. "
        f"Closing: angle of the notch and tension of that tendon pulled alone from rest{strains}."
        + "".join(f" {status}: {text}." for status, text in _MEANINGS.items() if status in shown)
    )


def _numbers(rows: list[dict[str, Any]], key: str, form: str, scale: float = 1.0) -> list[str]:
    return shown_numbers([scale * row.get(key, np.nan) for row in rows], form)


def shown_numbers(values: Sequence[float], form: str) -> list[str]:
    """Return numbers as cells of a table; a dash where there is none."""
    return [format(value, form) if np.isfinite(value) else NO_NUMBER for value in values]


def _value(value: Any) -> str:
    if value is None:
        return NO_NUMBER
    if isinstance(value, tuple):
        return " ".join(f"{one:g}" for one in cast("tuple[float, ...]", value))
    return value if isinstance(value, str) else f"{value:g}"


def _filled(heads: list[str], rows: list[list[str]]) -> Table:
    """Make a table whose columns stand two characters apart, or one where it would be too wide."""
    columns = zip(heads, *rows, strict=True)
    widths = [max(map(len, (*head.split("\n"), *cells))) for head, *cells in columns]
    gap = 2 if sum(widths) + 2 * len(widths) <= terminal.NARROW else 1
    return terminal.table([f">{head}" for head in heads], rows, gap=gap)


def _summary(robot: Robot, part: str) -> str:
    """Return the values of a part in one line, or in some with its title beside them."""
    fields = fields_of(type(getattr(robot, part)))
    table = to_table(robot)[part]
    words = [str(table.pop("kind"))]
    for key, value in table.items():
        unit = unit_of(fields[key])
        words.append(f"{key.replace('_', ' ')} {_value(value)} {unit}".strip())
    return textwrap.fill(
        ", ".join(words),
        width=terminal.NARROW,
        initial_indent=part.ljust(10),
        subsequent_indent=" " * 10,
    )
