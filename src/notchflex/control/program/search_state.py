"""The state of the loops of the compiled search."""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Bool, Int

from notchflex.solver.continuation import LoadStepResult
from notchflex.solver.element import Iterate
from notchflex.solver.solver_state import SolverState


class SearchState(NamedTuple):
    """State of the corrections of a solved load.

    Attributes:
        drive: The drives, (t,).
        point: Unknowns and base tensions.
        state: The state there, its history included.
        values: The numbers of the response, (n,).
        slopes: Their slopes by the drives, (t, n).
        error: Weighted distance from the target.
        sticks: 1 where a tendon sticks, (t,).
        change: Correction of the drives from here, (t,).
        next_point: Unknowns and base tensions after the correction.
        stuck: Whether a tendon sticks that must move.
        beyond: Drives to solve next, beyond the dead bands of tendons that stick, (t,).
        close: Whether one more correction meets the target.
        falls: Whether the last correction has brought it nearer.
        met: Whether balance and target are met.
        corrected: How many corrections were made.
    """

    drive: Array
    point: Iterate
    state: SolverState
    values: Array
    slopes: Array
    sticks: Array
    error: Array
    change: Array
    next_point: Iterate
    stuck: Bool[Array, ""]
    beyond: Array
    close: Bool[Array, ""]
    falls: Bool[Array, ""]
    met: Bool[Array, ""]
    corrected: Int[Array, ""]


class LinearResponse(NamedTuple):
    """Linear response of a point.

    Attributes:
        residual: Largest residual there.
        values: The numbers of the response there, (n,).
        state: The state there.
        points: Changes of the point by a step to the balance, and by a unit of every drive, as
            leading axis, 1 + t.
        changes: The same of the numbers, (1 + t, n).
    """

    residual: Array
    values: Array
    state: SolverState
    points: Iterate
    changes: Array


class SolvedRound(NamedTuple):
    """State of the loop over solved loads."""

    drive: Array
    at: SearchState
    result: LoadStepResult
    solved: Int[Array, ""]
