"""Closing of notches whose edges belong to rigid pieces, such as slots and triangular notches.

The tendon is pulled in steps from rest, which brackets the tension where an edge comes to touch.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from notchflex.analysis.closing_loads.search import ClosingStatus, find_roots, statuses
from notchflex.loads.command import tension_commands
from notchflex.solver.newton import Settings
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.run import run

# Steps of the first pull, up to so many times the tension that would close the softest notch if it
# were linear and alone; what does not close by then is reported as never closing.
_STEPS, _BEYOND_LINEAR = 40, 2.0


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
    """The same for the notches `own`, pulling one tendon."""
    free, _ = _pull(ready, tendon, np.zeros(1))
    reach = -free[0, own]  # the gap at rest: an edge so far from closing
    # Tendon and edges are about as far from the axis.
    linear = np.asarray(ready.chain.contact_stiffness)[own] * reach
    steps = np.linspace(0.0, _BEYOND_LINEAR * linear.max(), _STEPS + 1)
    overlap, _ = _pull(ready, tendon, steps)
    touching = overlap[:, own] > 0.0
    closes = touching.any(axis=0)
    after = np.maximum(touching.argmax(axis=0), 1)

    def at(tension: Float[np.ndarray, " m"]) -> tuple[np.ndarray, np.ndarray]:
        """Overlap and angle of every notch, each at its own tension, on one path."""
        order = np.argsort(tension)
        back = np.argsort(order)
        overlap, angle = _pull(ready, tendon, tension[order])
        return overlap[back, own], angle[back, own]

    low, high = (np.where(closes, steps[step], steps[-1]) for step in (after - 1, after))
    tension, precise = find_roots(lambda tension: at(tension)[0], low, high)
    _, angle = at(tension)
    found = closes & precise & np.isfinite(angle)
    failed = ~np.isfinite(overlap[:, own]).all(axis=0)
    status = statuses(found, np.asarray(~closes & ~failed))
    return np.where(found, tension, np.nan), np.where(found, angle, np.nan), status


def _pull(
    ready: PreparedChain, tendon: int, tensions: Float[np.ndarray, " s"]
) -> tuple[Float[np.ndarray, "s n"], Float[np.ndarray, "s n"]]:
    """Overlap of every notch's edges (contact force / stiffness - gap, mm) and its angle (rad)."""
    value = np.zeros((len(tensions), ready.chain.tendons))
    value[:, tendon] = tensions
    states = run(ready, tension_commands(value), ready.rest, Settings(), each_from_start=False)
    stiffness = np.asarray(ready.chain.contact_stiffness)
    overlap = states.quantity("contact_force") / stiffness - states.quantity("gap")
    good = states.converged[:, None]
    angle = states.quantity("notch_angle")
    return np.where(good, overlap, np.nan), np.where(good, angle, np.nan)
