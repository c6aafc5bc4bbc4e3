"""Interpolates poses along constant twists, as a short piece of a rod bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

# Integrates rotations of less than a radian along the way to 1e-12.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def interpolate_poses(rotation: Array, position: Array, parts: int) -> tuple[Array, Array]:
    """Insert poses between k ones: rotations (..., k, 3, 3) and positions (..., k, 3).

    `parts` is the number of steps from each pose to the next one: (k - 1) parts + 1 poses.

    Example:
        >>> turned = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        >>> line = np.eye(3)[[1, 0]] - np.eye(3)[1]
        >>> _, line = interpolate_poses(np.stack([np.eye(3), turned]), line, 2)
        >>> line.shape
        (3, 3)
    """
    if parts == 1:
        return rotation, position
    first, second = rotation[..., :-1, :, :], rotation[..., 1:, :, :]
    change = (np.swapaxes(first, -1, -2) @ second).reshape(-1, 3, 3)
    vector = Rotation.from_matrix(change).as_rotvec().reshape(*first.shape[:-1])
    step = np.einsum("...ba,...b->...a", first, np.diff(position, axis=-2))
    # The displacement is the mean rotation times the velocity of the twist.
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
    """Return the rotations (..., 3, 3) of rotation vectors (..., 3)."""
    return Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*vector.shape, 3)


def _mean_rotation(vector: Array) -> Array:
    """Return the mean rotation along a constant twist: the integral of exp(s w) over 0..1."""
    along = 0.5 * (1.0 + _NODES[:, None]) * vector[..., None, :]
    return np.einsum("i,...iab->...ab", 0.5 * _WEIGHTS, rotation_of(along))
