"""The friction front: how far the reversal from loading to unloading has come along a tendon."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

# Log ratios this close to their bound are on it.
_NEAR_BOUND = 1e-9


def friction_front(
    ratio: Float[np.ndarray, "s t contacts"], bound: Float[np.ndarray, "s t contacts"]
) -> tuple[Int[np.ndarray, "s t"], Float[np.ndarray, "s t"]]:
    """The contact that turns, and its friction over the largest (Gao 2017, eq. 26).

    Args:
        ratio: Log ratio of the tension at every contact, base to tip; NaN where there is none.
        bound: Its largest magnitude.

    Returns:
        m and eta of every tendon; see `EquilibriumPath.front`.
    """
    there = ~np.isnan(ratio)
    rubs = there & (bound > 0.0)
    # A contact without friction (a law may lay it all on one edge of a gap) is passed over, and
    # one that hardly turns its tendon. Where none does more, all have gone the same way.
    counts = rubs & (bound > _NEAR_BOUND)
    turned = (ratio < 0.0) & (ratio <= _NEAR_BOUND - bound)
    let_go = np.nansum(ratio, axis=-1, keepdims=True) < 0.0
    nothing = ~counts.any(axis=-1, keepdims=True)
    waits = np.where(nothing, rubs & ~let_go, counts & ~turned)
    every = np.where(rubs.any(axis=-1), there.sum(axis=-1), 0)
    count = np.where(waits.any(axis=-1), waits.argmax(axis=-1), every)
    at_front = np.minimum(count, ratio.shape[-1] - 1)[..., None]
    own, largest = (
        np.take_along_axis(value, at_front, axis=-1)[..., 0] for value in (ratio, bound)
    )
    holds = waits.any(axis=-1)
    # Friction over its largest at a corner is (1 - rho)/(1 + rho) over the same at the bound.
    part = np.tanh(0.5 * own) / np.tanh(0.5 * np.where(holds, largest, 1.0))
    return count + 1, np.where(holds, part, np.nan)


__all__ = ["friction_front"]
