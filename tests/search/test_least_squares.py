"""The step of a search against scipy's constrained minimisation."""

import numpy as np
import pytest
from scipy.optimize import minimize

from notchflex.search.least_squares import bounded_step


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
