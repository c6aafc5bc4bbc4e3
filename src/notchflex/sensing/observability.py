"""Which part of a force the readings determine, in numbers and in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float


def unobservable(slopes: Float[np.ndarray, "m d"], largest: float) -> Float[np.ndarray, "k d"]:
    """Return the directions in which the noise exceeds the range of the search, as unit rows.

    Args:
        slopes: Change of the whitened readings by the force.
        largest: Range of the search, N.
    """
    _, values, rows = np.linalg.svd(slopes.reshape(-1, slopes.shape[1]))
    values = np.concatenate([values, np.zeros(len(rows) - len(values))])
    hidden = rows[values * largest < 1.0]
    # One sign of each: the largest entry is positive.
    signs = np.sign(hidden[np.arange(len(hidden)), np.abs(hidden).argmax(axis=1)])
    return hidden * signs[:, None]


def direction_in_words(names: Sequence[str], direction: Float[np.ndarray, " d"]) -> str:
    """Describe a direction by its components.

    Example:
        >>> direction_in_words(("x", "z"), np.array([0.0, 1.0]))
        'z'
        >>> direction_in_words(("x", "z"), np.array([-0.6, 0.8]))
        '-0.60 x + 0.80 z'
    """
    parts = [(part, name) for part, name in zip(direction, names, strict=True) if abs(part) > 0.05]
    if len(parts) == 1:
        return parts[0][1]
    text = " + ".join(f"{part:.2f} {name}" for part, name in parts)
    return text.replace("+ -", "- ")
