"""Many arrays as one: what goes into a compiled program, and what comes out of it.

A chain has some sixty arrays. Handed over one by one they take longer than the solution of a small
robot; as one vector they cost nothing, robots of one form differ only in its numbers, and a batch
of robots is a table of them.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Array

from notchflex._jax import array_module, jax


class Form:
    """How a tree of arrays is laid out in a vector of floats.

    Forms are kept: trees of the same make have the very same form, so that compiled programs tell
    them apart by identity.
    """

    _known: ClassVar[dict[Any, Form]] = {}

    def __init__(self, structure: Any, shapes: tuple[Any, ...], kinds: tuple[str, ...]) -> None:
        """Lay out leaves of given shapes and kinds of numbers one after the other."""
        self.structure, self.shapes, self.kinds = structure, shapes, kinds
        sizes = [int(np.prod(shape)) for shape in shapes]
        self.ends = np.cumsum(sizes)[:-1].tolist()
        self.size = sum(sizes)
        self._parts = tuple(map(slice, [0, *self.ends], [*self.ends, self.size]))

    @cached_property
    def places(self) -> list[np.ndarray]:
        """Where the numbers of every leaf are in a vector, in the shape of the leaf."""
        parts = np.split(np.arange(self.size), self.ends)
        return [part.reshape(shape) for part, shape in zip(parts, self.shapes, strict=True)]

    def __repr__(self) -> str:
        """Tell all of it: kept programs are found by this."""
        return f"Form({self.structure}, {self.shapes}, {self.kinds})"

    @classmethod
    def of(cls, tree: Any) -> Form:
        """The form of a tree."""
        leaves, structure = jax.tree.flatten(tree)
        shapes = tuple(np.shape(leaf) for leaf in leaves)
        kinds = tuple(np.dtype(leaf.dtype).kind for leaf in leaves)
        key = (structure, shapes, kinds)
        if key not in cls._known:
            cls._known[key] = cls(*key)
        return cls._known[key]

    def pack(self, tree: Any, leading: int = 0) -> Any:
        """The leaves of a tree as one vector, or one per entry of so many leading axes.

        A vector of NumPy where all leaves are plain.
        """
        leaves = self.structure.flatten_up_to(tree)
        xp = array_module(*leaves)
        arrays = [xp.asarray(leaf) for leaf in leaves]
        flat = [array.reshape(*array.shape[:leading], -1) for array in arrays]
        return xp.concatenate(flat, axis=-1, dtype=float)

    def unpack(self, vector: Any) -> Any:
        """The tree of a vector (NumPy's or JAX's), with the vector's leading axes."""
        leaves = [self.leaf(vector, number) for number in range(len(self.shapes))]
        return jax.tree.unflatten(self.structure, leaves)

    def leaf(self, vector: Any, number: int) -> Any:
        """One leaf of the tree of a vector alone, by its number."""
        part = vector[..., self._parts[number]]
        shape = (*vector.shape[:-1], *self.shapes[number])
        return as_kind(part.reshape(shape), self.kinds[number])


def lane_sizes(chain_form: Form, *_others: Any) -> tuple[int, int]:
    """Sizes of the axes that run along the chain: as many flexures, and bodies, as it has."""
    one = jax.ShapeDtypeStruct((chain_form.size,), float)
    chain = jax.eval_shape(chain_form.unpack, one)
    return chain.flexures, chain.flexures + 1


def as_kind(values: Array, kind: str) -> Array:
    """Floats as numbers of their own kind."""
    if kind == "b":
        return values != 0.0
    return values.astype(int) if kind in "iu" else values


__all__ = ["Form", "as_kind", "lane_sizes"]
