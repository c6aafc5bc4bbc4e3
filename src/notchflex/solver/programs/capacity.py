"""Numbers of flexures that programs are compiled for, and rows of numbers for longer chains.

A program runs for all chains of up to so many flexures: a shorter chain is lengthened by flexures
that do nothing. With the body at the base, flexures and bodies fill the processor's vectors, which
a shorter chain would leave partly empty: within a vector the added flexures cost nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from lanewise import WIDTH
from notchflex.solver.programs.pytree_layout import PytreeLayout

# From so many bodies on (left) numbers of bodies are multiples of so many (right).
_STEPS = ((0, WIDTH), (2 * WIDTH, 2 * WIDTH), (16 * WIDTH, 4 * WIDTH), (32 * WIDTH, 8 * WIDTH))


def capacity(flexures: int) -> int:
    """Return the number of flexures that a program for some flexures is compiled for.

    Args:
        flexures: How many the chain has.

    Example:
        >>> [capacity(flexures) for flexures in (1, 5, 8, 27, 40, 100)]
        [7, 7, 15, 31, 47, 111]
    """
    bodies = flexures + 1
    step = max(own for least, own in _STEPS if bodies > least)
    return -(-bodies // step) * step - 1


@lru_cache(maxsize=256)
def padded_indices(own: PytreeLayout, long: PytreeLayout) -> Int[np.ndarray, " own"]:
    """Return where the numbers of a form are in that of a longer chain.

    Args:
        own: A form whose arrays have flexures or bodies as leading axis.
        long: The same of a chain with more flexures beyond the tip.
    """
    found = [
        whole[tuple(slice(size) for size in part.shape)].ravel()
        for part, whole in zip(own.places, long.places, strict=True)
    ]
    return np.concatenate(found) if found else np.zeros(0, int)


def pad_rows(
    rows: Float[np.ndarray, "*s own"], own: PytreeLayout, long: PytreeLayout
) -> Float[np.ndarray, "*s long"]:
    """Return rows of a form as those of a longer chain, 0 for the flexures added."""
    if own is long:
        return rows
    found = np.zeros((*rows.shape[:-1], long.size))
    found[..., padded_indices(own, long)] = rows
    return found


__all__ = ["capacity", "pad_rows", "padded_indices"]
