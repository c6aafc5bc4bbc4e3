"""Layout of many arrays as one vector: arguments and results of compiled programs.

A chain has some sixty arrays. Passing them one by one takes longer than solving a small robot; one
vector costs nothing, and a batch of robots is a table of vectors.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Array

from notchflex._jax import array_module, jax


class PytreeLayout:
    """Layout of a tree of arrays in a vector of floats, leaf after leaf.

    Layouts are cached: trees of the same structure share one object, so that compiled programs
    distinguish them by identity.
    """

    _known: ClassVar[dict[Any, PytreeLayout]] = {}

    def __init__(self, structure: Any, shapes: tuple[Any, ...], kinds: tuple[str, ...]) -> None:
        """Lay out leaves of these shapes and kinds of numbers."""
        self.structure, self.shapes, self.kinds = structure, shapes, kinds
        self._ends = np.cumsum([0, *(int(np.prod(shape)) for shape in shapes)]).tolist()
        self.size: int = self._ends[-1]

    @cached_property
    def indices(self) -> list[np.ndarray]:
        """Indices of the numbers of every leaf in a vector, in the shape of the leaf."""
        parts = np.split(np.arange(self.size), self._ends[1:-1])
        return [part.reshape(shape) for part, shape in zip(parts, self.shapes, strict=True)]

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
        """Return the leaves of a tree as one vector, with a number of leading axes.

        It is a NumPy vector where all leaves are NumPy arrays.
        """
        leaves = self.structure.flatten_up_to(tree)
        xp = array_module(*leaves)
        arrays = [xp.asarray(leaf) for leaf in leaves]
        flat = [array.reshape(*array.shape[:leading], -1) for array in arrays]
        if len(flat) == 1 and flat[0].dtype == float:
            return flat[0]
        return xp.concatenate(flat, axis=-1, dtype=float)

    def unpack(self, vector: Any) -> Any:
        """Return the tree of a vector (NumPy or JAX), with the vector's leading axes."""
        leaves = [self.leaf(vector, number) for number in range(len(self.shapes))]
        return jax.tree.unflatten(self.structure, leaves)

    def leaf(self, vector: Any, number: int) -> Any:
        """Return one leaf of the tree of a vector, by its number."""
        part = vector[..., self._ends[number] : self._ends[number + 1]]
        shape = (*vector.shape[:-1], *self.shapes[number])
        return as_kind(part.reshape(shape), self.kinds[number])


def lane_sizes(chain_layout: PytreeLayout, *_others: Any) -> tuple[int, int]:
    """Return the sizes of the axes that run along the chain: its flexures, and its bodies."""
    one = jax.ShapeDtypeStruct((chain_layout.size,), float)
    chain = jax.eval_shape(chain_layout.unpack, one)
    return chain.flexures, chain.flexures + 1


def as_kind(values: Array, kind: str) -> Array:
    """Return floats as numbers of a kind of NumPy's."""
    if kind == "b":
        return values != 0.0
    return values.astype(int) if kind in "iu" else values


__all__ = ["PytreeLayout", "as_kind", "lane_sizes"]
