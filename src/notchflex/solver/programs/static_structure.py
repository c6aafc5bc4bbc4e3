"""Structural constants of a chain, folded into its program when it is compiled.

A linear step contains mostly zeros, as do the arrays of a rod, whose modes each bend, twist, shear
or stretch it. A program in which these zeros are constants omits the products with them. A chain
with other numbers there needs another program.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex._jax import array_module, jax
from notchflex.mechanics.chain import Chain, structural
from notchflex.solver.programs.pytree_layout import PytreeLayout, as_kind

# Padding at the end of the vector, so that programs may read whole SIMD vectors up to its end.
_PADDING = 8


class StaticStructure:
    """Which numbers of a chain are constants, and the layout of the others in a vector.

    Constants are zeros that a chain has at every flexure because of how it is made
    (`mechanics/chain/structure.py`), and whole numbers and flags that are the same at every
    flexure. The others are laid out flexure after flexure, as programs read them.

    Structures are cached, like those of `PytreeLayout`.

    Attributes:
        form: Layout of the whole chain.
        size: Numbers in a vector.
    """

    _structures: ClassVar[dict[PytreeLayout, list[StaticStructure]]] = {}

    def __init__(
        self,
        form: PytreeLayout,
        flexures: int,
        constant: Bool[np.ndarray, " chain"],
        numbers: Float[np.ndarray, " chain"],
    ) -> None:
        """Store which numbers of a whole chain are constants, and those numbers."""
        self.form, self._constant, self._numbers = form, constant, np.where(constant, numbers, 0.0)
        rows = [_by_flexure(indices, flexures) for indices in form.indices]
        order = np.concatenate([row.T.ravel() for row in rows])
        self._taken: Int[np.ndarray, " dynamic"] = order[~constant[order]]
        self._index = np.zeros(form.size, int)
        self._index[self._taken] = np.arange(len(self._taken))
        self.size = len(self._taken) + _PADDING

    def __repr__(self) -> str:
        """Return the full content: the key of stored programs."""
        constant = np.packbits(self._constant).tobytes().hex()
        return f"StaticStructure({self.form}, {constant}, {self._numbers[self._constant].tolist()})"

    @classmethod
    def of(
        cls, form: PytreeLayout, chains: Sequence[Chain], numbers: Float[np.ndarray, "k chain"]
    ) -> StaticStructure:
        """Return a structure that fits some chains, a cached one if possible.

        A new structure has only constants that the cached ones share, so it fits their chains as
        well: robots that differ a little soon share a program.

        Args:
            form: Layout of the whole chains.
            chains: The chains.
            numbers: The chains, packed whole.
        """
        others = cls._structures.setdefault(form, [])
        fitting = [one for one in others if one._fits(numbers)]
        if not fitting:
            flexures = chains[0].flexures
            constant = form.pack(structural(chains[0])) > 0.0
            for indices, kind in zip(form.indices, form.kinds, strict=True):
                rows = _by_flexure(indices, flexures)
                constant[rows] &= _same(numbers[:, rows], kind)
            for one in others:
                constant &= one._constant & (one._numbers == numbers[0])
            if others:
                for indices, kind in zip(form.indices, form.kinds, strict=True):
                    if kind != "f":  # integer tables that differ are constant nowhere
                        constant[indices] = constant[indices].all()
            fitting = [cls(form, flexures, constant, numbers[0])]
            others += fitting
        return min(fitting, key=lambda one: one.size)

    def _fits(self, numbers: Float[np.ndarray, "k chain"]) -> bool:
        return bool((numbers[:, self._constant] == self._numbers[self._constant]).all())

    def pack(self, numbers: Any) -> Any:
        """Return the vectors of chains from their packed numbers (NumPy or JAX)."""
        xp = array_module(numbers)
        padding = np.zeros((*numbers.shape[:-1], _PADDING))
        return xp.concatenate([numbers[..., self._taken], padding], axis=-1)

    def indices_of(self, indices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        """Return the indices in a vector of numbers of the whole chain; constants map to a zero."""
        return np.where(self._constant[indices], self.size - 1, self._index[indices])

    def unpack(self, vector: Any) -> Any:
        """Return the chain of a vector."""
        leaves = [
            as_kind(self._leaf(vector, indices), kind)
            for indices, kind in zip(self.form.indices, self.form.kinds, strict=True)
        ]
        return jax.tree.unflatten(self.form.structure, leaves)

    def _leaf(self, vector: Any, indices: Int[np.ndarray, ...]) -> Any:
        constant, xp = self._constant[indices], array_module(vector)
        if constant.all():
            return xp.asarray(self._numbers[indices])
        values = xp.take(vector, self._index[indices], mode="clip")  # all are inside
        return xp.where(constant, self._numbers[indices], values) if constant.any() else values


def _same(values: Float[np.ndarray, "k rows columns"], kind: str) -> Bool[np.ndarray, " columns"]:
    """Return which numbers are equal at every flexure of every chain; for floats, which are 0."""
    same = (values == values[:1, :1]).all(axis=(0, 1))
    return same & (values[0, 0] == 0.0) if kind == "f" else same


def _by_flexure(indices: np.ndarray, flexures: int) -> np.ndarray:
    """Arrange the indices of an array with a row per flexure or body, or else one row."""
    along = indices.ndim > 0 and len(indices) in (flexures, flexures + 1)
    return indices.reshape(len(indices) if along else 1, -1)


__all__ = ["StaticStructure"]
