"""Polynomials from several numbers to several values."""

from __future__ import annotations

import numpy as np

from notchflex.designing.search.polynomial import PolynomialAccuracy, fit_polynomial, leja_points

RANDOM = np.random.default_rng(5)


def test_a_polynomial_finds_what_a_polynomial_is():
    def exact(x):
        return np.array([x[0] ** 3 * x[1] + 2.0, x[1] * x[2], 5.0])

    made = fit_polynomial(
        exact, np.array([0.5, 1.0, -1.0]), np.array([1.0, 2.0, 3.0]), [[0, 1, 2]],
        lambda sizes: np.maximum(sizes, 1e-6), [np.array([0]), np.array([1]), np.array([2])],
        accuracies=[PolynomialAccuracy(1e-9, 500)], checks=np.array([[0.7, 1.3, 2.0]]),
    )  # fmt: skip
    assert made is not None
    assert made.entries.tolist() == [0, 1]
    numbers = RANDOM.uniform([0.5, 1.0, -1.0], [1.0, 2.0, 3.0], (50, 3))
    both = np.stack([exact(row)[:2] for row in numbers], axis=-1)
    np.testing.assert_allclose(made.varied(numbers), both, rtol=1e-10)
    # Only the products that are needed: 3 and 1 degrees in the first, 1 and 1 in the second.
    assert len(made.terms.powers) <= 4 * 2 + 2 * 2


def test_leja_points_are_apart():
    points = leja_points()  # no closer than those of Chebyshev
    assert points[:3].tolist() == [0.0, -1.0, 1.0]
    assert np.min(np.diff(np.sort(points))) > 1.0 - np.cos(np.pi / len(points))
