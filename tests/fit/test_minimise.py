"""The search for a minimum: limits, kinks of the objective, places without a solution."""

import numpy as np
import pytest

from notchflex.fit import Cost
from notchflex.fit.search import minimise

WIDE = (np.full(2, -np.inf), np.full(2, np.inf))


def rosenbrock(at):
    """Rosenbrock's valley as a sum of two squares; least 0 at (1, 1)."""
    residual = np.array([10.0 * (at[1] - at[0] ** 2), 1.0 - at[0]])
    slopes = np.array([[-20.0 * at[0], 10.0], [-1.0, 0.0]])
    return Cost(0.5 * residual @ residual, slopes.T @ residual, slopes.T @ slopes)


def test_a_curved_valley_is_followed():
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), *WIDE)
    assert found.converged
    np.testing.assert_allclose(found.values, 1.0, atol=1e-6)


def test_a_limit_is_kept_and_the_other_value_makes_the_best_of_it():
    upper = np.array([0.5, np.inf])
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), WIDE[0], upper)
    assert found.converged
    np.testing.assert_allclose(found.values, [0.5, 0.25], atol=1e-6)


def test_where_there_is_no_solution_counts_as_too_high():
    def bounded(at):
        return None if at[0] > 0.8 else rosenbrock(at)

    found = minimise(bounded, np.array([-1.2, 1.0]), *WIDE)
    assert found.values[0] <= 0.8
    assert found.cost.value == pytest.approx(0.5 * 0.2**2, rel=0.05)


def test_no_solution_at_the_start_is_told():
    found = minimise(lambda _: None, np.zeros(2), *WIDE)
    assert not found.converged
    assert found.cost is None
    assert "start" in found.reason


def test_a_value_that_nothing_depends_on_stays():
    def flat(at):
        return Cost(0.5 * (at[0] - 2.0) ** 2, np.array([at[0] - 2.0, 0.0]), np.diag([1.0, 0.0]))

    found = minimise(flat, np.array([0.0, 7.0]), *WIDE)
    assert found.converged
    np.testing.assert_allclose(found.values, [2.0, 7.0], atol=1e-5)


def test_equal_limits_hold_a_value():
    lower, upper = np.array([0.5, -np.inf]), np.array([0.5, np.inf])
    found = minimise(rosenbrock, np.array([0.5, 1.0]), lower, upper)
    assert found.converged
    np.testing.assert_allclose(found.values, [0.5, 0.25], atol=1e-6)
    assert found.values[0] == 0.5
    both = np.array([0.5, 1.0])
    held = minimise(rosenbrock, both, both, both)
    assert held.converged
    assert held.calls == 1
    assert held.cost.value == rosenbrock(both).value
