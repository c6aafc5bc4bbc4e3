"""Bounded least squares with exact slopes, kinks and linear limits.

Gauss and Newton's method within a box that shrinks after a step that brings nothing and grows
after one that brings what the slopes promise. Residuals are smooth but for kinks, at which slopes
hold for one side only. So slopes are taken anew at every point, and a step that brings nothing
corrects them along it (Broyden 1965, *A Class of Methods for Solving Nonlinear Simultaneous
Equations*).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

Vector = Float[np.ndarray, " n"]

# What a violated limit counts beside the residuals: in a step as a part of the Hessian, and in the
# merit of a point.
_STIFF, _PENALTY = 1e10, 1e4
# Far from a solution slopes hold roughly: directions that move little are left for later by a
# damping of this part of the Hessian.
_DAMPING = 0.01
# A step is accepted with this part of what the slopes promise; with the second part the next one
# may be longer by the third number, and without the first it is shorter by the fourth.
_MIN_GAIN, _GOOD_GAIN, _LONGER, _SHORTER = 1e-3, 0.5, 2.0, 0.5
# A search has settled where slopes promise less than this part of the squared residuals, where
# steps are this part of the variables, or where this number of solves leaves more than this part of
# the squared residuals.
_FLAT, _NO_STEP, _PATIENCE, _SLOW = 1e-9, 1e-11, 12, 1.0 - 1e-3
# Weight of the variables that makes them small where the residuals leave them open.
_SMALL = 1e-10
# They are small enough when a step would change them, or has shortened them, by these parts; a step
# is corrected by at most this number of solves.
_SMALL_CHANGE, _LESS, _CORRECTIONS = 1e-3, 1e-4, 5

KEPT = 1e-7
"""Limits count as kept within this part of them."""


def bounded_step(
    hessian: Float[np.ndarray, "n n"],
    gradient: Vector,
    low: Vector,
    high: Vector,
    limits: Float[np.ndarray, "c n"],
    room: Float[np.ndarray, " c"],
) -> Vector:
    r"""Minimise $d^T H d / 2 + g^T d$ where $l \le d \le h$ and $C d \le b$, with $l \le 0 \le h$.

    The problem is turned into one of least distance and that into non-negative least squares
    (Lawson and Hanson 1974, *Solving Least Squares Problems*, ch. 23). Limits C that contradict
    each other are violated as little as possible.
    """
    count = len(gradient)
    free = -gradient / hessian[0] if count == 1 else -np.linalg.solve(hessian, gradient)
    bounded = np.minimum(np.maximum(free, low), high)
    inside = count == 1 or bool((bounded == free).all())
    if inside and (not room.size or (limits @ bounded <= room).all()):
        return bounded
    # The inverse of the factor maps to variables in which the Hessian is the identity.
    inverse = np.linalg.inv(np.linalg.cholesky(hessian))
    normals = np.concatenate([np.eye(count), -np.eye(count), limits])
    excess = np.concatenate([free - high, low - free, limits @ free - room])
    columns = -inverse @ normals.T
    if room.size:  # every limit C has a slack of its own, which is stiff
        slack = np.zeros((len(room), len(normals)))
        slack[:, 2 * count :] = np.eye(len(room)) / math.sqrt(_STIFF * np.trace(hessian))
        columns = np.concatenate([columns, slack])
    size = np.sqrt((columns**2).sum(axis=0))
    scale = float(np.abs(excess / size).max())
    rows = np.concatenate([columns, excess[None] / scale]) / size
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    left = goal - rows @ nnls(rows, goal)[0]
    nearest = -scale * left[:count] / max(left[-1], 1e-14)
    return np.minimum(np.maximum(free + inverse.T @ nearest, low), high)


@dataclass(eq=False, slots=True)
class SearchPoint:
    """Residuals and limits at some variables, with their slopes; n variables.

    Attributes:
        variables: The variables, (n,).
        residuals: What shall be zero, (m,).
        slopes: Slopes of the residuals, (m, n).
        limits: Slopes of limited quantities, (c, n).
        room: How far each of these is from its limit, negative beyond, (c,).
        solution: What was solved there.
        accepted: Size up to which the residuals may grow on the way here, across a plateau.
        error: Size of the residuals.
        merit: Squared residuals and a penalty of violated limits.
    """

    variables: Vector
    residuals: Float[np.ndarray, " m"]
    slopes: Float[np.ndarray, "m n"]
    limits: Float[np.ndarray, "c n"]
    room: Float[np.ndarray, " c"]
    solution: Any
    accepted: float = 0.0
    error: float = field(init=False)
    merit: float = field(init=False)

    def __post_init__(self) -> None:
        """Measure the residuals."""
        self.error = math.sqrt(float(self.residuals @ self.residuals))
        self.merit = _merit(self.residuals, self.room)

    @property
    def excess(self) -> float:
        """Largest violation of a limit; 0 where all are kept."""
        return max(0.0, -float(self.room.min())) if self.room.size else 0.0

    def promised(self, step: Vector) -> float:
        """Return the merit that the slopes promise after a step."""
        return _merit(self.residuals + self.slopes @ step, self.room - self.limits @ step)

    def corrected(self, trial: SearchPoint) -> SearchPoint:
        """Return the point with slopes that agree with another one."""
        step = trial.variables - self.variables
        along = step / float(step @ step)
        missing = trial.residuals - self.residuals - self.slopes @ step
        room = self.room - trial.room - self.limits @ step
        return replace(
            self,
            slopes=self.slopes + np.multiply.outer(missing, along),
            limits=self.limits + np.multiply.outer(room, along),
        )


def _merit(residuals: Float[np.ndarray, " m"], room: Float[np.ndarray, " c"]) -> float:
    merit = float(residuals @ residuals)
    if room.size:
        broken = np.minimum(room, 0.0)
        merit += _PENALTY * float(broken @ broken)
    return merit


class SearchEnd(NamedTuple):
    """End of a search.

    Attributes:
        point: The best point.
        solves: How many points were solved.
        met: Whether residuals and limits are met there.
        settled: Whether no step brings more; otherwise the budget was spent.
    """

    point: SearchPoint
    solves: int
    met: bool
    settled: bool


@dataclass(eq=False)
class BoundedLeastSquares:
    """A bounded least-squares problem.

    Attributes:
        move: Returns the point after a step from another one, that point itself where the step
            changes nothing, and None where there is no solution.
        low: Lowest variables, (n,).
        high: Highest variables, (n,).
        tolerance: Size of the residuals that is small enough.
        reach: Least size of the variables; no step is larger than they are.
        small: Whether variables that the residuals leave open are made small; otherwise they stay.
        weak: Weight of a step, for variables that change no residual.
    """

    move: Callable[[SearchPoint, Vector], SearchPoint | None]
    low: Vector
    high: Vector
    tolerance: float
    reach: float
    small: bool = False
    weak: float = 0.0

    def step(self, point: SearchPoint, radius: float = np.inf) -> Vector:
        """Return the step that the slopes of a point suggest, of no more than a radius."""
        slopes, variables = point.slopes, point.variables
        hessian = slopes.T @ slopes
        size = float(np.vdot(slopes, slopes)) / len(variables)
        if size == 0.0:
            return np.zeros_like(variables)
        reach = self.size(variables)
        least = _SMALL * size + self.weak**2
        if len(variables) > 1:
            least += _DAMPING * size * min(point.error / (math.sqrt(size) * reach), 1.0)
        hessian.flat[:: len(variables) + 1] += least
        gradient = slopes.T @ point.residuals
        if self.small:
            gradient += _SMALL * size * variables
        radius = min(reach, radius)
        low = np.maximum(self.low - variables, -radius)
        high = np.minimum(self.high - variables, radius)
        return bounded_step(hessian, gradient, low, high, point.limits, point.room)

    def size(self, variables: Vector) -> float:
        """Return the size of some variables, and of the largest step from them."""
        return max(float(np.abs(variables).max()), self.reach)

    def is_met(self, point: SearchPoint) -> bool:
        """Return whether residuals and limits are met."""
        return point.error <= self.tolerance and point.excess <= KEPT

    def search(self, point: SearchPoint, budget: int) -> SearchEnd:
        """Search from a point, with at most a number of solves."""
        best, radius, solves, settled = point, np.inf, 0, False
        mark, before = _PATIENCE, point.merit
        while not (settled or self.is_met(point)) and solves < budget:
            step = self.step(point, radius)
            promised = point.merit - point.promised(step)
            length = float(np.abs(step).max())
            moves = promised > _FLAT * point.merit and length > _NO_STEP * self.reach
            trial = self.move(point, step) if moves else point
            if trial is point:
                settled = True
                break
            solves += 1
            gain = -1.0
            if trial is not None:
                gain = (point.merit - trial.merit) / promised
                if self.is_met(trial) or trial.error <= trial.accepted:
                    gain = max(gain, _MIN_GAIN)
            if trial is None or gain < _MIN_GAIN:
                radius = _SHORTER * length
                point = point if trial is None else point.corrected(trial)
            else:
                radius = max(radius, _LONGER * length) if gain >= _GOOD_GAIN else radius
                point = trial
                # On a plateau the farther one is nearer to its end.
                best = trial if trial.merit <= best.merit * (1.0 + 1e-9) else best
            if solves >= mark:
                settled = best.merit > _SLOW * before
                mark, before = solves + _PATIENCE, best.merit
        if not self.is_met(point):
            return SearchEnd(best, solves, False, settled)
        if self.small:
            point, more = self._smallest(point, budget - solves)
            solves += more
        return SearchEnd(point, solves, True, settled)

    def _smallest(self, point: SearchPoint, budget: int) -> tuple[SearchPoint, int]:
        """Make open variables small while the residuals stay met."""
        solves, correcting = 0, replace(self, small=False)
        while solves < budget:
            step = self.step(point)
            size = self.size(point.variables)
            trial = self.move(point, step) if np.abs(step).max() > _SMALL_CHANGE * size else None
            if trial is None or trial is point:
                break
            end = correcting.search(trial, min(_CORRECTIONS, budget - solves))
            solves += 1 + end.solves
            lengths = [float(np.linalg.norm(one.variables)) for one in (end.point, point)]
            if not end.met or lengths[0] > (1.0 - _LESS) * lengths[1]:
                break
            point = end.point
        return point, solves
