"""The usual load paths: one tendon pulled by tension or drawn by stroke, in equal steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeGuard

import numpy as np
from jaxtyping import Float

from notchflex._load_words import MOST_STEPS
from notchflex.errors import InputError
from notchflex.loads.load_path import LoadPath
from notchflex.loads.validation import check_integer, check_number

_MAX_TENDONS = 1000
Ends = float | Sequence[float | None] | np.ndarray
"""Tension or stroke of one tendon, or of every tendon with None where it is slack."""


def pull(start: Ends, stop: Ends, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Pull tendons by tension, from one value to another in equal steps.

    Args:
        start: First tension, N: of one tendon, or an entry per tendon with None where it is slack.
        stop: Last tension, N, in the same form.
        steps: Number of steps, both ends included.
        tendon: Which tendon a single number pulls, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            tensions; a negative or infinite tension, no such tendon, ends of other tendons.

    Example:
        >>> pull(0.0, 3.0, steps=4).tension[:, 0].tolist()
        [0.0, 1.0, 2.0, 3.0]
        >>> pull((0.0, 0.5), (1.0, 0.5), steps=2).tension.tolist()
        [[0.0, 0.5], [1.0, 0.5]]
    """
    return _ramp("tension", start, stop, steps, tendon)


def stroke_path(start: Ends, stop: Ends, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Prescribe the stroke of tendons, from one value to another in equal steps.

    Args:
        start: First stroke, mm: of one tendon, or an entry per tendon with None where it is slack.
        stop: Last stroke, mm, in the same form.
        steps: Number of steps, both ends included.
        tendon: Which tendon a single number draws, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            strokes; an infinite stroke, no such tendon, ends of other tendons.

    Example:
        >>> stroke_path(0.0, 1.0, steps=3).stroke[:, 0].tolist()
        [0.0, 0.5, 1.0]
    """
    return _ramp("stroke", start, stop, steps, tendon)


def _ramp(what: str, start: Ends, stop: Ends, steps: int, tendon: int) -> LoadPath:
    steps, tendon = check_integer(steps, "steps"), check_integer(tendon, "tendon")
    if steps < 1:
        raise InputError.NO_DATA(f"a range needs at least one step; got {steps}")
    if steps > MOST_STEPS:
        raise InputError.OUT_OF_RANGE(
            f"a range has at most {MOST_STEPS:,} steps; got {steps:,}. Take fewer."
        )
    if not 1 <= tendon <= _MAX_TENDONS:
        raise InputError.OUT_OF_RANGE(
            f"tendons are counted from 1, to {_MAX_TENDONS} at most; got {tendon}"
        )
    alone = [*[None] * (tendon - 1), 0.0]
    several = next((ends for ends in (start, stop) if _is_several(ends)), alone)
    first, last = (
        one if _is_several(one) else [None if entry is None else one for entry in several]
        for one in (start, stop)
    )
    if len(first) != len(last):
        raise InputError.WRONG_SHAPE(
            f"a {what} range needs ends for equally many tendons; got {len(first)} and {len(last)}"
        )
    commanded = np.full((steps, len(first)), np.nan)
    for number, ends in enumerate(zip(first, last, strict=True)):
        if ends != (None, None):
            commanded[:, number] = _column(what, ends, steps)
    return LoadPath(commanded) if what == "tension" else LoadPath(stroke=commanded)


def _is_several(value: Ends) -> TypeGuard[Sequence[float | None]]:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)


def _column(what: str, ends: tuple[Any, Any], steps: int) -> Float[np.ndarray, " s"]:
    """Return the steps of one tendon."""
    first, last = (
        check_number(end, f"the {name} {what}")
        for end, name in zip(ends, ("first", "last"), strict=True)
    )
    if steps == 1 and first != last:
        raise InputError.OUT_OF_RANGE(
            f"a range of one step cannot go from {first:g} to {last:g}; give 2 steps or more"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        commanded = np.linspace(first, last, steps)
    if not np.isfinite(commanded).all():
        raise InputError.NOT_FINITE(f"a {what} range needs finite ends; got {first:g} and {last:g}")
    return commanded
