"""Checked ranges of the dimensions of a notch, and those that it leaves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from notchflex.robot import Tube

_UNCHECKED = ": the stiffness of the strip was not checked"
_THIN = ": bending was found up to 5 % off, shear across the strip up to 18 %"


class CheckedRange(NamedTuple):
    """A dimension of a notch, with its range checked against finite elements.

    Attributes:
        dimension: Name of the dimension.
        value: Its value.
        low: Smallest value that was checked.
        high: Largest value that was checked.
        beyond: Note on values outside, the end of a sentence.
    """

    dimension: str
    value: float
    low: float
    high: float
    beyond: str = _UNCHECKED


def left_ranges(ranges: Iterable[CheckedRange]) -> list[str]:
    """Return a sentence for each range that is left: the number, its bound and what is known.

    Example:
        >>> left_ranges([CheckedRange("width / height", 1.36, 0.35, 1.0, ": not checked")])
        ['width / height is 1.36, above 1: not checked']
    """
    sentences: list[str] = []
    for dimension, value, low, high, beyond in ranges:
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            side, bound = ("below", low) if value < low else ("above", high)
            sentences.append(f"{dimension} is {value:.3g}, {side} {bound:g}{beyond}")
    return sentences


def wall_ranges(thickness: float, tube: Tube) -> list[CheckedRange]:
    """Return the ranges of a strip [mm] and the wall that it turns into."""
    wall = tube.outer_radius - tube.inner_radius
    return [
        CheckedRange(
            "inner / outer diameter", tube.inner_radius / tube.outer_radius, 0.4, 0.77, _THIN
        ),
        CheckedRange("strip thickness / wall", thickness / wall, 0.35, 1.0),
    ]
