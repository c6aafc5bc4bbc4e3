"""The least value of variables within bounds while rows stay within limits, by SciPy's SLSQP.

At a minimum the gradient of the value is a combination of those of the limits that are reached,
with factors of the right sign: Lagrange's multipliers, which say what a limit costs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import NonlinearConstraint, lsq_linear, minimize

Vector = Float[np.ndarray, " n"]

TOLERANCE = 1e-6
"""A row is at its limit, or within it, up to this part of its size."""

# A limit is reached within this part of its size; of the steepest gradient this part may be left.
_REACHED, _REST, _FLAT = 1e-5, 1e-3, 1e-4
# A slope below this part of its size is none. What the largest violation weighs beside the value,
# and what the value is raised by where there is none, in sizes of its slope.
_NO_SLOPE, _WEIGHT, _PENALTY = 1e-9, 1e3, 1e3
# SLSQP's estimate of the curvature is wrong beyond a kink, such as a notch that closes: it starts
# anew where it ended, while that brings so much.
_GAIN, _PRECISION = 1e-7, 1e-12
# At a kink its line search goes on for long: it ends after so many vectors without a better one.
_PATIENCE = 30


def violation(
    numbers: Float[np.ndarray, " m"],
    limits: Float[np.ndarray, "m 2"],
    sizes: Float[np.ndarray, " m"],
) -> Float[np.ndarray, " m"]:
    """Return by how much numbers are beyond their limits, signed, in their sizes."""
    return (numbers - np.clip(numbers, *limits.T)) / sizes


class Linearisation(NamedTuple):
    """Value and rows at one vector, with their slopes."""

    value: float
    gradient: Float[np.ndarray, " n"]
    rows: Float[np.ndarray, " m"]
    jacobian: Float[np.ndarray, "m n"]
    source: Any = None  # what they were computed from


@dataclass(frozen=True, eq=False)
class NonlinearProgram:
    """A value to minimise over variables within bounds, and rows within limits."""

    evaluate: Callable[[Vector], Linearisation | None]  # None where there is no value
    bounds: Float[np.ndarray, "n 2"]
    limits: Float[np.ndarray, "m 2"]  # equal where a row must have one value
    sizes: Float[np.ndarray, " m"]  # in which violations are measured

    def worst(self, here: Linearisation) -> float:
        """Return the largest violation."""
        return float(np.abs(violation(here.rows, self.limits, self.sizes)).max(initial=0.0))


class SearchMinimum(NamedTuple):
    """Where a search ended."""

    variables: Vector
    reached: Linearisation
    multipliers: Float[np.ndarray, " m+n"]  # of rows, then of variables; of least limits below 0
    active: Bool[np.ndarray, " m+n"]  # which limits are reached
    is_stationary: bool  # whether no small change improves it, to first order


def minimise(program: NonlinearProgram, start: Vector, iterations: int) -> SearchMinimum | None:
    """Search from a start by SLSQP, if it has a value; without iterations it stays there."""
    first = program.evaluate(start)
    if first is None:
        return None
    best, last, stale = (start, first), first, 0
    steepest, size = float(np.linalg.norm(first.gradient)), 1.0 + abs(first.value)
    scale = steepest if steepest > _NO_SLOPE * size else size

    def merit(here: Linearisation) -> float:
        return here.value / scale + _WEIGHT * program.worst(here)

    @lru_cache(maxsize=1)  # SLSQP asks for the parts of one vector one after the other
    def evaluated(key: bytes) -> Linearisation:
        nonlocal best, last, stale, steepest
        variables = np.clip(np.frombuffer(key), *program.bounds.T)
        here = program.evaluate(variables)
        if here is None:  # so large that the step is refused
            return last._replace(value=last.value + _PENALTY * scale)
        last, steepest = here, max(steepest, float(np.linalg.norm(here.gradient)))
        stale += 1
        if merit(here) < merit(best[1]):
            best, stale = (variables, here), 0
        return here

    def stop(_: Vector) -> None:
        if stale > _PATIENCE:
            raise StopIteration

    done, before = 0, np.inf
    while len(start) and done < iterations and merit(best[1]) < before - _GAIN:
        before, stale = merit(best[1]), 0
        done += _descend(program, evaluated, stop, *best, scale, iterations - done)
        if _minimum(program, *best, steepest).is_stationary:
            break
    return _minimum(program, *best, steepest)


def _descend(
    program: NonlinearProgram,
    evaluated: Callable[[bytes], Linearisation],
    stop: Callable[[Vector], None],
    start: Vector,
    first: Linearisation,
    scale: float,
    iterations: int,
) -> int:
    """Run SLSQP from a start, scaled by the slopes there; return its iterations."""
    steepness = np.linalg.norm(first.jacobian, axis=1)
    sizes = np.where(steepness > _NO_SLOPE * program.sizes, steepness, program.sizes)

    def linearised(variables: Vector) -> Linearisation:
        return evaluated(variables.tobytes())

    def constraint(rows: Bool[np.ndarray, " m"]) -> NonlinearConstraint:
        return NonlinearConstraint(
            lambda y: (linearised(y).rows / sizes)[rows],
            *(program.limits.T / sizes)[:, rows],
            jac=lambda y: (linearised(y).jacobian / sizes[:, None])[rows],  # pyright: ignore
        )

    is_equal = program.limits[:, 0] == program.limits[:, 1]
    result = minimize(
        lambda y: linearised(y).value / scale,
        start,
        jac=lambda y: linearised(y).gradient / scale,
        bounds=program.bounds,
        constraints=[constraint(rows) for rows in (is_equal, ~is_equal) if rows.any()],
        method="SLSQP",
        callback=stop,
        options={"maxiter": iterations, "ftol": _PRECISION},
    )
    return int(result.nit)


def _minimum(
    program: NonlinearProgram, variables: Vector, here: Linearisation, steepest: float
) -> SearchMinimum:
    """Return a vector with the multipliers of the limits that it reaches."""
    slopes = np.concatenate([here.jacobian, np.eye(len(variables))])
    numbers = np.concatenate([here.rows, variables])
    low, high = np.concatenate([program.limits, program.bounds]).T
    near = _REACHED * np.append(program.sizes, np.ones(len(variables)))
    at_low, at_high = numbers - low <= near, high - numbers <= near
    active = at_low | at_high
    multipliers = np.zeros(len(numbers))
    if active.any() and len(variables):
        sizes = np.linalg.norm(slopes[active], axis=1)
        sizes = np.where(sizes > 0.0, sizes, 1.0)
        signs = np.where(at_low, -np.inf, 0.0)[active], np.where(at_high, np.inf, 0.0)[active]
        matrix = (slopes[active] / sizes[:, None]).T
        multipliers[active] = lsq_linear(matrix, -here.gradient, signs, method="bvls").x / sizes
    rest = np.linalg.norm(here.gradient + multipliers @ slopes)
    most = _REST * max(float(np.linalg.norm(here.gradient)), _FLAT * steepest)
    settled = program.worst(here) <= TOLERANCE and bool(rest <= most)
    return SearchMinimum(variables, here, multipliers, active, settled)
