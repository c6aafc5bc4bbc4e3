"""Rigid motions of space: the exponential of a twist, products, and wrenches carried along.

A motion is a `Motion(rotation, translation)`: it takes coordinates of the inner frame to the
outer one, `outer = rotation @ inner + translation`. A twist is (angular 3, linear 3), a wrench
(moment 3, force 3), so that their dot product is a power.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import array_module, constant

# Coefficients of sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 as polynomials in a^2, used for
# angles up to two radians: with sixteen terms the first one left out is below 1e-27 there. The
# closed forms, used above, would lose digits near zero, and have no derivative at it.
_SERIES_BELOW = 4.0  # of the squared angle
_TERMS = 16
_SERIES = np.array(
    [[(-1.0) ** k / factorial(2 * k + start) for k in range(_TERMS)] for start in (1, 2, 3)]
)
_CROSS = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _CROSS[_i, _k, _j], _CROSS[_k, _i, _j] = 1.0, -1.0


class Motion(NamedTuple):
    """A rigid motion, from an inner frame to the outer one (translation in mm)."""

    rotation: Float[Array, "... 3 3"]
    translation: Float[Array, "... 3"]

    def then(self, inner: Motion) -> Motion:
        """Product: this motion, and inside its frame another."""
        return Motion(
            self.rotation @ inner.rotation,
            self.rotation @ inner.translation + self.translation,
        )

    def point(self, inside: Float[Array, " 3"]) -> Float[Array, " 3"]:
        """Outer coordinates of a point of the inner frame (mm)."""
        return self.rotation @ inside + self.translation

    def point_inside(self, outside: Float[Array, " 3"]) -> Float[Array, " 3"]:
        """Inner coordinates of a point of the outer frame (mm)."""
        return (outside - self.translation) @ self.rotation

    def points_inside(self, outside: Float[Array, "k 3"]) -> Float[Array, "k 3"]:
        """Inner coordinates of several points of the outer frame (mm)."""
        return (outside - self.translation[None]) @ self.rotation

    def wrench(self, inside: Float[Array, " 6"]) -> Float[Array, " 6"]:
        """A wrench (moment, force) about the inner origin, about and along the outer frame."""
        force = self.rotation @ inside[3:]
        moment = self.rotation @ inside[:3] + skew(self.translation) @ force
        return array_module(inside).concatenate([moment, force])

    def wrenches(self, inside: Float[Array, "k 6"]) -> Float[Array, "k 6"]:
        """Several wrenches about the inner origin, about and along the outer frame."""
        xp = array_module(inside)
        force = inside[:, 3:] @ self.rotation.T
        moment = inside[:, :3] @ self.rotation.T + force @ skew(self.translation).T
        return xp.concatenate([moment, force], axis=-1)


def identity() -> Motion:
    """The motion that moves nothing."""
    return Motion(constant(np.eye(3)), constant(np.zeros(3)))


def skew(vector: Float[Array, " 3"]) -> Float[Array, "3 3"]:
    """Matrix of the cross product: `skew(a) @ b = a x b`."""
    xp = array_module(vector)
    x, y, z, nothing = vector[0], vector[1], vector[2], xp.zeros_like(vector[0])
    return xp.stack([nothing, -z, y, z, nothing, -x, -y, x, nothing]).reshape(3, 3)


def cross(first: Float[Array, " 3"], second: Float[Array, " 3"]) -> Float[Array, " 3"]:
    """Cross product, written out: it is compiled and run faster so than as a matrix."""
    (a, b, c), (x, y, z) = first, second
    return array_module(first, second).stack([b * z - c * y, c * x - a * z, a * y - b * x])


def unskew(matrix: Float[Array, "3 3"]) -> Float[Array, " 3"]:
    """Vector of the skew part of a matrix, the inverse of `skew`."""
    return 0.5 * array_module(matrix).tensordot(matrix, _CROSS, 2)


def _coefficients(squared: Float[Array, ""]) -> tuple[Array, Array, Array]:
    """sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 for a squared angle."""
    xp = array_module(squared)
    small = squared < _SERIES_BELOW
    near = xp.where(small, squared, 0.0)
    square = near * near
    low = xp.stack([xp.ones_like(near), near, square, near * square])
    fourth = square * square
    eighth = fourth * fourth
    high = xp.stack([xp.ones_like(near), fourth, eighth, fourth * eighth])
    series = _SERIES @ (high[:, None] * low[None]).ravel()
    angle = xp.sqrt(xp.where(small, _SERIES_BELOW, squared))
    sine, versine = xp.sin(angle), 2.0 * xp.sin(0.5 * angle) ** 2
    far = (sine / angle, versine / angle**2, (angle - sine) / angle**3)
    first, second, third = (xp.where(small, series[i], far[i]) for i in range(3))
    return first, second, third


def exponential(twist: Float[Array, " 6"]) -> Motion:
    """Motion reached by following a constant twist (angular, linear) for one unit of length."""
    angular, linear = twist[:3], twist[3:]
    first, second, third = _coefficients(angular @ angular)
    cross = skew(angular)
    cross_twice = cross @ cross
    rotation = constant(np.eye(3)) + first * cross + second * cross_twice
    return Motion(rotation, linear + second * (cross @ linear) + third * (cross_twice @ linear))


def bracket(first: Float[Array, " 6"], second: Float[Array, " 6"]) -> Float[Array, " 6"]:
    """Lie bracket of two twists: how far following one and then the other depends on the order."""
    turn, move = first[:3], first[3:]
    other_turn, other_move = second[:3], second[3:]
    moved = cross(turn, other_move) - cross(other_turn, move)
    return array_module(first, second).concatenate([cross(turn, other_turn), moved])


def wrenches_at(points: Float[Array, "k 3"], forces: Float[Array, "k 3"]) -> Float[Array, "k 6"]:
    """Forces at points as wrenches (moment, force) about the origin."""
    xp = array_module(points, forces)
    return xp.concatenate([xp.cross(points, forces), forces], axis=-1)


def adjoint(motion: Motion) -> Float[Array, "6 6"]:
    """Matrix that takes a twist of the inner frame to the outer one."""
    xp = array_module(motion.rotation)
    moved = skew(motion.translation) @ motion.rotation
    return xp.block([[motion.rotation, xp.zeros((3, 3))], [moved, motion.rotation]])


def rotation_about(vector: Float[Array, " 3"]) -> Float[Array, "3 3"]:
    """Rotation matrix of a rotation vector (rad)."""
    xp = array_module(vector)
    return exponential(xp.concatenate([vector, xp.zeros(3)])).rotation
