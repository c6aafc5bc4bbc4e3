"""Motions by SciPy's matrix exponential."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from notchflex.mechanics.motion import Motion


def exponential(twist: ArrayLike) -> Motion:
    """Motion by following a constant twist (angular, linear), of space or of a plane."""
    values = np.asarray(twist, float)
    axes = 2 if len(values) == 3 else 3
    matrix = np.zeros((axes + 1, axes + 1))
    if axes == 2:
        matrix[0, 1], matrix[1, 0] = values[0], -values[0]  # about y, from z to x
    else:
        matrix[:3, :3] = np.cross(values[:3], np.eye(3)).T  # its columns are angular x e_i
    matrix[:axes, axes] = values[-axes:]
    moved = expm(matrix)
    return Motion(moved[:axes, :axes], moved[:axes, axes])  # pyright: ignore[reportArgumentType]
