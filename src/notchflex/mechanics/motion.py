"""Rigid motions of space or of a plane: rotations, products, wrenches carried along.

A motion is a `Motion(rotation, translation)`: it takes coordinates of the inner frame to the
outer one, `outer = rotation @ inner + translation`. A twist is (angular, linear), a wrench
(moment, force), so that their dot product is a power.

Everything is written once for both groups; the shapes tell which it is. Space has three angular and
three linear components. The plane is that of x and z, its angular component is about y: twists and
wrenches have three numbers, `PLANE` of the six of space, and points two, `IN_PLANE` of three. A
"rotation" of the plane may also mirror x, as a frame does that is turned by half a turn about z.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import array_module, constant, jax, jnp

PLANE, IN_PLANE = slice(1, None, 2), slice(0, None, 2)

# Coefficients of sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 as polynomials in a^2, used for
# angles up to one radian: with eleven terms the first one left out is below 1e-22 there. The
# closed forms, used above, would lose digits near zero, and have no derivative at it.
_SERIES_BELOW = 1.0  # of the squared angle
_TERMS = 11
_SERIES = [[(-1.0) ** k / factorial(2 * k + start) for k in range(_TERMS)] for start in (1, 2, 3)]
_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


class Motion(NamedTuple):
    """A rigid motion, from an inner frame to the outer one (translation in mm)."""

    rotation: Float[Array, "... d d"]
    translation: Float[Array, "... d"]

    def then(self, inner: Motion) -> Motion:
        """Product: this motion, and inside its frame another."""
        return Motion(
            _times(self.rotation, inner.rotation),
            _times(self.rotation, inner.translation) + self.translation,
        )

    def point(self, inside: Float[Array, " d"]) -> Float[Array, " d"]:
        """Outer coordinates of a point of the inner frame (mm)."""
        return _times(self.rotation, inside) + self.translation

    def point_inside(self, outside: Float[Array, "*n d"]) -> Float[Array, "*n d"]:
        """Inner coordinates of a point of the outer frame (mm), or of many."""
        return _times(self.rotation.T, (outside - self.translation).T).T

    def wrench(self, inside: Float[Array, "w ..."]) -> Float[Array, "w ..."]:
        """Return a wrench (moment, force) about the inner origin, about and along the outer frame.

        Or many as columns, as for the two functions that follow.
        """
        axes = angular(inside)
        force = _times(self.rotation, inside[axes:])
        moment = turned(self.rotation, inside[:axes]) + moment_of(self.translation, force)
        return array_module(inside, force).concatenate([moment, force])

    def wrench_inside(self, outside: Float[Array, "w ..."]) -> Float[Array, "w ..."]:
        """Return a wrench about the outer origin, about the inner one and along the inner frame."""
        axes = angular(outside)
        force = outside[axes:]
        moment = outside[:axes] - moment_of(self.translation, force)
        inside = turned(self.rotation.T, moment)
        along = _times(self.rotation.T, force)
        return array_module(outside, inside).concatenate([inside, along])

    def twist_inside(self, outside: Float[Array, "w ..."]) -> Float[Array, "w ..."]:
        """Return a twist at the outer origin, at and along the inner frame."""
        axes = angular(outside)
        moved = outside[axes:] + cross(outside[:axes], self.translation)
        turn = turned(self.rotation.T, outside[:axes])
        return array_module(outside, moved).concatenate([turn, _times(self.rotation.T, moved)])


def _times(matrix: Float[Array, "d d"], other: Float[Array, "d ..."]) -> Float[Array, "d ..."]:
    """Product with a vector or with columns.

    Compiled it is written out, and becomes part of what stands around it: of so small matrices a
    product for itself takes longer to begin than to do.
    """
    if array_module(matrix, other) is np:
        return matrix @ other
    every = matrix.reshape(*matrix.shape, *(1,) * (other.ndim - 1))
    return (every * other[None]).sum(axis=1)


def angular(twist: Float[Array, "w ..."]) -> int:
    """Return the number of angular components of a twist or wrench: 3 in space, 1 in the plane."""
    return 3 if twist.shape[0] == 6 else 1


def identity(dimensions: int = 3) -> Motion:
    """Return the motion of space, or of the plane, that moves nothing."""
    return Motion(constant(np.eye(dimensions)), constant(np.zeros(dimensions)))


def turned(rotation: Float[Array, "d d"], axis: Float[Array, "a ..."]) -> Float[Array, "a ..."]:
    """Angular vectors along the outer frame; in the plane a mirror changes their sign."""
    if axis.shape[0] == 3:
        return _times(rotation, axis)
    return (rotation[0, 0] * rotation[1, 1] - rotation[0, 1] * rotation[1, 0]) * axis


def skew(vector: Float[Array, "*n a"]) -> Float[Array, "*n d d"]:
    """Matrix of the cross product with an angular vector: `skew(a) @ b = a x b`.

    In space of many vectors at once.
    """
    xp = array_module(vector)
    if vector.shape[-1] == 1:
        return vector[0] * _TURN
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    nothing = xp.zeros_like(x)
    rows = [nothing, -z, y, z, nothing, -x, -y, x, nothing]
    return xp.stack(rows, axis=-1).reshape(*vector.shape, 3)


def cross(first: Float[Array, "a ..."], second: Float[Array, "d ..."]) -> Float[Array, "d ..."]:
    """Cross product of an angular vector and a linear one (in space, of any two).

    Written out: it is compiled and run faster so than as a matrix.
    """
    xp = array_module(first, second)
    if first.shape[0] == 1:
        return xp.stack([first[0] * second[1], -first[0] * second[0]])
    (a, b, c), (x, y, z) = first, second
    return xp.stack([b * z - c * y, c * x - a * z, a * y - b * x])


def moment_of(point: Float[Array, "d ..."], force: Float[Array, "d ..."]) -> Float[Array, "a ..."]:
    """Return the moment about the origin of a force at a point, or of any two linear vectors."""
    if point.shape[0] == 3:
        return cross(point, force)
    xp = array_module(point, force)
    return xp.stack([point[1] * force[0] - point[0] * force[1]])


def unskew(matrix: Float[Array, "d d"]) -> Float[Array, " a"]:
    """Vector of the skew part of a matrix, the inverse of `skew`."""
    xp = array_module(matrix)
    if matrix.shape[0] == 2:
        return 0.5 * xp.stack([matrix[0, 1] - matrix[1, 0]])
    return 0.5 * xp.stack(
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
    )


def _coefficients(squared: Float[Array, ""]) -> tuple[Array, Array, Array]:
    """sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 for a squared angle."""
    xp = array_module(squared)
    small = squared < _SERIES_BELOW
    near = xp.where(small, squared, 0.0)
    angle = xp.sqrt(xp.where(small, _SERIES_BELOW, squared))
    sine, cosine = sine_cosine(angle)
    far = (sine / angle, (1.0 - cosine) / angle**2, (angle - sine) / angle**3)
    first, second, third = (
        xp.where(small, _polynomial(series, near), closed)
        for series, closed in zip(_SERIES, far, strict=True)
    )
    return first, second, third


def _polynomial(coefficients: list[float], at: Float[Array, ""]) -> Float[Array, ""]:
    value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = value * at + coefficient
    return cast("Array", value)


def sine_cosine(angle: Float[Array, "*n"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Sine and cosine, right to rounding.

    Compiled, those of the C library are taken number by number: this is several times as fast. The
    angle is brought to within half a turn, a quarter of it put into the series, and doubled twice.
    """
    if array_module(angle) is np:
        return cast("tuple[Array, Array]", (np.sin(angle), np.cos(angle)))
    quarter = 0.25 * (angle - _WHOLE_TURN * jnp.round(angle / _WHOLE_TURN))
    squared = quarter * quarter
    sine, versine = quarter * _polynomial(_SINE, squared), squared * _polynomial(_VERSINE, squared)
    cosine = 1.0 - versine
    sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    return 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine


_WHOLE_TURN = 2.0 * np.pi
_SINE = [(-1.0) ** k / factorial(2 * k + 1) for k in range(9)]
_VERSINE = [(-1.0) ** k / factorial(2 * k + 2) for k in range(9)]


def wrench_at(point: Float[Array, " d"], force: Float[Array, " d"]) -> Float[Array, " w"]:
    """Return a force at a point as a wrench (moment, force) about the origin."""
    return array_module(point, force).concatenate([moment_of(point, force), force])


def wrench_turn(wrench: Float[Array, " w"]) -> Float[Array, "w w"]:
    """Return how a wrench that goes along with a frame changes, per unit of the frame's own twist.

    With moment m and force f, a twist (omega, v) changes it by (omega x m + v x f, omega x f).
    """
    axes = angular(wrench)
    units = constant(np.eye(len(wrench)))
    xp = array_module(wrench)
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
    """Twists of the inner frame, as columns, at and along the outer one: in space, of many at once.

    For plain arrays, as robots are put together of them.
    """
    turn = motion.rotation @ twists[..., :3, :]
    place = motion.translation[..., None]
    moved = motion.rotation @ twists[..., 3:, :] + np.cross(place, turn, axis=-2)
    return constant(np.concatenate([turn, moved], axis=-2))


def rotation_about(vector: Float[Array, "*n a"]) -> Float[Array, "*n d d"]:
    """Return the rotation matrix of a rotation vector (rad); in space of many at once."""
    xp = array_module(vector)
    if vector.shape[-1] == 1:
        sine, cosine = sine_cosine(vector[0])
        return xp.stack([cosine, sine, -sine, cosine]).reshape(2, 2)
    first, second, _ = _coefficients(_squared(vector))
    matrix = skew(vector)
    return constant(np.eye(3)) + _each(first) * matrix + _each(second) * (matrix @ matrix)


def left_slope(vector: Float[Array, "*n 3"]) -> Float[Array, "*n 3 3"]:
    """How the rotation of a rotation vector turns on, along the outer axes, per change of it."""
    _, second, third = _coefficients(_squared(vector))
    matrix = skew(vector)
    return constant(np.eye(3)) + _each(second) * matrix + _each(third) * (matrix @ matrix)


def left_slope_change(vector: Float[Array, " 3"], held: Float[Array, " 3"]) -> Float[Array, "3 3"]:
    """Return the change of `left_slope(vector).T @ held` per change of the rotation vector.

    That product is held - b (v x held) + c v x (v x held), with coefficients b and c of |v|^2.
    """
    squared = vector @ vector
    (_, second, third), (_, by_second, by_third) = jax.jvp(
        _coefficients, (squared,), (jnp.ones_like(squared),)
    )
    once = cross(vector, held)
    twice = cross(vector, once)
    of_coefficients = jnp.outer(2.0 * (by_third * twice - by_second * once), vector)
    of_products = skew(once) + skew(vector) @ skew(held)
    return of_coefficients + second * skew(held) - third * of_products


def _squared(vector: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
    return vector @ vector if vector.ndim == 1 else (vector * vector).sum(axis=-1)


def _each(values: Float[Array, "*n"]) -> Float[Array, "*n 1 1"]:
    """Numbers that matrices are to be multiplied by."""
    return values if np.ndim(values) == 0 else values[..., None, None]
