"""Structural constants of a chain, folded into its program when it is compiled.

A linear step is mostly padded with zeros; so are the arrays of a rod, whose modes each bend, twist,
shear or stretch it. A program that knows these zeros leaves out what they would be multiplied by.
A chain with other numbers in their place needs a program of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex._jax import array_module, jax
from notchflex.mechanics.chain import Chain, structural
from notchflex.solver.programs.pytree_layout import PytreeLayout, as_kind

# Numbers behind those of the vector, so that programs may read whole vectors up to its end.
_BEHIND = 8


class StaticStructure:
    """Which numbers of a chain are constants, and the layout of the others in a vector.

    Constants are zeros that a chain has at every flexure because of how it is made
    (`mechanics/chain/structure.py`), and whole numbers and flags that are the same at every
    flexure. The others are laid out flexure after flexure, as programs read them.

    Structures are kept, as `PytreeLayout` keeps its own.

    Attributes:
        form: Layout of the whole chain.
        size: Numbers in a vector.
    """

    _found: ClassVar[dict[PytreeLayout, list[StaticStructure]]] = {}

    def __init__(
        self,
        form: PytreeLayout,
        flexures: int,
        known: Bool[np.ndarray, " chain"],
        numbers: Float[np.ndarray, " chain"],
    ) -> None:
        """Take which numbers of a whole chain are constants, and those numbers."""
        self.form, self._known, self._numbers = form, known, np.where(known, numbers, 0.0)
        rows = [_by_flexure(indices, flexures) for indices in form.indices]
        order = np.concatenate([row.T.ravel() for row in rows])
        self._taken: Int[np.ndarray, " dynamic"] = order[~known[order]]
        self._index = np.zeros(form.size, int)
        self._index[self._taken] = np.arange(len(self._taken))
        self.size = len(self._taken) + _BEHIND

    def __repr__(self) -> str:
        """Return all of it: kept programs are found by this."""
        known = np.packbits(self._known).tobytes().hex()
        return f"StaticStructure({self.form}, {known}, {self._numbers[self._known].tolist()})"

    @classmethod
    def of(
        cls, form: PytreeLayout, chains: Sequence[Chain], numbers: Float[np.ndarray, "k chain"]
    ) -> StaticStructure:
        """Return a structure that serves for some chains: a known one, if any does.

        A new one beside others has only constants that they have too: it serves for their chains
        as well, so that robots that differ a little soon share a program.

        Args:
            form: Layout of the whole chains.
            chains: The chains.
            numbers: The same packed whole.
        """
        others = cls._found.setdefault(form, [])
        fitting = [one for one in others if one._fits(numbers)]
        if not fitting:
            flexures = chains[0].flexures
            known = form.pack(structural(chains[0])) > 0.0
            for indices, kind in zip(form.indices, form.kinds, strict=True):
                rows = _by_flexure(indices, flexures)
                known[rows] &= _same(numbers[:, rows], kind)
            for one in others:
                known &= one._known & (one._numbers == numbers[0])
            if others:
                for indices, kind in zip(form.indices, form.kinds, strict=True):
                    if kind != "f":  # tables of whole numbers that differ do so in ever other cells
                        known[indices] = known[indices].all()
            fitting = [cls(form, flexures, known, numbers[0])]
            others += fitting
        return min(fitting, key=lambda one: one.size)

    def _fits(self, numbers: Float[np.ndarray, "k chain"]) -> bool:
        return bool((numbers[:, self._known] == self._numbers[self._known]).all())

    def pack(self, numbers: Any) -> Any:
        """Return the vectors of chains that are packed whole (NumPy's or JAX's)."""
        xp = array_module(numbers)
        behind = np.zeros((*numbers.shape[:-1], _BEHIND))
        return xp.concatenate([numbers[..., self._taken], behind], axis=-1)

    def indices_of(self, indices: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        """Return where a vector holds numbers of the whole chain; constants at its end, a 0."""
        return np.where(self._known[indices], self.size - 1, self._index[indices])

    def unpack(self, vector: Any) -> Any:
        """Return the chain of a vector."""
        leaves = [
            as_kind(self._leaf(vector, indices), kind)
            for indices, kind in zip(self.form.indices, self.form.kinds, strict=True)
        ]
        return jax.tree.unflatten(self.form.structure, leaves)

    def _leaf(self, vector: Any, indices: Int[np.ndarray, ...]) -> Any:
        known, xp = self._known[indices], array_module(vector)
        if known.all():
            return xp.asarray(self._numbers[indices])
        values = xp.take(vector, self._index[indices], mode="clip")  # all are inside
        return xp.where(known, self._numbers[indices], values) if known.any() else values


def _same(values: Float[np.ndarray, "k rows columns"], kind: str) -> Bool[np.ndarray, " columns"]:
    """Which numbers are the same at every flexure of every chain; of floats, which are zero."""
    same = (values == values[:1, :1]).all(axis=(0, 1))
    return same & (values[0, 0] == 0.0) if kind == "f" else same


def _by_flexure(indices: np.ndarray, flexures: int) -> np.ndarray:
    """Indices of an array with a row for every flexure or body where there is one, else one row."""
    along = indices.ndim > 0 and len(indices) in (flexures, flexures + 1)
    return indices.reshape(len(indices) if along else 1, -1)


__all__ = ["StaticStructure"]
