"""Which zeros of a chain belong to how its parts are made, and not to their dimensions.

A mode that stretches a rod does not turn it, whatever the rod's length and width. Such zeros stay
when any number of the robot file changes, and programs that know them leave out what they would be
multiplied by. A rod that happens to be straight is another matter.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Array

from notchflex._jax import jax
from notchflex.mechanics.chain.arrays import Chain


def structural(chain: Chain) -> Chain:
    """For every number of a chain whether it may be taken for known when a program is made.

    Which flexures only lengthen the chain is not: chains of other lengths share the program. Known
    are how modes strain, turn and move a rod, how they hold each other, and all that counts
    or tells kinds apart.
    """

    def counts(leaf: Any) -> Any:
        return np.full(np.shape(leaf), np.asarray(leaf).dtype.kind != "f")

    plain: Chain = jax.tree.map(counts, chain)
    rods = chain.rods
    pairs = None
    if rods.turn_pair is not None:
        pairs = _of_modes(rods.turn_pair) & np.swapaxes(_of_modes(rods.turn_pair), -1, -2)
    return replace(
        plain,
        rods=replace(
            plain.rods,
            basis=_all(rods.basis),
            node_reach=_all(rods.node_reach),
            turn=_of_modes(rods.turn),
            turn_pair=pairs,
            step=_of_modes(rods.step),
            node_turn=_of_modes(rods.node_turn),
        ),
        elastic=None if chain.elastic is None else _all(chain.elastic),
    )


def _all(leaf: Array) -> Any:
    return np.full(np.shape(leaf), True)


def _of_modes(leaf: Array) -> Any:
    """What of an array over (1, modes) is over the modes, and not of the free rod."""
    return np.broadcast_to(np.arange(np.shape(leaf)[-1]) > 0, np.shape(leaf))


__all__ = ["structural"]
