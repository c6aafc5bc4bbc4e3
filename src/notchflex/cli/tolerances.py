"""Tolerances in words, as the heads and feet of tables tell them."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from notchflex.cli import terminal
from notchflex.support import described_at

if TYPE_CHECKING:
    from notchflex import Bands, Robot
    from notchflex.support import Tolerance


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


def wrapped(text: str) -> list[str]:
    """Break a paragraph at its words."""
    return textwrap.wrap(text, width=terminal.NARROW - 1)


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
