"""Rigid motions against SciPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from notchflex._jax import jax, jnp
from notchflex.mechanics.motion import (
    Motion,
    identity,
    left_slope,
    left_slope_change,
    rotation_about,
    skew,
    unskew,
)
from twists import exponential

numbers = st.floats(-2.0, 2.0)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)


def matrix(motion: Motion) -> np.ndarray:
    """4 x 4 form of a motion."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = motion.rotation, motion.translation
    return whole


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, np.pi, 4.5])
def test_rotation_against_scipy(angle: float) -> None:
    vector = angle * np.array([2.0, -1.0, 2.0]) / 3.0
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(rotation_about(vector), expected, atol=1e-14)


@given(vectors, vectors)
def test_skew_is_the_cross_product(first: np.ndarray, second: np.ndarray) -> None:
    np.testing.assert_allclose(skew(first) @ second, np.cross(first, second), atol=1e-15)
    np.testing.assert_allclose(unskew(skew(first)), first, atol=1e-15)


@given(vectors, vectors, vectors, vectors)
def test_power_does_not_depend_on_the_frame(
    angular: np.ndarray, linear: np.ndarray, moment: np.ndarray, force: np.ndarray
) -> None:
    motion = exponential(np.array([0.3, -0.8, 0.5, 1.0, 2.0, -1.0]))
    outer = np.asarray(motion.wrench(np.concatenate([moment, force])))
    turned = motion.rotation @ angular
    moved = motion.rotation @ linear + np.cross(motion.translation, turned)
    assert outer[:3] @ turned + outer[3:] @ moved == pytest.approx(
        moment @ angular + force @ linear, abs=1e-12
    )


def test_products_points_and_inverse() -> None:
    first = exponential(np.array([0.1, 0.2, 0.3, 1.0, 0.0, -1.0]))
    second = exponential(np.array([-0.4, 0.0, 0.2, 0.5, 2.0, 0.0]))
    np.testing.assert_allclose(
        matrix(first.then(second)), matrix(first) @ matrix(second), atol=1e-15
    )
    point = np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(first.point_inside(first.point(point)), point, atol=1e-15)
    np.testing.assert_allclose(matrix(identity()), np.eye(4))


def test_derivative_is_smooth_at_zero() -> None:
    derivative = jax.jacfwd(rotation_about)(jnp.zeros(3))
    np.testing.assert_allclose(derivative, -np.cross(np.eye(3)[:, None], np.eye(3)[None]))


@given(vectors, vectors)
def test_left_slope_is_what_a_rotation_turns_by(vector: np.ndarray, change: np.ndarray) -> None:
    step = 1e-6 * change
    turn = rotation_about(vector + step) @ rotation_about(vector - step).T
    assert unskew(turn) == pytest.approx(2.0 * left_slope(vector) @ step, abs=2e-13)


@jax.jit
def changes(vector: jax.Array, held: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The change of the left slope, and by JAX."""
    by_jax = jax.jacfwd(lambda varied: left_slope(varied).T @ held)(vector)
    return left_slope_change(vector, held), by_jax


@given(vectors, vectors)
def test_change_of_the_left_slope_against_automatic_slopes(
    vector: np.ndarray, held: np.ndarray
) -> None:
    own, found = changes(vector, held)
    assert np.asarray(own) == pytest.approx(np.asarray(found), abs=1e-12)


@pytest.mark.parametrize("carry", [Motion.wrench, Motion.wrench_inside, Motion.twist_inside])
@pytest.mark.parametrize("size", [6, 3])
def test_columns_are_carried_as_one_by_one(carry: Callable[..., Any], size: int) -> None:
    rng = np.random.default_rng(0)
    twist = rng.normal(size=size)
    motion = Motion(*map(jnp.asarray, exponential(twist)))
    columns = jnp.array(rng.normal(size=(size, 4)))
    one_by_one = np.stack([carry(motion, column) for column in columns.T], axis=1)
    plain = carry(Motion(*map(np.asarray, motion)), np.asarray(columns))
    assert np.asarray(carry(motion, columns)) == pytest.approx(one_by_one, abs=1e-15)
    assert plain == pytest.approx(one_by_one, abs=1e-14)
