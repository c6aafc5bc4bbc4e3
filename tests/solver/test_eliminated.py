"""Small systems solved side by side, whose rows may be of very unlike size."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex._jax import jax
from notchflex.solver.linear_step import gauss_jordan

compiled = jax.jit(gauss_jordan)


@pytest.mark.parametrize("size", [1, 2, 4, 9])
@pytest.mark.parametrize("decades", [0, 6, 14])
def test_rows_of_unlike_size_cost_no_digits(size: int, decades: int) -> None:
    rng = np.random.default_rng(size)
    matrix = rng.uniform(-0.1, 0.1, (20, size, size)) + np.eye(size)
    right = rng.normal(size=(20, size, 3))
    expected = np.linalg.solve(matrix, right)
    scale = 10.0 ** rng.uniform(-decades, decades, (20, size, 1))
    found = compiled(scale * matrix, scale * right)
    assert np.asarray(found) == pytest.approx(expected, abs=1e-13)
