"""Structural zeros of a chain, which do not depend on its dimensions.

A mode that stretches a rod does not rotate it, whatever the rod's length and width. Such zeros
remain when any number of the robot file changes, so programs omit the products with them. The zeros
of a rod that happens to be straight are not structural.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Array

from notchflex._jax import jax
from notchflex.mechanics.chain.arrays import Chain


def structural(chain: Chain) -> Chain:
    """Mark the numbers of a chain that may be constants of a program.

    They are the strains, rotations and displacements of a rod by its modes, the stiffness between
    modes, counts and flags. The mask of padding flexures is not: chains of other lengths share the
    program.
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
    """Mark the entries over the modes of an array over (1, modes)."""
    return np.broadcast_to(np.arange(np.shape(leaf)[-1]) > 0, np.shape(leaf))


__all__ = ["structural"]
