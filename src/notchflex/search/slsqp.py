"""The least value of variables within bounds while rows stay within limits, by SciPy's SLSQP.

At a minimum the gradient of the value is a combination of those of the limits that are reached,
with factors of the right sign: Lagrange's multipliers, which say what a limit costs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import NonlinearConstraint, lsq_linear, minimize

Vector = Float[np.ndarray, " n"]

TOLERANCE = 1e-6
"""A row is at its limit, or within it, up to this part of its size."""

# A limit is reached within this part of its size; of the steepest gradient this part may be left.
_REACHED, _REST, _FLAT = 1e-5, 1e-3, 1e-4
# SLSQP's estimate of the curvature is wrong beyond a kink, such as a notch that closes: it starts
# anew where it ended, while that lowers the value or the violation.
_GAIN, _PRECISION, _PATIENCE = 1e-7, 1e-12, 10
# A slope below this part of its size is none. What the value is raised by where there is none, and
# what may be left of it at the end, in sizes of its slope.
_NO_SLOPE, _PENALTY, _LEFT = 1e-9, 1e3, 1e-5


class Linearisation(NamedTuple):
    """Value and rows at one vector, with their slopes."""

    value: float
    gradient: Float[np.ndarray, " n"]
    rows: Float[np.ndarray, " m"]
    jacobian: Float[np.ndarray, "m n"]
    source: Any = None  # what they were computed from


@dataclass(frozen=True, eq=False)
class Program:
    """A value to minimise over variables within bounds, and rows within limits."""

    evaluate: Callable[[Vector], Linearisation | None]  # None where there is no value
    bounds: Float[np.ndarray, "n 2"]
    limits: Float[np.ndarray, "m 2"]  # equal where a row must have one value
    sizes: Float[np.ndarray, " m"]  # in which violations are measured

    def violation(self, rows: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """Return by how much rows are beyond their limits, signed, in their sizes."""
        return (rows - np.clip(rows, *self.limits.T)) / self.sizes

    def worst(self, here: Linearisation) -> float:
        """Return the largest violation."""
        return float(np.abs(self.violation(here.rows)).max(initial=0.0))


class Minimum(NamedTuple):
    """Where a search ended."""

    variables: Vector
    reached: Linearisation
    multipliers: Float[np.ndarray, " m+n"]  # of rows, then of variables; of least limits below 0
    active: Bool[np.ndarray, " m+n"]  # which limits are reached
    is_stationary: bool  # whether no small change improves it, to first order


@dataclass(eq=False)
class _Search:
    """What a search has met so far."""

    program: Program
    variables: Vector  # of the best
    best: Linearisation
    steepest: float = 0.0  # the largest gradient
    last: tuple[bytes, Linearisation | None] = (b"", None)

    def evaluate(self, variables: Vector) -> Linearisation | None:
        """Evaluate a vector; SLSQP asks for the parts of one vector one after the other."""
        variables = np.clip(variables, *self.program.bounds.T)
        if self.last[0] != variables.tobytes():
            here = self.program.evaluate(variables)
            self.last = variables.tobytes(), here
            if here is not None:
                self.steepest = max(self.steepest, float(np.linalg.norm(here.gradient)))
                if self._is_better(here):
                    self.variables, self.best = variables, here
        return self.last[1]

    def _is_better(self, here: Linearisation) -> bool:
        worst, best_worst = self.program.worst(here), self.program.worst(self.best)
        if max(worst, best_worst) <= TOLERANCE:
            return here.value < self.best.value
        return worst < best_worst

    def descend(self, iterations: int) -> int:
        """Run SLSQP from the best vector, scaled by the slopes there; return its iterations."""
        program, first, known = self.program, self.best, self.best
        steepness, size = float(np.linalg.norm(first.gradient)), 1.0 + abs(first.value)
        scale = steepness if steepness > _NO_SLOPE * size else size
        by_row = np.linalg.norm(first.jacobian, axis=1)
        by_row = np.where(by_row > _NO_SLOPE * program.sizes, by_row, program.sizes)

        def at(variables: Vector) -> Linearisation:
            nonlocal known
            here = self.evaluate(variables)
            known = known if here is None else here
            # Where there is no value it is so large that the step is refused.
            return known if here else known._replace(value=known.value + _PENALTY * scale)

        def constraint(rows: Bool[np.ndarray, " m"]) -> NonlinearConstraint:
            sizes = by_row[rows]
            return NonlinearConstraint(
                lambda y: at(y).rows[rows] / sizes,
                *(program.limits[rows].T / sizes),
                jac=lambda y: at(y).jacobian[rows] / sizes[:, None],
            )

        stale, seen = 0, self.best

        def watch(_: Vector) -> None:
            nonlocal stale, seen
            stale, seen = (stale + 1 if self.best is seen else 0), self.best
            if stale == _PATIENCE:
                raise StopIteration

        is_equal = program.limits[:, 0] == program.limits[:, 1]
        found = minimize(
            lambda y: at(y).value / scale,
            self.variables,
            jac=lambda y: at(y).gradient / scale,
            bounds=program.bounds,
            constraints=[constraint(rows) for rows in (is_equal, ~is_equal) if rows.any()],
            method="SLSQP",
            callback=watch,
            options={"maxiter": max(iterations, 1), "ftol": _PRECISION},
        )
        # The end keeps limits exactly; others may have been better by what the tolerance leaves.
        end, variables = self.evaluate(found.x), np.clip(found.x, *program.bounds.T)
        if found.success and end is not None and program.worst(end) <= TOLERANCE:
            if end.value - self.best.value <= _LEFT * scale:
                self.variables, self.best = variables, end
        return int(found.nit)

    def minimum(self) -> Minimum:
        """Return the best vector, with the multipliers of its limits."""
        program, here = self.program, self.best
        slopes = np.concatenate([here.jacobian, np.eye(len(self.variables))])
        numbers = np.concatenate([here.rows, self.variables])
        low, high = np.concatenate([program.limits, program.bounds]).T
        near = _REACHED * np.concatenate([program.sizes, np.ones(len(self.variables))])
        at_low, at_high = numbers - low <= near, high - numbers <= near
        active = at_low | at_high
        sizes = np.linalg.norm(slopes, axis=1)
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        multipliers = np.zeros(len(numbers))
        if active.any():
            signs = np.where(at_low, -np.inf, 0.0)[active], np.where(at_high, np.inf, 0.0)[active]
            matrix = (slopes[active] / sizes[active, None]).T
            fitted = lsq_linear(matrix, -here.gradient, signs, method="bvls")
            multipliers[active] = fitted.x / sizes[active]
        rest = float(np.linalg.norm(here.gradient + multipliers @ slopes))
        steepest = max(float(np.linalg.norm(here.gradient)), _FLAT * self.steepest)
        settled = program.worst(here) <= TOLERANCE and rest <= _REST * steepest
        return Minimum(self.variables, here, multipliers, active, settled)


def minimise(program: Program, start: Vector, iterations: int) -> Minimum | None:
    """Search from a start by SLSQP; None where it has no value. Without iterations it stays there."""
    first = program.evaluate(start)
    if first is None:
        return None
    search = _Search(program, start, first, float(np.linalg.norm(first.gradient)))
    found, done, gains = search.minimum(), 0, True
    while gains and done < iterations and not found.is_stationary:
        done += search.descend(iterations - done)
        before, found = found, search.minimum()
        gains = _gained(program, before.reached, found.reached)
    return found


def _gained(program: Program, before: Linearisation, after: Linearisation) -> bool:
    if program.worst(before) > TOLERANCE:
        return program.worst(after) < 0.9 * program.worst(before)
    return before.value - after.value > _GAIN * abs(before.value)
