"""Robots of a design drawn within their tolerances: which of them meet which limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from notchflex.analysis.uncertainty.draws import sources_of, values_at
from notchflex.designing.model.point import Point
from notchflex.designing.model.quantities import COMPLIANCE, OF_STATES
from notchflex.designing.search.problem import Problem, Vector
from notchflex.designing.search.rows import TOLERANCE, row_reading, row_sizes, rows_of, violations
from notchflex.designing.search.starts import solved
from notchflex.robot.tolerance import Tolerance
from notchflex.robot.varied import VariedRobots
from notchflex.tolerancing.study import TAIL
from notchflex.tolerancing.yields import points_of_each, replicates


def levels_of(
    problem: Problem, tolerances: Sequence[Tolerance], draws: int, seed: int
) -> Float[np.ndarray, "draws d"]:
    """Return levels of everything that deviates, as for a tolerance analysis."""
    sources = sources_of(problem.solver.variables.robot, tolerances)
    return np.concatenate(list(replicates(len(sources), points_of_each(draws), seed)))


def met_by(
    problem: Problem,
    z: Vector,
    tolerances: Sequence[Tolerance],
    levels: Float[np.ndarray, "draws d"],
    numbers: Sequence[int],
) -> Bool[np.ndarray, "draws k"]:
    """Solve robots within tolerances, and tell which meet which constraints.

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
    arrays, converged = solved(solver, robots, [x])
    wishes = [problem.constraints[number] for number in numbers]
    # Robots are made only where something is asked of the robot itself.
    of_states = all(one.asked.quantity in (*OF_STATES, COMPLIANCE) for one in wishes)
    rows = [rows_of(one) for one in wishes]
    met = np.zeros((len(levels), len(wishes)), bool)
    for row, place in enumerate(np.flatnonzero(valid).tolist()):
        if not converged[row]:
            continue
        robot = exact if of_states else robots[row]
        own = {name: values[row] for name, values in arrays.items()}
        point = Point(solver.variables, x, robot, solver.paths, own)
        for k, wish in enumerate(wishes):
            values = row_reading(wish, point).values
            missed = np.abs(violations(rows[k], values, row_sizes(rows[k])))
            met[place, k] = bool((missed <= TOLERANCE).all())  # not where a value is NaN
    return met
