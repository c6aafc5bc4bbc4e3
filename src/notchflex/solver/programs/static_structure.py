"""Layout of a chain as one vector: its arrays, padding, and constants folded into programs.

A chain has some sixty arrays. Passing them one by one takes longer than solving a small robot; one
vector costs nothing, and a batch of robots is a table of vectors.

A linear step contains mostly zeros, as do the arrays of a rod, whose modes each bend, twist, shear
or stretch it. A program in which these zeros are constants omits the products with them. A chain
with other numbers there needs another program.

A program serves all chains of up to its number of flexures; a shorter chain is padded with inert
flexures. With the base body they fill the processor's vectors: within a vector the added flexures
cost nothing.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from lanewise import WIDTH
from notchflex._arrays import xp
from notchflex._jax import jax
from notchflex.mechanics.chain import Chain, structural


class PytreeLayout:
    """Layout of a tree of arrays in a vector of floats, leaf after leaf."""

    # Layouts are cached: trees of the same structure share one object, so that compiled programs
    # distinguish them by identity.

    _known: ClassVar[dict[Any, PytreeLayout]] = {}

    def __init__(self, structure: Any, shapes: tuple[Any, ...], kinds: tuple[str, ...]) -> None:
        """Lay out leaves of these shapes and kinds of numbers."""
        self.structure, self.shapes, self.kinds = structure, shapes, kinds
        self.ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)]).tolist()
        self.size: int = self.ends[-1]

    @cached_property
    def indices(self) -> list[np.ndarray]:
        """Indices of the numbers of every leaf in a vector, in the shape of the leaf."""
        parts = np.split(np.arange(self.size), self.ends[1:-1])
        return [part.reshape(shape) for part, shape in zip(parts, self.shapes, strict=True)]

    @cached_property
    def starts(self) -> Int[np.ndarray, " numbers"]:
        """Where the leaf begins that each number belongs to."""
        return np.repeat(self.ends[:-1], np.diff(self.ends))

    def __repr__(self) -> str:
        """Return the full content: the key of stored programs."""
        return f"PytreeLayout({self.structure}, {self.shapes}, {self.kinds})"

    @classmethod
    def of(cls, tree: Any) -> PytreeLayout:
        """Return the layout of a tree."""
        leaves, structure = jax.tree.flatten(tree)
        shapes = tuple(np.shape(leaf) for leaf in leaves)
        kinds = tuple(np.dtype(leaf.dtype).kind for leaf in leaves)
        key = (structure, shapes, kinds)
        if key not in cls._known:
            cls._known[key] = cls(*key)
        return cls._known[key]

    def pack(self, tree: Any, leading: int = 0) -> Any:
        """Return the leaves as one vector after leading axes; of NumPy where all leaves are."""
        leaves = self.structure.flatten_up_to(tree)
        arrays = [xp.asarray(leaf) for leaf in leaves]
        flat = [array.reshape(*array.shape[:leading], -1) for array in arrays]
        if len(flat) == 1 and flat[0].dtype == float:
            return flat[0]
        return xp.concatenate(flat, axis=-1, dtype=float)

    def unpack(self, vector: Any) -> Any:
        """Return the tree of a vector (NumPy or JAX), with the vector's leading axes."""
        leaves = [self.leaf(vector, number) for number in range(len(self.shapes))]
        return jax.tree.unflatten(self.structure, leaves)

    def unpack_indices(self) -> Any:
        """Return the tree with the indices of its numbers in a vector in their places."""
        return jax.tree.unflatten(self.structure, self.indices)

    def leaf(self, vector: Any, number: int) -> Any:
        """Return one leaf of the tree of a vector, by its number."""
        part = vector[..., self.ends[number] : self.ends[number + 1]]
        shape = (*vector.shape[:-1], *self.shapes[number])
        return as_kind(part.reshape(shape), self.kinds[number])


def as_kind(values: Array, kind: str) -> Array:
    """Return floats as numbers of a kind of NumPy's."""
    if kind == "b":
        return values != 0.0
    return values.astype(int) if kind in "iu" else values


class StaticStructure:
    """Which numbers of a chain are constants, and the layout of the others in a vector.

    Attributes:
        form: Layout of the whole chain.
        size: Numbers in a vector.
        lanes: Sizes of the axes that run along the chain: its flexures, and its bodies.
    """

    # Constants are zeros that a chain has at every flexure because of how it is made (`structural`
    # in `mechanics/chain.py`), and whole numbers and flags that are the same at every flexure. The
    # others are laid out flexure after flexure, as programs read them. The structure depends on the
    # chain alone, so a chain has the same program whatever was solved before, and in whatever
    # batch.

    _structures: ClassVar[dict[tuple[PytreeLayout, bytes, bytes], StaticStructure]] = {}

    def __init__(
        self,
        form: PytreeLayout,
        flexures: int,
        constant: Bool[np.ndarray, " chain"],
        numbers: Float[np.ndarray, " chain"],
    ) -> None:
        """Store which numbers of a whole chain are constants, and those numbers."""
        self.form, self._constant, self._numbers = form, constant, numbers
        self.lanes = (flexures, flexures + 1)
        rows = [_by_flexure(indices, flexures) for indices in form.indices]
        order = np.concatenate([row.T.ravel() for row in rows])
        self._taken: Int[np.ndarray, " dynamic"] = order[~constant[order]]
        self._index = np.zeros(form.size, int)
        self._index[self._taken] = np.arange(len(self._taken))
        # Padded, so that programs may read whole SIMD vectors up to its end.
        self.size = len(self._taken) + WIDTH

    def __repr__(self) -> str:
        """Return the full content: the key of stored programs."""
        constant = np.packbits(self._constant).tobytes().hex()
        return f"StaticStructure({self.form}, {constant}, {self._numbers[self._constant].tolist()})"

    @classmethod
    def of(
        cls, form: PytreeLayout, chain: Chain, numbers: Float[np.ndarray, " chain"]
    ) -> StaticStructure:
        """Return the structure of a chain; chains with equal structures share one object."""
        flexures, still = chain.flexures, list[int]()
        if chain.rods.turn_pair is not None:
            turns = np.any(chain.rods.turn[..., 1:], axis=(0, 1, 2))
            still = np.flatnonzero(~turns).tolist()
        may_be_constant, floats, first = _comparisons(form, flexures, tuple(still))
        numbers = without_rounding(form, numbers)
        equal = (numbers == numbers[first]) & (~floats | (numbers == 0.0))
        constant = may_be_constant & _all(equal, first)
        # So few structures: a table of whole numbers is constant as a whole.
        constant &= floats | _all(constant, form.starts)
        return cls.shared(form, flexures, constant, numbers)

    @classmethod
    def shared(
        cls,
        form: PytreeLayout,
        flexures: int,
        constant: Bool[np.ndarray, " chain"],
        numbers: Float[np.ndarray, " chain"],
    ) -> StaticStructure:
        """Return the structure of which some numbers are constant; equal ones are one object."""
        constants = np.where(constant, numbers, 0.0)
        key = (form, constant.tobytes(), constants.tobytes())
        if key not in cls._structures:
            cls._structures[key] = cls(form, flexures, constant, constants)
        return cls._structures[key]

    def pack(self, numbers: Any) -> Any:
        """Return the vectors of chains from their packed numbers (NumPy or JAX)."""
        padding = np.zeros((*numbers.shape[:-1], WIDTH))
        return xp.concatenate([numbers[..., self._taken], padding], axis=-1)

    def expand(
        self, vectors: Float[np.ndarray, "*k dynamic"], *, constants: bool = False
    ) -> Float[np.ndarray, "*k chain"]:
        """Return packed numbers of whole chains, with the constants or, for slopes, 0 for them."""
        numbers = np.zeros((*vectors.shape[:-1], self.form.size))
        if constants:
            numbers[:] = self._numbers
        numbers[..., self._taken] = vectors[..., : len(self._taken)]
        return numbers

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
        constant = self._constant[indices]
        if constant.all():
            return xp.asarray(self._numbers[indices])
        values = xp.take(vector, self._index[indices], mode="clip")  # all are inside
        return xp.where(constant, self._numbers[indices], values) if constant.any() else values


def without_rounding(
    form: PytreeLayout, numbers: Float[np.ndarray, " chain"]
) -> Float[np.ndarray, " chain"]:
    """Return packed numbers, 0 where only rounding errors differ from 0."""
    size, largest = np.abs(numbers), np.zeros(len(numbers))
    np.maximum.at(largest, form.starts, np.where(np.isfinite(size), size, 0.0))
    return np.where(size <= 1e-14 * largest[form.starts], 0.0, numbers)


@lru_cache(maxsize=64)
def _comparisons(
    form: PytreeLayout, flexures: int, still: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which numbers may be constants, which are floats, and the first of each column."""
    first = np.arange(form.size)
    for indices in form.indices:
        rows = _by_flexure(indices, flexures)
        first[rows] = rows[:1]
    floats = np.repeat([kind == "f" for kind in form.kinds], np.diff(form.ends))
    may_be_constant = form.pack(structural(form.unpack(first.astype(float)), still)) > 0.0
    return may_be_constant, floats, first


def _all(values: Bool[np.ndarray, " n"], group: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return for each value whether all of its group are true."""
    wrong = np.zeros(len(values), bool)
    wrong[group[~values]] = True
    return ~wrong[group]


def _by_flexure(indices: np.ndarray, flexures: int) -> np.ndarray:
    """Arrange the indices of an array with a row per flexure or body, or else one row."""
    along = indices.ndim > 0 and len(indices) in (flexures, flexures + 1)
    return indices.reshape(len(indices) if along else 1, -1)


# Above a number of bodies (left), numbers of bodies are multiples of the right number.
_STEPS = ((0, WIDTH), (2 * WIDTH, 2 * WIDTH), (16 * WIDTH, 4 * WIDTH), (32 * WIDTH, 8 * WIDTH))


def capacity(flexures: int) -> int:
    """Return the number of flexures that a program for some flexures is compiled for.

    Example:
        >>> [capacity(flexures) for flexures in (1, 5, 8, 27, 40, 100)]
        [7, 7, 15, 31, 47, 111]
    """
    bodies = flexures + 1
    step = max(multiple for start, multiple in _STEPS if bodies > start)
    return -(-bodies // step) * step - 1


@lru_cache(maxsize=256)
def padded_indices(unpadded: PytreeLayout, long: PytreeLayout) -> Int[np.ndarray, " own"]:
    """Return where the numbers of a layout are in that of a chain with more flexures at the tip."""
    indices = [
        padded[tuple(slice(size) for size in part.shape)].ravel()
        for part, padded in zip(unpadded.indices, long.indices, strict=True)
    ]
    return np.concatenate([np.zeros(0, int), *indices])


def pad_rows(
    rows: Float[np.ndarray, "*s own"], unpadded: PytreeLayout, long: PytreeLayout
) -> Float[np.ndarray, "*s long"]:
    """Return rows of a layout as those of a longer chain, 0 for the flexures added."""
    if unpadded is long:
        return rows
    padded = np.zeros((*rows.shape[:-1], long.size))
    padded[..., padded_indices(unpadded, long)] = rows
    return padded
