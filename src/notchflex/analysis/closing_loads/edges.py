"""When do notches close whose edges belong to rigid pieces, as slots and triangular notches do?

The tendon is pulled in steps from rest; between the two steps where an edge comes to response, the
tension is found by false position on the solver itself.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex.analysis.closing_loads.search import ClosingStatus, statuses
from notchflex.loads.command import tension_commands
from notchflex.solver.newton import Settings
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import run

# Steps of the first pull, up to so many times the tension that would close the softest notch if it
# were linear and alone; what does not close by then is said not to close.
_STEPS, _BEYOND_LINEAR = 40, 2.0
# Rounds of false position that a notch needs; each gains one to two digits. More are run where the
# solver fails in some.
_ROUNDS, _MOST_ROUNDS = 4, 12


def edge_closing(
    ready: PreparedChain, tendon: np.ndarray, arm: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], np.ndarray]:
    """Tension (N) that closes every notch, its angle then (rad), and a `ClosingStatus`.

    Tension and angle are NaN where none was found.

    Args:
        ready: The robot.
        tendon: Which tendon is pulled for each notch, from 0.
        arm: Its lever about the notch, mm.
    """
    tension, angle = (np.full(ready.chain.flexures, np.nan) for _ in range(2))
    status = np.full(ready.chain.flexures, ClosingStatus.NEVER, dtype=object)
    for number in np.unique(tendon):
        own = np.flatnonzero((tendon == number) & (arm > 0.0))
        if len(own):
            tension[own], angle[own], status[own] = _by_one_tendon(ready, int(number), own)
    return tension, angle, status


def _by_one_tendon(
    ready: PreparedChain, tendon: int, own: np.ndarray
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"], np.ndarray]:
    # Two steps where one would do: one alone is another program to compile.
    free, _ = _pull(ready, tendon, np.zeros(2))
    reach = -free[0, own]  # the gap at rest: an edge so far from closing
    # Tendon and edges are about as far from the axis.
    linear = np.asarray(ready.chain.contact_stiffness)[own] * reach
    steps = np.linspace(0.0, _BEYOND_LINEAR * linear.max(), _STEPS + 1)
    overlap, angle = _pull(ready, tendon, steps)
    touching = overlap[:, own] > 0.0
    closes = touching.any(axis=0)
    after = np.where(closes, touching.argmax(axis=0), 1)
    column = np.arange(len(own))
    low, high = steps[after - 1], steps[after]
    at_low, at_high = (overlap[:, own][step, column] for step in (after - 1, after))
    guess, found_angle = high, angle[:, own][after, column]
    rounds, missed = np.zeros(len(own), int), np.zeros(len(own), bool)
    for _ in range(_MOST_ROUNDS if closes.any() else 0):
        if (rounds[closes] >= _ROUNDS).all():
            break
        across = high - at_high * (high - low) / (at_high - at_low)
        # Where the solver failed, the next trial lies closer to the tension that it bore.
        guess = np.where(closes, np.where(missed, 0.5 * (low + guess), across), steps[-1])
        order = np.argsort(guess)
        pressed, angle = _pull(ready, tendon, guess[order])
        here, there = (found[np.argsort(order), own] for found in (pressed, angle))
        missed = ~np.isfinite(here)
        rounds = rounds + ~missed
        found_angle = np.where(missed, found_angle, there)
        over, under = here > 0.0, here <= 0.0
        low, at_low = np.where(under, guess, low), np.where(under, here, at_low)
        high, at_high = np.where(over, guess, high), np.where(over, here, at_high)
    found = closes & (rounds >= _ROUNDS) & ~missed
    failed = ~np.isfinite(overlap[:, own]).all(axis=0)
    status = statuses(found, np.asarray(~closes & ~failed))
    return np.where(found, guess, np.nan), np.where(found, found_angle, np.nan), status


def _pull(
    ready: PreparedChain, tendon: int, tensions: Float[np.ndarray, " s"]
) -> tuple[Float[np.ndarray, "s n"], Float[np.ndarray, "s n"]]:
    """Overlap of every notch's edges (contact force / stiffness - gap, mm) and its angle (rad)."""
    value = np.zeros((len(tensions), ready.chain.tendons))
    value[:, tendon] = tensions
    came = run(ready, tension_commands(value), ready.rest, Settings(), each_from_start=False)
    stiffness = np.asarray(ready.chain.contact_stiffness)
    overlap = came.quantity("contact_force") / stiffness - came.quantity("gap")
    good = came.converged[:, None]
    angle = came.quantity("notch_angle")
    return np.where(good, overlap, np.nan), np.where(good, angle, np.nan)
