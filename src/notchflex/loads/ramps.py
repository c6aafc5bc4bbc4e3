"""The usual load paths: one tendon pulled by tension or drawn by stroke, in equal steps."""

from __future__ import annotations

import numpy as np

from notchflex._load_words import MOST_STEPS
from notchflex.errors import InputError
from notchflex.loads.load_path import LoadPath
from notchflex.loads.validation import check_integer, check_number

_MAX_TENDONS = 1000


def pull(start: float, stop: float, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Pull one tendon by tension, from one value to another in equal steps.

    Args:
        start: First tension, N.
        stop: Last tension, N.
        steps: Number of steps, both ends included.
        tendon: Which tendon, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            tensions; a negative or infinite tension, no such tendon.

    Example:
        >>> pull(0.0, 3.0, steps=4).tension[:, 0].tolist()
        [0.0, 1.0, 2.0, 3.0]
    """
    return _ramp("tension", start, stop, steps, tendon)


def stroke_path(start: float, stop: float, steps: int = 31, *, tendon: int = 1) -> LoadPath:
    """Prescribe the stroke of one tendon, from one value to another in equal steps.

    Args:
        start: First stroke, mm.
        stop: Last stroke, mm.
        steps: Number of steps, both ends included.
        tendon: Which tendon, counted from 1.

    Returns:
        The path; `.release()` adds the way back, `.loaded(...)` external loads.

    Raises:
        InputError: Fewer than one step or more than a million, or one step between different
            strokes; an infinite stroke, no such tendon.

    Example:
        >>> stroke_path(0.0, 1.0, steps=3).stroke[:, 0].tolist()
        [0.0, 0.5, 1.0]
    """
    return _ramp("stroke", start, stop, steps, tendon)


def _ramp(what: str, start: float, stop: float, steps: int, tendon: int) -> LoadPath:
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
    first, last = check_number(start, f"the first {what}"), check_number(stop, f"the last {what}")
    if steps == 1 and first != last:
        raise InputError.OUT_OF_RANGE(
            f"a range of one step cannot go from {first:g} to {last:g}; give 2 steps or more"
        )
    commanded = np.full((steps, tendon), np.nan)
    with np.errstate(over="ignore", invalid="ignore"):
        commanded[:, tendon - 1] = np.linspace(first, last, steps)
    if not np.isfinite(commanded[:, tendon - 1]).all():
        raise InputError.NOT_FINITE(f"a {what} range needs finite ends; got {first:g} and {last:g}")
    nothing = np.full_like(commanded, np.nan)
    return LoadPath(commanded, nothing) if what == "tension" else LoadPath(nothing, commanded)


__all__ = ["pull", "stroke_path"]
