"""Derivatives of the stiffness of a notch; the potential of its moment; the cache."""

from __future__ import annotations

import numpy as np
import pytest

from notchflex._jax import jax, jnp
from notchflex.mechanics.ends import NotchStiffness, Side, flattening, notch_stiffness

NUMBERS = np.array([0.81, 0.70, 1.4, 0.8, 0.33, 1.2, 1.0])


def stiffness(numbers, cut, boundaries):
    outer, inner, depth, height, nu, near, far = numbers
    sides = Side(boundaries[0], near), Side(boundaries[1], far)
    return notch_stiffness(outer, inner, cut, depth, height, nu, *sides)


@pytest.mark.parametrize(
    ("cut", "boundaries"),
    [("on-axis", ("clamped", "between")), ("off-axis", ("between", "free"))],
)
def test_by_every_number(cut, boundaries, margin):
    def stacked(numbers):
        return jnp.stack(stiffness(tuple(numbers), cut, boundaries))

    at = jnp.asarray(NUMBERS)
    weights = np.arange(1.0, 1.0 + len(NotchStiffness._fields))
    along = jax.jit(lambda direction: jax.jvp(stacked, (at,), (direction,)))
    value, slopes = (np.array(x) for x in zip(*map(along, np.eye(len(NUMBERS))), strict=True))
    slopes = slopes.T
    adjoint = np.asarray(jax.jit(jax.grad(lambda numbers: weights @ stacked(numbers)))(at))
    margin.within("adjoint, relative", adjoint / (weights @ slopes) - 1, 1e-8)
    plain = lambda x: np.array(stiffness(tuple(map(float, x)), cut, boundaries))  # noqa: E731
    margin.within("NumPy against JAX", plain(NUMBERS) / value[0] - 1, 1e-9)
    for k, number in enumerate(NUMBERS):
        step = 1e-3 * number * np.eye(len(NUMBERS))[k]
        near, far = (plain(NUMBERS + s * step) - plain(NUMBERS - s * step) for s in (1, 2))
        wanted = (8 * near - far) / (12 * step[k])  # fourth order
        scale = np.abs(plain(NUMBERS)) / number
        margin.within("slopes, of value over number", (slopes[:, k] - wanted) / scale, 1e-6)


def test_potential(margin):
    angle = np.linspace(-0.5, 0.6, 23)
    for alpha, beta in ((0.42, 1.27), (0.8, 2.7), (0.5, 0.0), (1.4, 0.2)):
        h = 1e-3
        law = [flattening.potential(angle + k * h, alpha, beta) for k in (-2, -1, 1, 2)]
        slope = (law[0] - 8 * law[1] + 8 * law[2] - law[3]) / (12 * h)
        margin.within("U′", slope - flattening.moment(angle, alpha, beta), 1e-8)
        law = [flattening.moment(angle + k * h, alpha, beta) for k in (-2, -1, 1, 2)]
        slope = (law[0] - 8 * law[1] + 8 * law[2] - law[3]) / (12 * h)
        margin.within("U″", slope - flattening.tangent(angle, alpha, beta), 1e-8)
        b, e = alpha / 2, beta / 2
        if (d := 4 * e - b * b) > 0:
            rise = [2 / d**0.5 * np.arctan((2 * e * x + b) / d**0.5) for x in (angle, 0.0)]
            q = flattening.softening(angle, alpha, beta)
            closed = 2 / d - (2 + b * angle) / (d * q) - b / d * (rise[0] - rise[1])
            margin.within("closed form", closed - flattening.potential(angle, alpha, beta), 1e-13)


def test_limit_angle():
    for alpha, beta in ((0.42, 1.27), (0.0, 1.0), (0.5, 0.0)):
        limit = flattening.limit_angle(np.asarray(alpha), np.asarray(beta))
        assert abs(flattening.tangent(limit, alpha, beta)) < 1e-14


def test_computed_once():
    first = stiffness((*NUMBERS[:6], 0.9), "on-axis", ("between", "free"))
    assert stiffness((*NUMBERS[:6], 0.9), "on-axis", ("between", "free")) is first
    assert isinstance(first.weak, np.floating)
