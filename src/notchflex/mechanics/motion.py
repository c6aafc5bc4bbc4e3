"""Rigid motions of space or of a plane: rotations, products, transformation of wrenches.

A motion is a `Motion(rotation, translation)`: it takes coordinates of the inner frame to the
outer one, `outer = rotation @ inner + translation`. A twist is (angular, linear), a wrench
(moment, force), so that their dot product is a power.

All functions serve both groups, distinguished by the shapes. Space has three angular and three
linear components. The plane is that of x and z, its angular component is about y: twists and
wrenches have three numbers, `PLANE` of the six of space, and points two, `IN_PLANE` of three. A
"rotation" of the plane may also mirror x, as a frame does that is turned by half a turn about z.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import is_traced, xp
from notchflex._jax import constant, jnp

PLANE, IN_PLANE = slice(1, None, 2), slice(0, None, 2)

# Series in a^2 of sin(a)/a, (1 - cos a)/a^2 and the last two of the `_coefficients`: the first term
# left out is below 1e-16 of the first to an eighth of a turn, of the last two to a quarter.
_SERIES = [[(-1.0) ** k / factorial(2 * k + start) for k in range(9)] for start in (1, 2, 4, 5)]


Vector = Float[Array, "d ..."]
Angular = Float[Array, "a ..."]
Wrench = Float[Array, "w ..."]
Matrix = Float[Array, "*n d d"]


class Motion(NamedTuple):
    """A rigid motion, from an inner frame to the outer one (translation in mm)."""

    rotation: Float[Array, "... d d"]
    translation: Float[Array, "... d"]

    def then(self, inner: Motion) -> Motion:
        """Compose with another motion, given in the inner frame."""
        return Motion(
            _times(self.rotation, inner.rotation),
            _times(self.rotation, inner.translation) + self.translation,
        )

    def pick(self, index: Any) -> Motion:
        """Select one of many motions, or some."""
        return Motion(self.rotation[index], self.translation[index])

    def point(self, inside: Vector) -> Vector:
        """Transform a point of the inner frame to outer coordinates (mm)."""
        return _times(self.rotation, inside) + self.translation

    def point_inside(self, outside: Vector) -> Vector:
        """Transform a point of the outer frame, or many, to inner coordinates (mm)."""
        return _times(self.rotation.T, (outside - self.translation).T).T

    def wrench(self, inside: Wrench) -> Wrench:
        """Transform a wrench (moment, force) from the inner to the outer frame."""
        # This and the two methods below also accept many, as columns.
        axes = angular(inside)
        force = _times(self.rotation, inside[axes:])
        moment = turned(self.rotation, inside[:axes]) + moment_of(self.translation, force)
        return xp.concatenate([moment, force])

    def wrench_inside(self, outside: Wrench) -> Wrench:
        """Transform a wrench from the outer to the inner frame."""
        axes = angular(outside)
        force = outside[axes:]
        moment = outside[:axes] - moment_of(self.translation, force)
        inside = turned(self.rotation.T, moment)
        along = _times(self.rotation.T, force)
        return xp.concatenate([inside, along])

    def twist_inside(self, outside: Wrench) -> Wrench:
        """Transform a twist from the outer to the inner frame."""
        axes = angular(outside)
        moved = outside[axes:] + cross(outside[:axes], self.translation)
        turn = turned(self.rotation.T, outside[:axes])
        return xp.concatenate([turn, _times(self.rotation.T, moved)])


def _times(matrix: Matrix, other: Vector) -> Vector:
    """Multiply by a vector or by columns."""
    # In compiled code the product is written out, so that it fuses with its surroundings: for such
    # small matrices the overhead of a separate product exceeds its cost.
    if not is_traced((matrix, other)):
        return matrix @ other
    entries = matrix.reshape(*matrix.shape, *(1,) * (other.ndim - 1))
    return (entries * other[None]).sum(axis=1)


def angular(twist: Wrench) -> int:
    """Return the number of angular components of a twist or wrench: 3 in space, 1 in the plane."""
    return 3 if twist.shape[0] == 6 else 1


def identity(dimensions: int = 3) -> Motion:
    """Return the identity motion of space, or of the plane."""
    return Motion(constant(xp.eye(dimensions)), constant(xp.zeros(dimensions)))


def turned(rotation: Matrix, axis: Angular) -> Angular:
    """Rotate angular vectors to the outer frame; in the plane a mirror changes their sign."""
    if axis.shape[0] == 3:
        return _times(rotation, axis)
    return (rotation[0, 0] * rotation[1, 1] - rotation[0, 1] * rotation[1, 0]) * axis


def skew(vector: Float[Array, "*n a"]) -> Matrix:
    """Return the matrix of the cross product with an angular vector: `skew(a) @ b = a x b`."""
    # In space it accepts many vectors.
    if vector.shape[-1] == 1:
        return vector[0] * xp.array([[0.0, 1.0], [-1.0, 0.0]])
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    nothing = xp.zeros_like(x)
    rows = [nothing, -z, y, z, nothing, -x, -y, x, nothing]
    return xp.stack(rows, axis=-1).reshape(*vector.shape, 3)


def cross(first: Angular, second: Vector) -> Vector:
    """Compute the cross product of an angular vector and a linear one (in space, of any two)."""
    # Written out it compiles and runs faster than as a matrix.
    if first.shape[0] == 1:
        return xp.stack([first[0] * second[1], -first[0] * second[0]])
    (a, b, c), (x, y, z) = first, second
    return xp.stack([b * z - c * y, c * x - a * z, a * y - b * x])


def moment_of(point: Vector, force: Vector) -> Angular:
    """Return the moment about the origin of a force at a point, or of any two linear vectors."""
    if point.shape[0] == 3:
        return cross(point, force)
    return xp.stack([point[1] * force[0] - point[0] * force[1]])


def unskew(matrix: Matrix) -> Angular:
    """Return the vector of the skew part of a matrix, the inverse of `skew`."""
    if matrix.shape[0] == 2:
        return 0.5 * xp.stack([matrix[0, 1] - matrix[1, 0]])
    return 0.5 * xp.stack(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )


def _coefficients(squared: Float[Array, "*n"], doublings: int = 2) -> list[Float[Array, "*n"]]:
    """Compute sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 from a squared angle, and the two next.

    Each is the first term of its series less a^2 times the one after the next.
    """
    # The last two of a quarter of the angle come from their series, and the angle is doubled twice:
    # up to a whole turn no digits are lost, and there is no case near zero.
    if doublings:
        first, second, third, *last = _coefficients(0.25 * squared, doublings - 1)
        fourth, fifth = 0.125 * third * (1.0 + first), 0.0625 * (sum(last) + second * third)
    else:
        fourth, fifth = (polynomial(series, squared) for series in _SERIES[2:])
    third = 1.0 / 6.0 - squared * fifth
    return [1.0 - squared * third, 0.5 - squared * fourth, third, fourth, fifth]


def polynomial(coefficients: Sequence[float], variable: Any) -> Any:
    """Evaluate a polynomial, its lowest coefficient first."""
    value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = value * variable + coefficient
    return value


def sine_cosine(angle: Float[Array, "*n"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Compute sine and cosine to rounding accuracy."""
    # In compiled code this is several times as fast as the scalar C library. The angle is reduced
    # to half a turn, a quarter of it is put into the series, and the result is doubled twice.
    if not is_traced(angle):
        return cast("tuple[Array, Array]", (xp.sin(angle), xp.cos(angle)))
    turn = 2.0 * np.pi
    quarter = 0.25 * (angle - turn * jnp.round(angle / turn))
    squared = quarter * quarter
    sine = quarter * polynomial(_SERIES[0], squared)
    versine = squared * polynomial(_SERIES[1], squared)
    cosine = 1.0 - versine
    sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    return 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine


def wrench_at(point: Vector, force: Vector) -> Wrench:
    """Return the wrench (moment, force) about the origin of a force at a point."""
    return xp.concatenate([moment_of(point, force), force])


def wrench_turn(wrench: Wrench) -> Float[Array, "w w"]:
    """Differentiate a wrench that moves with a frame by the twist of the frame."""
    # With moment m and force f, a twist (omega, v) changes it by (omega x m + v x f, omega x f).
    axes = angular(wrench)
    units = constant(xp.eye(len(wrench)))
    moment, force = wrench[:axes], wrench[axes:]
    columns = []
    for unit in units:
        turn, move = unit[:axes], unit[axes:]
        about = moment_of(move, force)
        if axes == 3:
            about = about + cross(turn, moment)
        columns.append(xp.concatenate([about, cross(turn, force)]))
    return xp.stack(columns, axis=1)


def outer_twists(motion: Motion, twists: Float[Array, "*n 6 k"]) -> Float[Array, "*n 6 k"]:
    """Transform twists, as columns, to the outer frame; in space, of many motions."""
    # For NumPy arrays only.
    turn = motion.rotation @ twists[..., :3, :]
    offset = motion.translation[..., None]
    moved = motion.rotation @ twists[..., 3:, :] + xp.cross(offset, turn, axis=-2)
    return constant(xp.concatenate([turn, moved], axis=-2))


def rotation_about(vector: Float[Array, "*n a"]) -> Matrix:
    """Return the rotation matrix of a rotation vector (rad), or of many."""
    if vector.shape[-1] == 1:
        sine, cosine = sine_cosine(vector[..., 0])
        return xp.stack([cosine, sine, -sine, cosine], -1).reshape(*vector.shape[:-1], 2, 2)
    first, second, *_ = _coefficients((vector * vector).sum(axis=-1))
    return _quadratic(skew(vector), first, second)


def left_slope(vector: Float[Array, "*n 3"]) -> Float[Array, "*n 3 3"]:
    """Return the left Jacobian of SO(3): rotation in the outer frame per change of its vector."""
    _, second, third, *_ = _coefficients((vector * vector).sum(axis=-1))
    return _quadratic(skew(vector), second, third)


def left_slope_change(
    vector: Float[Array, " 3"], constant_vector: Float[Array, " 3"]
) -> Float[Array, "3 3"]:
    """Differentiate `left_slope(vector).T @ constant_vector` by the rotation vector."""
    # With w the constant vector the product is w - b (v x w) + c v x (v x w), where b to e are
    # the last four coefficients, and d - c / 2 and (3 e - d) / 2 the slopes of b and c by |v|^2.
    _, second, third, fourth, fifth = _coefficients((vector * vector).sum(axis=-1))
    once = cross(vector, constant_vector)
    twice = cross(vector, once)
    of_coefficients = jnp.outer(
        (3.0 * fifth - fourth) * twice - (2.0 * fourth - third) * once, vector
    )
    of_products = skew(once) + skew(vector) @ skew(constant_vector)
    return of_coefficients + second * skew(constant_vector) - third * of_products


def _quadratic(matrix: Matrix, linear: Float[Array, "*n"], square: Float[Array, "*n"]) -> Matrix:
    """Return polynomials of matrices of 3 rows, 1 being their constant coefficient."""
    linear, square = (
        factor if xp.ndim(factor) == 0 else factor[..., None, None] for factor in (linear, square)
    )
    return xp.broadcast_to(xp.eye(3), matrix.shape) + linear * matrix + square * (matrix @ matrix)
