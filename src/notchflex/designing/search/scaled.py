"""A problem in the form that SciPy's searches take: one vector, scaled sums and rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Vector

# Value of the sum without a valid robot or an equilibrium, in sizes of the sum.
_PENALTY = 1e3


@dataclass
class ScaledDerivatives:
    """Derivatives of the sum and of the rows, "eq" (= 0) and "ineq" (>= 0)."""

    gradient: Vector
    rows: dict[str, np.ndarray]


@dataclass(eq=False)
class Scaled:
    """A problem for searches, scaled where it begins.

    Attributes:
        problem: The problem.
        first: The robot where the search begins, with derivatives.
        start: Where that is.
        best: The best robot met so far, and its vector.
        linear: Where derivatives were asked last, and what they are.
    """

    problem: DesignProblem
    first: DesignEvaluation
    start: Vector
    best: tuple[Vector, DesignEvaluation] | None = None
    linear: tuple[bytes, ScaledDerivatives] | None = None

    def __post_init__(self) -> None:
        """Find the sizes of sum and rows."""
        span = self.problem.solver.variables.span
        first = self.first
        assert first.objective.slopes is not None
        assert first.rows.slopes is not None
        by = np.linalg.norm(first.objective.slopes[0] * span)
        for bound, reading in zip(self.problem.bounds, first.bounded, strict=True):
            assert reading.slopes is not None
            by += abs(bound.factor) * np.linalg.norm(reading.slopes * span, axis=1).max()
        self.size = float(by) if by > 1e-9 * (1.0 + abs(first.total)) else 1.0 + abs(first.total)
        sizes = np.linalg.norm(first.rows.slopes * span, axis=1)
        self.row_size = np.where(sizes > 1e-9 * self.problem.sizes, sizes, self.problem.sizes)
        self.bound_size = np.array([np.ptp(r.values) or 1.0 for r in first.bounded])
        self.bound_zero = np.array(
            [
                reading.values.max() if bound.side == "above" else reading.values.min()
                for bound, reading in zip(self.problem.bounds, first.bounded, strict=True)
            ]
        )
        self.linear = self.y.tobytes(), self._derivatives(first)
        self._good = self._value(self.y, first), self._rows(self.y, first)

    @property
    def y(self) -> Vector:
        """Start of the search."""
        return np.concatenate([self.start, np.zeros(len(self.problem.bounds))])

    @property
    def limits(self) -> list[tuple[float | None, float | None]]:
        """Limits of the vector."""
        free: list[tuple[float | None, float | None]] = [(None, None)] * len(self.problem.bounds)
        return [*((0.0, 1.0) for _ in range(self.problem.count)), *free]

    def evaluation(self, y: Vector) -> DesignEvaluation | None:
        """Return the robot at a vector, perhaps without derivatives."""
        evaluation = self.problem.evaluate(y)
        if evaluation is not None and self._is_better(evaluation):
            self.best = y[: self.problem.count].copy(), evaluation
        return evaluation

    def value(self, y: Vector) -> float:
        """Return the sum; far above all others where there is no robot."""
        evaluation = self.evaluation(y)
        return self._good[0] + _PENALTY if evaluation is None else self._value(y, evaluation)

    def rows(self, y: Vector, kind: str) -> np.ndarray:
        """Return the numbers of the equalities ("eq") or inequalities ("ineq")."""
        evaluation = self.evaluation(y)
        return self._good[1][kind] if evaluation is None else self._rows(y, evaluation)[kind]

    def gradient(self, y: Vector) -> Vector:
        """Return the derivatives of the sum."""
        return self._linear(y).gradient

    def jacobian(self, y: Vector, kind: str) -> np.ndarray:
        """Return the derivatives of the rows."""
        return self._linear(y).rows[kind]

    def _linear(self, y: Vector) -> ScaledDerivatives:
        key = y.tobytes()
        if self.linear is None or self.linear[0] != key:
            evaluation = self.evaluation(y)
            full = None if evaluation is None else self.problem.with_slopes(evaluation, y)
            if full is None:
                assert self.linear is not None
                return self.linear[1]
            if self.best is not None and self.best[1].point is full.point:
                self.best = self.best[0], full
            self.linear = key, self._derivatives(full)
            self._good = self._value(y, full), self._rows(y, full)
        return self.linear[1]

    def _is_better(self, candidate: DesignEvaluation) -> bool:
        if self.best is None:
            return True
        return is_better(self.problem, candidate, self.best[1])

    def _slack(self, y: Vector) -> Vector:
        return self.bound_zero + self.bound_size * y[self.problem.count :]

    def _value(self, y: Vector, one: DesignEvaluation) -> float:
        factors = np.array([bound.factor for bound in self.problem.bounds])
        return float(one.objective.values.sum() + factors @ self._slack(y)) / self.size

    def _rows(self, y: Vector, one: DesignEvaluation) -> dict[str, np.ndarray]:
        low, high, same = self._row_limits
        numbers, slack = one.rows.values, self._slack(y)
        least: list[np.ndarray] = []
        for side, limit in ((1.0, low), (-1.0, high)):
            is_limited = np.isfinite(limit) & ~same
            least.append(
                side * (numbers[is_limited] - limit[is_limited]) / self.row_size[is_limited]
            )
        for k, (bound, reading) in enumerate(zip(self.problem.bounds, one.bounded, strict=True)):
            least.append(bound.sign * (slack[k] - reading.values) / self.bound_size[k])
        equal = (numbers[same] - low[same]) / self.row_size[same]
        return {"eq": equal, "ineq": np.concatenate([np.zeros(0), *least])}

    def _derivatives(self, one: DesignEvaluation) -> ScaledDerivatives:
        bounds, span = self.problem.bounds, self.problem.solver.variables.span
        assert one.objective.slopes is not None
        assert one.rows.slopes is not None
        factors = np.array([bound.factor for bound in bounds])
        by = [one.objective.slopes[0] * span, factors * self.bound_size]
        rows = one.rows.slopes * span / self.row_size[:, None]
        rows = np.concatenate([rows, np.zeros((len(rows), len(bounds)))], axis=1)
        low, high, same = self._row_limits
        sides = ((1.0, low), (-1.0, high))
        least = [side * rows[np.isfinite(limit) & ~same] for side, limit in sides]
        for k, (bound, reading) in enumerate(zip(bounds, one.bounded, strict=True)):
            assert reading.slopes is not None
            own = np.zeros((len(reading.values), len(bounds)))
            own[:, k] = bound.sign
            by_z = -bound.sign * reading.slopes * span / self.bound_size[k]
            least.append(np.concatenate([by_z, own], axis=1))
        none = np.zeros((0, rows.shape[1]))
        gradient = np.concatenate(by) / self.size
        return ScaledDerivatives(
            gradient, {"eq": rows[same], "ineq": np.concatenate([none, *least])}
        )

    @property
    def _row_limits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = self.problem.rows
        low = np.array([one.lower for one in rows])
        high = np.array([one.upper for one in rows])
        return low, high, low == high

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """The rows as SciPy takes them."""
        first = self._rows(self.y, self.first)
        return [
            {
                "type": kind,
                "fun": partial(self.rows, kind=kind),
                "jac": partial(self.jacobian, kind=kind),
            }
            for kind, numbers in first.items()
            if len(numbers)
        ]


def is_better(problem: DesignProblem, one: DesignEvaluation, other: DesignEvaluation) -> bool:
    """Return whether a robot is better: nearer to all limits, or as near and with less."""
    from notchflex.designing.search.rows import TOLERANCE

    a, b = problem.worst(one), problem.worst(other)
    if max(a, b) <= TOLERANCE:
        return one.total < other.total
    return a < b
