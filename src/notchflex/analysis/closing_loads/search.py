"""The tension at which a notch closes, on a solver that may fail at some tensions.

The overlap, contact force / stiffness - gap, rises with the tension and goes through zero where
the notch closes. Many notches are searched at once; a solve that does not converge gives NaN, and
costs a notch one trial, not its result.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float

Overlap = Callable[[Float[np.ndarray, " m"], Bool[np.ndarray, " m"]], Float[np.ndarray, " m"]]
"""From one tension per notch, and which notches are asked for, to their overlaps (mm).

NaN where the solve did not converge. What it gives of the other notches is not read.
"""


class ClosingStatus(StrEnum):
    """Whether a notch closes under its tendon, pulled alone from rest.

    Attributes:
        CLOSES: "closes": the tension is known.
        NEVER: "never": the largest tension tried leaves it open.
        NOT_FOUND: "not found": the solver did not converge at the tensions in question.
    """

    CLOSES = "closes"
    NEVER = "never"
    NOT_FOUND = "not found"


# A tension of this many times the first guess that leaves a notch open is taken as "never".
_DOUBLINGS = 6
# Trials between a tension that leaves a notch open and one where the solver fails.
_TRIALS = 12
PRECISION = 1e-11
"""Relative precision of a tension."""

# A notch that snaps shut has no root but a jump, next to which the solver need not converge.
_AT_SNAP = 1e-3
# Enough to bisect every fifth time, which is what a jump takes.
_ROUNDS = 200


def closing_tensions(
    overlap: Overlap, guess: Float[np.ndarray, " m"], precision: float = PRECISION
) -> tuple[Float[np.ndarray, " m"], np.ndarray]:
    """Find the tension that closes each notch, and a status for each.

    Args:
        overlap: The overlap of all notches, each at its own tension.
        guess: Tensions to begin from, N; 2 ** 6 times that is the largest one tried.
        precision: Relative precision of a tension.

    Returns:
        Tensions (N), NaN where none was found, and statuses (`ClosingStatus`).
    """
    low, high, failed = _bracket(overlap, guess)
    bracketed = np.isfinite(high)
    tension, precise = find_roots(overlap, low, np.where(bracketed, high, low), precision)
    closes = bracketed & precise
    return np.where(closes, tension, np.nan), statuses(closes, ~bracketed & ~failed)


def statuses(closes: Bool[np.ndarray, " m"], never: Bool[np.ndarray, " m"]) -> np.ndarray:
    """Return a `ClosingStatus` for every notch: where neither holds, it was not found."""
    status = np.full(len(closes), ClosingStatus.NOT_FOUND, dtype=object)
    status[closes], status[never] = ClosingStatus.CLOSES, ClosingStatus.NEVER
    return status


def _bracket(
    overlap: Overlap, guess: Float[np.ndarray, " m"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"], Bool[np.ndarray, " m"]]:
    """A tension that leaves each notch open, one that closes it (NaN: none), and failures met."""
    low, high = np.zeros_like(guess), np.full_like(guess, np.nan)
    failing = np.full_like(guess, np.nan)  # smallest tension above `low` that failed
    trial = guess
    for number in range(1 + _DOUBLINGS + _TRIALS):
        doubling = number <= _DOUBLINGS
        searched = np.isnan(high) & (doubling | np.isfinite(failing))
        if not searched.any():
            break
        value = overlap(trial, searched)
        high = np.where(searched & (value > 0.0), trial, high)
        low = np.where(searched & (value <= 0.0), trial, low)
        failing = np.where(searched & np.isnan(value), np.fmin(failing, trial), failing)
        failing = np.where(failing > low, failing, np.nan)
        # Beyond the largest tension there is nothing to try, but before the first that failed.
        trial = 2.0 * trial if number < _DOUBLINGS else 0.5 * (low + np.fmax(low, failing))
    return low, high, np.isfinite(failing)


def find_roots(
    overlap: Overlap,
    low: Float[np.ndarray, " m"],
    high: Float[np.ndarray, " m"],
    precision: float = PRECISION,
) -> tuple[Float[np.ndarray, " m"], Bool[np.ndarray, " m"]]:
    """Find roots by false position, bisecting where that stalls.

    After a failed solve the next trials are elsewhere in the bracket, ever closer to its lower end.

    Args:
        overlap: The overlap of all notches, each at its own tension.
        low: Tensions (N) that leave the notches open; of one that is not searched, `high`.
        high: Tensions (N) that close them.
        precision: Relative precision of a root.

    Returns:
        The roots, and whether each is known: to that precision, or to 1e-3 where the solver
        fails nearby.
    """
    # `scipy.optimize.elementwise.find_root` gives a notch up at its first NaN. Of 9 ready robots it
    # solves 2221 states for the same roots, this one 1274 (wrist A: 281 and 67; York: 242 and 433).
    searched = low < high
    at_low, at_high = overlap(low, searched), overlap(high, searched)
    width, misses = high - low, np.zeros(low.shape, int)
    side, slow = np.zeros(low.shape, int), np.zeros(low.shape, int)
    for _ in range(_ROUNDS):
        open_still = (high - low > precision * high) & (misses < _TRIALS)
        if not open_still.any():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            part = at_low / (at_low - at_high)
        part = np.where((slow > 3) | ~((part > 0.0) & (part < 1.0)), 0.5, part)
        part = np.where(misses > 0, 0.6 ** np.maximum(misses, 1), part)
        trial = low + part * (high - low)
        value = np.where(open_still, overlap(trial, open_still), np.nan)
        up, down = value > 0.0, value <= 0.0
        # The end that stays a second time counts less, by what the other one has changed: a slope
        # that differs beyond the root does not keep it from being reached (Anderson, Björck).
        with np.errstate(divide="ignore", invalid="ignore"):
            less_low, less_high = 1.0 - value / at_high, 1.0 - value / at_low
        less_low, less_high = (np.where(m > 0.0, m, 0.5) for m in (less_low, less_high))
        high, at_high = np.where(up, trial, high), np.where(up, value, at_high)
        low, at_low = np.where(down, trial, low), np.where(down, value, at_low)
        at_low = np.where(up & (side > 0), less_low * at_low, at_low)
        at_high = np.where(down & (side < 0), less_high * at_high, at_high)
        side = np.where(up, 1, np.where(down, -1, side))
        misses = np.where(up | down, 0, misses + open_still)
        slow = np.where(high - low > 0.5 * width, slow + 1, 0)
        width = high - low
    reached = np.where(misses >= _TRIALS, _AT_SNAP, precision)
    return 0.5 * (low + high), high - low <= reached * high
