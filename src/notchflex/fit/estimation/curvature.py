"""A curvature without the units of its constants, so that its directions can be compared."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class UnitFree(NamedTuple):
    """A curvature with ones on its diagonal.

    Attributes:
        size: What every constant was measured in: the root of its own curvature, above 0.
        curvature: The curvature in these units.
    """

    size: Float[np.ndarray, " k"]
    curvature: Float[np.ndarray, "k k"]


def unit_free(curvature: Float[np.ndarray, "k k"]) -> UnitFree:
    """Take the units out of a curvature.

    Example:
        >>> unit_free(np.array([[4.0, 1.0], [1.0, 1.0]])).curvature.tolist()
        [[1.0, 0.5], [0.5, 1.0]]
    """
    size = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    return UnitFree(size, curvature / np.outer(size, size))


def inverse_of(curvature: Float[np.ndarray, "k k"]) -> Float[np.ndarray, "k k"]:
    """Return the inverse of a curvature; infinite for what has no curvature at all."""
    known = np.diag(curvature) > 0.0
    found = np.diag(np.where(known, 0.0, np.inf))
    plain = unit_free(curvature[np.ix_(known, known)])
    values, vectors = np.linalg.eigh(plain.curvature)
    # What rounding makes of no curvature at all is a very wide interval, not a narrow one.
    own = (vectors / np.maximum(values, 1e-15)) @ vectors.T
    found[np.ix_(known, known)] = own / np.outer(plain.size, plain.size)
    return found


__all__ = ["UnitFree", "inverse_of", "unit_free"]
