"""Load paths of the tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

import notchflex as nf


def tensions(values: ArrayLike) -> nf.LoadPath:
    """Base tensions [N] one after the other; a column per tendon, or one tendon."""
    tension = _columns(values)
    return nf.LoadPath(tension=tension, stroke=np.full_like(tension, np.nan))


def strokes(values: ArrayLike) -> nf.LoadPath:
    """Tendon strokes [mm] one after the other; a column per tendon, or one tendon."""
    stroke = _columns(values)
    return nf.LoadPath(tension=np.full_like(stroke, np.nan), stroke=stroke)


def _columns(values: ArrayLike) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    return array[:, None] if array.ndim == 1 else array
