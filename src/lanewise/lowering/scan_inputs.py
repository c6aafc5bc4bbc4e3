"""Find what one step of a scan sees of the arrays that it runs along.

Entry by entry an array is the same at every step, moves through a buffer by a constant stride, or
neither. The first costs nothing, the second a pointer; only the third is copied to memory before
the loop. Structural zeros stay known inside the loop, and arguments are read in place.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lanewise.ir.control_flow import Store
from lanewise.ir.graph import LANE_BITS, LANE_MASK, Block, Buffer, Graph, References, reference
from lanewise.lowering.buffers import BufferLayout


@dataclass
class ScanInputs:
    """Collect what a scan needs of its input arrays.

    Attributes:
        buffers: Lays out arrays in memory.
        body: The block of the loop.
        length: Number of steps.
        initial: Stores before the loop.
        slices: Buffers of the present step.
        inputs: References into the buffers that these are slices of.
    """

    buffers: BufferLayout
    body: Block
    length: int
    initial: list[Store] = field(default_factory=list[Store])
    slices: list[Buffer] = field(default_factory=list[Buffer])
    inputs: list[int] = field(default_factory=list[int])

    def present(self, refs: References) -> References:
        """Return the entries of the present step.

        Args:
            refs: Entries, steps as leading axis.
        """
        graph = self.buffers.graph
        rows = _without_loads(graph, refs).reshape(self.length, -1)
        first = rows[0]
        result = first.copy()
        steps = rows[1:] - rows[:-1]
        moving = np.flatnonzero((steps != 0).any(axis=0))
        if moving.size:
            stride = steps[0, moving]
            even = (steps[:, moving] == stride).all(axis=0)
            even &= (stride > 0) & (stride < LANE_MASK >> 1)
            even &= graph.length[first[moving] >> LANE_BITS] == 0
            groups = (first[moving] >> LANE_BITS) * (LANE_MASK + 1) + stride
            for group in np.unique(groups[even]):
                members = moving[even & (groups == group)]
                result[members] = self._strided(first[members], int(steps[0, members[0]]))
            rest = moving[~even]
            if rest.size:
                result[rest] = self._copied(self.buffers.arrays.loaded(rows[:, rest]))
        return result.reshape(refs.shape[1:])

    def _strided(self, first: References, stride: int) -> References:
        """Return the entries of a buffer that advances by a stride."""
        graph = self.buffers.graph
        whole: Buffer = graph.args[int(first[0]) >> LANE_BITS][0]
        lanes = first & LANE_MASK
        start = int(lanes.min())
        size = int(lanes.max()) - start + 1
        own = Buffer("slice", size, whole, start, whole.batched, whole.kind, stride, self.length)
        self.slices.append(own)
        self.inputs.append(int(first[0]))
        return reference(graph.add_buffer(own, self.body)) + lanes - start

    def _copied(self, refs: References) -> References:
        """Return the entries of an array that is copied to memory before the loop."""
        graph = self.buffers.graph
        kind, batched = graph.kind[int(refs[0, 0]) >> LANE_BITS], self.buffers.batched
        size, positions = self.buffers.stacked((refs.shape[1],), self.length)
        whole = Buffer("arena", size, batched=batched, kind=kind)
        row = self.length if size > positions.size else 0
        self.initial.append(Store(refs.T.ravel(), whole, positions.T.ravel(), row))
        own = slice_of(whole, positions)
        self.slices.append(own)
        return reference(graph.add_buffer(own, self.body)) + positions[0]


def slice_of(whole: Buffer, positions: np.ndarray) -> Buffer:
    """Return what one step of a loop sees of a buffer.

    Args:
        whole: The buffer.
        positions: Position in it of every entry, steps as leading axis.
    """
    steps, size = len(positions), int(positions[0].max(initial=0)) + 1
    strides = np.diff(positions, axis=0).ravel()
    stride = int(strides[0]) if strides.size else size
    return Buffer("slice", size, whole, 0, whole.batched, whole.kind, stride, steps)


def _without_loads(graph: Graph, refs: References) -> References:
    """Return the same entries; lanes of loads as entries of the buffers they were loaded from."""
    flat = refs.ravel()
    nodes = flat >> LANE_BITS
    result = flat.copy()
    for node in np.unique(nodes).tolist():
        if graph.op[node] == "load":
            buffer, first, stride, _ = graph.args[node]
            own = nodes == node
            result[own] = reference(buffer, first) + (flat[own] & LANE_MASK) * stride
    return result.reshape(refs.shape)
