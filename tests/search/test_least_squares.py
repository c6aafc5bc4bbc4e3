"""Bounded least squares against scipy, and at kinks."""

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize

from notchflex.search.least_squares import BoundedLeastSquares, SearchPoint, bounded_step


@pytest.mark.parametrize("seed", range(12))
def test_step_is_the_constrained_minimum(seed):
    random = np.random.default_rng(seed)
    size = 1 + seed % 4
    root = random.normal(size=(size, size))
    hessian, gradient = root @ root.T + 0.1 * np.eye(size), 3.0 * random.normal(size=size)
    low, high = -random.uniform(0.0, 1.0, size), random.uniform(0.0, 1.0, size)
    limits, room = random.normal(size=(seed % 3, size)), random.uniform(0.0, 0.5, seed % 3)

    def objective(step):
        return 0.5 * step @ hessian @ step + gradient @ step

    step = bounded_step(hessian, gradient, low, high, limits, room)
    bounds = list(zip(low, high, strict=True))
    cones = [{"type": "ineq", "fun": lambda d: room - limits @ d}] if len(room) else []
    best = minimize(objective, np.zeros(size), bounds=bounds, constraints=cones, tol=1e-12)
    assert (step >= low).all()
    assert (step <= high).all()
    assert (limits @ step <= room + 1e-9).all()
    assert objective(step) <= best.fun + 1e-7


def test_limits_that_contradict_give_a_finite_step_within_the_box():
    limits, room = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([-1.0, -1.0])
    low, high = np.full(2, -0.5), np.full(2, 0.5)
    step = bounded_step(np.eye(2), np.ones(2), low, high, limits, room)
    assert np.isfinite(step).all()
    assert (np.abs(step) <= 0.5).all()


def searched(residuals, slopes, start, low, high, **options):
    """End of a search for functions of the variables; no solution where they return NaN."""

    def point(variables):
        values = residuals(variables)
        none = np.zeros((0, len(variables)))
        made = SearchPoint(variables, values, slopes(variables), none, none[:, 0], None)
        return made if np.isfinite(values).all() else None

    problem = BoundedLeastSquares(
        lambda here, step: point(here.variables + step), low, high, 1e-9, reach=1.0, **options
    )
    return problem.search(point(np.array(start)), 200)


def test_a_curved_valley_within_bounds_ends_where_scipy_does():
    def residuals(x):
        return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    def slopes(x):
        return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])

    low = np.full(2, -2.0)
    for high in (np.full(2, 2.0), np.array([0.8, 2.0])):
        end = searched(residuals, slopes, [-1.2, 1.0], low, high)
        expected = least_squares(residuals, [-1.2, 0.9], slopes, (low, high), xtol=1e-14)
        assert end.met is bool(expected.cost < 1e-18)
        np.testing.assert_allclose(end.point.variables, expected.x, atol=1e-6)


def test_a_kink_and_a_range_without_solution_are_passed():
    def residuals(x):
        value = np.where(x < 0.3, 0.1 * x, 0.03 + 5.0 * (x - 0.3)) - 1.0
        return np.where(x > 0.7, np.nan, value)

    def slopes(x):
        return np.where(x < 0.3, 0.1, 5.0)[None]

    end = searched(residuals, slopes, [0.0], np.array([-1.0]), np.array([1.0]))
    assert end.met
    np.testing.assert_allclose(end.point.variables, 0.494, atol=1e-9)


def test_open_variables_are_made_small_where_asked():
    slopes = np.array([[1.0, 1.0]])
    low, high = np.zeros(2), np.full(2, 9.0)
    for small, expected in ((True, [1.0, 1.0]), (False, [2.0, 0.0])):
        end = searched(
            lambda x: slopes @ x - 2.0, lambda _: slopes, [2.0, 0.0], low, high, small=small
        )
        np.testing.assert_allclose(end.point.variables, expected, atol=2e-3)
