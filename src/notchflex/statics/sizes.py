"""Numbers of loads that programs are compiled for: loads are filled up to them, and skipped."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Int

from notchflex._jax import jax

# A solve, a usual path, and longer ones.
_SIZES = (1, 128, 4096)


def size(count: int) -> int:
    """The number of loads that programs are compiled for."""
    return next((one for one in _SIZES if one >= count), -(-count // _SIZES[-1]) * _SIZES[-1])


def padded(count: int) -> Int[np.ndarray, " size"]:
    """Entries up to one of the sizes, the last one repeated."""
    return np.minimum(np.arange(size(count)), count - 1)


def pad(tree: Any) -> Any:
    """Repeat the last entry until the leading axis has one of the sizes."""
    index = padded(len(jax.tree.leaves(tree)[0]))
    return jax.tree.map(lambda leaf: np.asarray(leaf)[index], tree)


__all__ = ["pad", "padded", "size"]
