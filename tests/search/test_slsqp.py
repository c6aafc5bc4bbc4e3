"""The driver of SLSQP: known minima with known multipliers, kinks, and where there is no value."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex.pieces import sobol_points
from notchflex.search.slsqp import Linearisation, NonlinearProgram, minimise
from notchflex.search.starts import spread_out


def hock_schittkowski_71(x: np.ndarray) -> Linearisation:
    """W. Hock and K. Schittkowski, Test Examples for Nonlinear Programming Codes (1981), no. 71."""
    a, b, c, d = x
    value = a * d * (a + b + c) + c
    gradient = np.array([d * (2.0 * a + b + c), a * d, a * d + 1.0, a * (a + b + c)])
    rows = np.array([a * b * c * d, float(x @ x)])
    jacobian = np.array([[b * c * d, a * c * d, a * b * d, a * b * c], 2.0 * x])
    return Linearisation(value, gradient, rows, jacobian)


LIMITS = np.array([[25.0, np.inf], [40.0, 40.0]])
BOUNDS = np.tile([1.0, 5.0], (4, 1))
PROGRAM = NonlinearProgram(hock_schittkowski_71, BOUNDS, LIMITS, np.array([25.0, 40.0]))


@pytest.mark.parametrize(
    "start", [(1.0, 5.0, 5.0, 1.0), (2.0, 2.0, 2.0, 2.0), (4.0, 1.0, 3.0, 2.0)]
)
def test_a_known_minimum_with_its_multipliers(start):
    found = minimise(PROGRAM, np.array(start), 100)
    assert found is not None
    assert found.is_stationary
    assert found.reached.value == pytest.approx(17.0140173, abs=1e-7)
    assert found.variables == pytest.approx([1.0, 4.7429994, 3.8211503, 1.3794082], abs=1e-6)
    assert found.active.tolist() == [True, True, True, False, False, False]
    # What the limits cost, by minima with other limits.
    for row, side in ((0, slice(0, 1)), (1, slice(0, 2))):
        values: list[float] = []
        for step in (-0.01, 0.01):
            limits = LIMITS.copy()
            limits[row, side] += step
            moved = minimise(
                NonlinearProgram(hock_schittkowski_71, BOUNDS, limits, PROGRAM.sizes),
                found.variables,
                100,
            )
            assert moved is not None
            values.append(moved.reached.value)
        slope = (values[1] - values[0]) / 0.02
        assert -found.multipliers[row] == pytest.approx(slope, rel=1e-3)


def test_limits_that_contradict_each_other_are_not_met():
    limits = np.array([[25.0, np.inf], [3.0, 3.0]])  # the sum of four squares is 4 or more
    program = NonlinearProgram(hock_schittkowski_71, BOUNDS, limits, np.array([25.0, 3.0]))
    found = minimise(program, np.full(4, 2.0), 100)
    assert found is not None
    assert not found.is_stationary
    assert program.worst(found.reached) > 0.3


def test_where_there_is_no_value_a_step_is_refused():
    def evaluate(x: np.ndarray) -> Linearisation | None:
        return (
            None if x[0] < 1.5 else Linearisation(x[0] ** 2, 2.0 * x, np.zeros(0), np.zeros((0, 1)))
        )

    program = NonlinearProgram(evaluate, np.array([[0.0, 5.0]]), np.zeros((0, 2)), np.zeros(0))
    found = minimise(program, np.array([4.0]), 50)
    assert found is not None
    assert 1.5 <= found.variables[0] < 4.0
    assert not found.is_stationary
    assert minimise(program, np.array([1.0]), 50) is None


def test_starts_are_far_from_each_other():
    points = sobol_points(2, 0, 0, 64, 64)
    assert points.shape == (64, 2)
    chosen = spread_out([*points], 5)
    assert chosen[0] == 0
    far = [np.linalg.norm(points[a] - points[b]) for a in chosen for b in chosen if a != b]
    assert min(far) >= 0.1
    assert spread_out([points[0]] * 3, 2) == [0, 1]
