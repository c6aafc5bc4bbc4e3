"""Robots of a design drawn within their tolerances: which of them meet which limits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from notchflex.analysis.closing_loads.varied import closing_tensions_of
from notchflex.analysis.uncertainty.draws import sources_of, values_at
from notchflex.analysis.varied.fit_polynomial import PolynomialAccuracy, fit_polynomial
from notchflex.designing.model.point import CLOSINGS, Point
from notchflex.designing.model.quantities import CLOSING
from notchflex.designing.model.solver import Solver
from notchflex.designing.model.wishes import Wish
from notchflex.designing.search.problem import DesignProblem, Vector
from notchflex.designing.search.rows import TOLERANCE, row_reading, row_sizes, rows_of, violations
from notchflex.designing.search.starts import solved
from notchflex.robot import Robot
from notchflex.robot.tolerance import Tolerance
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.tolerancing.study import TAIL
from notchflex.tolerancing.yields import points_of_each, replicates

# Error of polynomials in place of robots, in standard deviations, and robots where it is measured.
_ERROR, _CHECKS = 0.01, 12


def levels_of(
    problem: DesignProblem, tolerances: Sequence[Tolerance], draws: int, seed: int
) -> Float[np.ndarray, "draws d"]:
    """Return levels of everything that deviates, as for a tolerance analysis."""
    sources = sources_of(problem.solver.variables.robot, tolerances)
    return np.concatenate(list(replicates(len(sources), points_of_each(draws), seed)))


def met_by(
    problem: DesignProblem,
    z: Vector,
    tolerances: Sequence[Tolerance],
    levels: Float[np.ndarray, "draws d"],
    numbers: Sequence[int],
) -> Bool[np.ndarray, "draws k"]:
    """Solve robots within tolerances, and return which meet which constraints.

    Args:
        problem: The problem.
        z: The scaled variables of the robot of the drawing.
        tolerances: What deviates.
        levels: Levels of what deviates, each between 0 and 1.
        numbers: Numbers of the constraints.

    Returns:
        Whether each robot meets each of these constraints; no robot that cannot be made or solved
        meets any.
    """
    solver, x = problem.solver, problem.x(z)
    exact = solver.variables.robot_at(x).replace(tolerance=None)
    sources = sources_of(exact, tolerances)
    drawn = VariedRobots(exact, values_at(sources, np.clip(levels, TAIL, 1.0 - TAIL)))
    valid = drawn.valid()
    robots = drawn.take(valid)
    met = np.zeros((len(levels), len(numbers)), bool)
    every = [(k, problem.constraints[number]) for k, number in enumerate(numbers)]
    of_states = [one for one in every if _depends_on_states(one[1])]
    if of_states:
        arrays, converged = solved(solver, robots, [x])
        with_curves = any(one.curve is not None for _, one in of_states)

        def at(row: int) -> Point:
            own = {name: values[row] for name, values in arrays.items()}
            robot = robots[row] if with_curves else exact  # of which nothing else is asked
            return Point(solver.variables, x, robot, solver.paths, own)

        points = (at(row) for row in np.flatnonzero(converged).tolist())
        rows = _rows([one for _, one in of_states], points)
        for column, (k, _) in enumerate(of_states):
            met[np.flatnonzero(valid)[converged], k] = rows[:, column]
        valid[valid] = converged
    robots = drawn.take(valid)
    closings = [one for one in every if one[1].asked.quantity == CLOSING]
    others = [one for one in every if one not in of_states and one not in closings]
    for part, reader in ((closings, _of_closings), (others, _of_robots)):
        if part:
            rows = reader([one for _, one in part], solver, x, robots)
            met[np.ix_(np.flatnonzero(valid), np.array([k for k, _ in part]))] = rows
    return met


def _of_closings(
    wishes: Sequence[Wish], solver: Solver, x: Vector, robots: VariedRobots
) -> Bool[np.ndarray, "robots k"]:
    """Tell which robots meet constraints of closing tensions."""
    if not len(robots):
        return np.zeros((0, len(wishes)), bool)

    def at(tensions: Float[np.ndarray, " n"]) -> Point:
        overrides = {CLOSINGS: tensions}
        return Point(solver.variables, x, robots.robot, solver.paths, {}, kept=overrides)

    return _rows(wishes, map(at, closing_tensions_of(robots)))


def _depends_on_states(wish: Wish) -> bool:
    return wish.asked.state is not None or wish.curve is not None


def _of_robots(
    wishes: Sequence[Wish], solver: Solver, x: Vector, robots: VariedRobots
) -> Bool[np.ndarray, "robots k"]:
    """Tell which robots meet other constraints that need no state.

    By a polynomial where there is one, as assembling a robot takes long.
    """

    def values_of(robot: Robot) -> Float[np.ndarray, " m"]:
        point = Point(solver.variables, x, robot, solver.paths, {})
        return np.concatenate([row_reading(one, point).values for one in wishes])

    if not len(robots):
        return np.zeros((0, len(wishes)), bool)
    table = robots.table
    low, high = table.min(axis=0), table.max(axis=0)
    half = np.maximum(0.5 * (high - low), 1e-9 * np.maximum(np.abs(high), 1e-3))
    checks = table[np.linspace(0, len(table) - 1, _CHECKS).astype(int)]

    def at(numbers: Float[np.ndarray, " d"]) -> Float[np.ndarray, " m"]:
        return values_of(robots.at(dict(zip(robots.names, numbers, strict=True))))

    exact = np.stack([at(one) for one in checks])
    spread = np.maximum(exact.std(axis=0), 1e-9 * np.abs(exact).max(axis=0) + 1e-300)
    polynomial = fit_polynomial(
        at,
        0.5 * (low + high) - half,
        0.5 * (low + high) + half,
        [list(range(len(low)))],
        lambda _: spread,
        [np.arange(len(spread))],
        accuracies=[PolynomialAccuracy(_ERROR, len(table) // 3)],
        checks=checks,
    )
    if polynomial is None:
        values = np.stack([values_of(robots[row]) for row in range(len(robots))])
    else:
        values = np.tile(polynomial.base, (len(robots), 1))
        values[:, polynomial.entries] = polynomial.varied(table).T
    return _met(wishes, values)


def _rows(wishes: Sequence[Wish], points: Iterable[Point]) -> Bool[np.ndarray, "robots k"]:
    """Tell which solved robots meet constraints."""
    values = [np.concatenate([row_reading(one, at).values for one in wishes]) for at in points]
    count = sum(len(rows_of(one)) for one in wishes)
    return _met(wishes, np.reshape(values, (len(values), count)))


def _met(
    wishes: Sequence[Wish], values: Float[np.ndarray, "robots m"]
) -> Bool[np.ndarray, "robots k"]:
    """Tell for which robots the numbers of constraints, one after the other, are within limits."""
    met: list[np.ndarray] = []
    start = 0
    for one in wishes:
        rows = rows_of(one)
        own = values[:, start : start + len(rows)]
        violation = np.abs(violations(rows, own, row_sizes(rows)))
        met.append(np.all(violation <= TOLERANCE, axis=1))  # not where a value is NaN
        start += len(rows)
    return np.stack(met, axis=1)
