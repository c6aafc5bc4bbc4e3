"""Poses between given ones, along constant twists: how a short piece of a rod bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def between(rotation: Array, position: Array, parts: int) -> tuple[Array, Array]:
    """Fill up rows of poses, one row or many side by side.

    Args:
        rotation: (..., k, 3, 3).
        position: (..., k, 3).
        parts: Pieces that the way from each pose to the next one is divided into.

    Returns:
        Rotations and positions of (k - 1) parts + 1 poses a row, the given ones among them.

    Example:
        >>> turned = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        >>> _, line = between(np.stack([np.eye(3), turned]), np.eye(3)[[1, 0]] - np.eye(3)[1], 2)
        >>> line.shape
        (3, 3)
    """
    if parts == 1:
        return rotation, position
    first, second = rotation[..., :-1, :, :], rotation[..., 1:, :, :]
    vector = rotation_vector(np.swapaxes(first, -1, -2) @ second)
    step = np.einsum("...ba,...b->...a", first, np.diff(position, axis=-2))
    # Solve V(1) v = step for the velocity v of the twist, then follow it.
    velocity = np.linalg.solve(_mean_rotation(vector), step[..., None])
    part = (np.arange(parts) / parts)[:, None, None]
    twist = part[..., 0] * vector[..., None, :]  # (..., k - 1, parts, 3)
    from_first = first[..., None, :, :]
    rotations = from_first @ rotation_of(twist)
    moved = from_first @ (_mean_rotation(twist) @ velocity[..., None, :, :]) * part
    positions = position[..., :-1, None, :] + moved[..., 0]
    rows, count = rotation.shape[:-3], rotations.shape[-4] * parts
    return (
        np.concatenate([rotations.reshape(*rows, count, 3, 3), rotation[..., -1:, :, :]], axis=-3),
        np.concatenate([positions.reshape(*rows, count, 3), position[..., -1:, :]], axis=-2),
    )


def rotation_of(vector: Array) -> Array:
    """Return the rotations of rotation vectors (..., 3), by Rodrigues' formula."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = _cross(vector)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + _half(angle) * cross @ cross


def rotation_vector(rotation: Array) -> Array:
    """Return the rotation vectors of rotations (..., 3, 3) of less than half a turn."""
    skew = 0.5 * (rotation - np.swapaxes(rotation, -1, -2))
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, (np.trace(rotation, axis1=-2, axis2=-1) - 1.0) / 2.0)
    small = sine < 1e-12
    return axis * np.where(small, 1.0, angle / np.where(small, 1.0, sine))[..., None]


def _mean_rotation(vector: Array) -> Array:
    """Return the mean rotation along a constant twist: the integral of exp(s w) over 0..1."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = _cross(vector)
    small = angle < 1e-4
    third = np.where(
        small, 1.0 / 6.0, (1.0 - np.sinc(angle / np.pi)) / np.where(small, 1.0, angle) ** 2
    )
    return np.eye(3) + _half(angle) * cross + third * cross @ cross


def _cross(vector: Array) -> Array:
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _half(angle: Array) -> Array:
    """Return (1 - cos a) / a^2, which is 1/2 at 0."""
    return 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
