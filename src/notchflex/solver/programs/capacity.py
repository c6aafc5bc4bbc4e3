"""Numbers of flexures that programs are compiled for, and padding to them.

A program serves all chains of up to its number of flexures; a shorter chain is padded with inert
flexures. With the base body they fill the processor's vectors: within a vector the added flexures
cost nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from lanewise import WIDTH
from notchflex.solver.programs.pytree_layout import PytreeLayout

# Above a number of bodies (left), numbers of bodies are multiples of the right number.
_STEPS = ((0, WIDTH), (2 * WIDTH, 2 * WIDTH), (16 * WIDTH, 4 * WIDTH), (32 * WIDTH, 8 * WIDTH))


def capacity(flexures: int) -> int:
    """Return the number of flexures that a program for some flexures is compiled for.

    Args:
        flexures: Number of flexures of the chain.

    Example:
        >>> [capacity(flexures) for flexures in (1, 5, 8, 27, 40, 100)]
        [7, 7, 15, 31, 47, 111]
    """
    bodies = flexures + 1
    step = max(multiple for start, multiple in _STEPS if bodies > start)
    return -(-bodies // step) * step - 1


@lru_cache(maxsize=256)
def padded_indices(own: PytreeLayout, long: PytreeLayout) -> Int[np.ndarray, " own"]:
    """Return where the numbers of a layout are in that of a longer chain.

    Args:
        own: A layout of arrays with flexures or bodies as leading axis.
        long: The same of a chain with more flexures beyond the tip.
    """
    indices = [
        padded[tuple(slice(size) for size in part.shape)].ravel()
        for part, padded in zip(own.indices, long.indices, strict=True)
    ]
    return np.concatenate([np.zeros(0, int), *indices])


def pad_rows(
    rows: Float[np.ndarray, "*s own"], own: PytreeLayout, long: PytreeLayout
) -> Float[np.ndarray, "*s long"]:
    """Return rows of a layout as those of a longer chain, 0 for the flexures added."""
    if own is long:
        return rows
    padded = np.zeros((*rows.shape[:-1], long.size))
    padded[..., padded_indices(own, long)] = rows
    return padded


__all__ = ["capacity", "pad_rows", "padded_indices"]
