"""Lay arrays out in buffers: read them as references, store references to them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from lanewise.ir.control_flow import WIDTH, Store
from lanewise.ir.graph import LANE_BITS, Block, Buffer, References, reference
from lanewise.lowering.arrays import ArrayLowering

Layout = tuple[Buffer, np.ndarray]
"""A buffer, and the position in it of every entry of an array."""


class BufferLayout:
    """Find buffers for arrays.

    Args:
        arrays: Lowers operations on arrays.

    Attributes:
        batched: Whether rows of a batch are lowered at present.
    """

    def __init__(self, arrays: ArrayLowering) -> None:
        """Hold the graph."""
        self.graph, self.arrays = arrays.graph, arrays
        self.batched = False

    def positions(self, shape: tuple[int, ...]) -> tuple[int, np.ndarray]:
        """Return how many entries a buffer for an array has, and the position of each entry.

        Rows along the lane axis are contiguous, each padded to whole vectors.
        """
        axis = self.arrays.lane_axis(shape)
        count = int(np.prod(shape))
        if axis is None or len(shape) == 1:
            return count, np.arange(count).reshape(shape)
        size = shape[axis]
        padded = size if self.batched else -(-size // WIDTH) * WIDTH
        others = count // size
        positions = np.arange(others)[:, None] * padded + np.arange(size)
        rest = [length for a, length in enumerate(shape) if a != axis]
        return others * padded, np.moveaxis(positions.reshape(*rest, size), -1, axis)

    def stacked(self, shape: tuple[int, ...], length: int) -> tuple[int, np.ndarray]:
        """Return the same for arrays of one shape, one for each step of a loop.

        Steps along a lane axis are rows, so that what reads or writes all steps takes vectors. In a
        batch, where vectors are those of its rows anyway, each step's array is contiguous.

        Args:
            shape: Shape of the array of one step.
            length: Number of steps, the leading axis of the positions that are returned.
        """
        along_lanes = not self.batched and length in self.arrays.lane_sizes
        if along_lanes and self.arrays.lane_axis(shape) is None:
            return self.positions((length, *shape))
        size, positions = self.positions(shape)
        starts = np.arange(length).reshape(-1, *(1,) * positions.ndim) * size
        return size * length, starts + positions

    def allocate(self, shape: tuple[int, ...], kind: str) -> Layout:
        """Return a new buffer in the arena for an array."""
        size, positions = self.positions(shape)
        return Buffer("arena", size, batched=self.batched, kind=kind), positions

    def read(self, layout: Layout, block: Block) -> References:
        """Return the array that a buffer holds, as a block sees it."""
        buffer, positions = layout
        node = self.graph.add_buffer(buffer, block)
        return self.as_rows(reference(node) + positions.astype(np.int64))

    def as_rows(self, refs: References) -> References:
        """Return the same entries, those in buffers loaded as rows if there is a lane axis."""
        return self.arrays.loaded(refs) if self._has_rows(refs.shape) else refs

    def _has_rows(self, shape: tuple[int, ...]) -> bool:
        return len(shape) > 1 and self.arrays.lane_axis(shape) is not None

    def store(self, refs: References, layout: Layout) -> Store:
        """Return the store of an array to a buffer, in rows as the buffer has them."""
        buffer, positions = layout
        refs = np.broadcast_to(refs, positions.shape)
        row = 0
        if self._has_rows(positions.shape):
            axis = self.arrays.lane_axis(positions.shape)
            refs = self.arrays.rows(self.arrays.loaded(refs), axis)
            row = positions.shape[axis or 0]
        return Store(refs.ravel(), buffer, positions.ravel(), row)

    def store_results(
        self, results: Sequence[References], buffer: Callable[[int, int], Buffer]
    ) -> list[Store]:
        """Return the stores of results as vectors of floats, each to a buffer of its own.

        Args:
            results: Arrays.
            buffer: Returns the buffer for the number of a result and its size.
        """
        stores: list[Store] = []
        for number, refs in enumerate(results):
            flat = refs.ravel()
            if {self.graph.kind[node] for node in np.unique(flat >> LANE_BITS).tolist()} - {"f"}:
                flat = self.arrays.elementwise("to_float", flat)
            stores.append(Store(flat, buffer(number, flat.size), np.arange(flat.size)))
        return stores
