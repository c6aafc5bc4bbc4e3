"""Lower operations on whole arrays: which nodes they need, and which lane is which entry.

An elementwise operation needs one node for every set of rows that meet lane by lane. Where the
lanes of its operands do not match, the operands are first shuffled into rows along one axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lanewise.ir.graph import LANE_BITS, LANE_MASK, Graph, References, reference
from lanewise.lowering.folding import NodeBuilder

# Rows of which a smaller share of lanes is used are not computed as a whole.
_DENSE = 0.6


class ArrayLowering:
    """Turn operations on arrays of references into nodes.

    Args:
        graph: The graph.
        lane_sizes: Sizes of axes along which rows are laid out, such as the number of bodies.
    """

    def __init__(self, graph: Graph, lane_sizes: Sequence[int]) -> None:
        """Hold the graph."""
        self.graph = graph
        self.lane_sizes = tuple(size for size in lane_sizes if size > 1)
        self.nodes = NodeBuilder(graph)

    def constant(self, values: Any) -> References:
        """Return an array of known numbers."""
        values = np.asarray(values)
        kind = "b" if values.dtype == bool else "f" if values.dtype.kind == "f" else "i"
        if not values.size:
            return _empty(values.shape)
        distinct, where = np.unique(values.ravel(), return_inverse=True)
        made = [reference(self.graph.constant(one, kind)) for one in distinct]
        return np.array(made, np.int64)[where.ravel()].reshape(values.shape)

    def known(self, refs: References) -> np.ndarray | None:
        """Return the numbers of an array if all of them are known."""
        flat = [self._known(int(one)) for one in refs.ravel()]
        if any(value is None for value in flat):
            return None
        return np.array(flat).reshape(refs.shape) if flat else np.zeros(refs.shape, int)

    def _known(self, ref: int) -> Any:
        node = ref >> LANE_BITS
        if self.graph.op[node] == "constants":
            return self.graph.args[node][0][ref & LANE_MASK]
        return self.graph.number[node]

    def _constant_row(self, row: np.ndarray, kind: str) -> int:
        if (row == row[0]).all():  # signs of known zeros do not count
            return self.graph.constant(row[0], kind)
        key = (row.tobytes(), len(row))
        return self.graph.intern("constants", (row,), len(row), kind, self.graph.top, key=key)

    def lane_axis(self, shape: tuple[int, ...]) -> int | None:
        """Return the first axis along which rows are laid out; None if there is none."""
        return next((axis for axis, size in enumerate(shape) if size in self.lane_sizes), None)

    def loaded(self, refs: References) -> References:
        """Return the same entries with those in buffers loaded, as rows along a lane axis.

        Args:
            refs: Entries, some of them of buffers.
        """
        flat = refs.ravel()
        if not flat.size:
            return refs
        in_buffer = self.graph.length[flat >> LANE_BITS] == 0
        if not in_buffer.any():
            return refs
        axis = self.lane_axis(refs.shape)
        if axis is None:
            return self._load_each(refs, in_buffer)
        rows = np.moveaxis(refs, axis, -1)
        out = rows.reshape(-1, rows.shape[-1]).copy()
        strides = np.diff(out, axis=1)
        stored = np.moveaxis(in_buffer.reshape(refs.shape), axis, -1).reshape(out.shape)
        strided = (strides == strides[:, :1]).all(axis=1) & stored.all(axis=1)
        strided &= (out[:, 0] >> LANE_BITS) == (out[:, -1] >> LANE_BITS)
        strided &= strides[:, 0] != 0
        for number in np.flatnonzero(strided):
            node = self._load(int(out[number, 0]), int(strides[number, 0]), out.shape[1])
            out[number] = (node << LANE_BITS) + np.arange(out.shape[1])
        rest = ~strided[:, None] & stored
        if rest.any():
            out = self._load_each(out, rest.ravel())
        return np.moveaxis(out.reshape(rows.shape), -1, axis)

    def _load_each(self, refs: References, in_buffer: np.ndarray) -> References:
        flat = refs.ravel().copy()
        distinct, where = np.unique(flat[in_buffer], return_inverse=True)
        loads = [reference(self._load(int(one), 0, 1)) for one in distinct]
        flat[in_buffer] = np.array(loads, np.int64)[where.ravel()]
        return flat.reshape(refs.shape)

    def _load(self, first: int, stride: int, length: int) -> int:
        graph, buffer = self.graph, first >> LANE_BITS
        args = (buffer, first & LANE_MASK, stride, length)
        return graph.intern("load", args, length, graph.kind[buffer], graph.placement((buffer,)))

    def elementwise(self, op: str, *arrays: References) -> References:
        """Apply an operation lane by lane; arrays are of one shape, or single numbers."""
        shape = np.broadcast_shapes(*(refs.shape for refs in arrays))
        if 0 in shape:
            return _empty(shape)
        flat = [np.broadcast_to(self.loaded(refs), shape).reshape(-1) for refs in arrays]
        every = np.array(flat)
        columns = self._matching(every)
        if columns is None:
            operands = [refs.reshape(shape) for refs in flat]
            axis = self._best_axis(operands)
            every = np.array([self.rows(refs, axis).reshape(-1) for refs in operands])
            columns = _distinct_columns(every >> LANE_BITS)
        first, where = columns
        nodes = (every[:, first] >> LANE_BITS).T.tolist()
        results = np.array([self.nodes.make(op, tuple(column)) for column in nodes], np.int64)
        wide = (self.graph.length[results] > 1)[where]
        lanes = np.where(wide, (every & LANE_MASK).max(axis=0), 0)
        return ((results[where] << LANE_BITS) + lanes).reshape(shape)

    def _matching(self, every: References) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the sets of rows of operands that meet, as `_distinct_columns`.

        None where they do not meet in the same lanes or most of their lanes are not used.
        """
        nodes, lanes = every >> LANE_BITS, every & LANE_MASK
        lengths = self.graph.length[nodes]
        longest = lengths.max(axis=0)
        columns = _distinct_columns(nodes)
        if longest.max() == 1:
            return columns
        lane = lanes.max(axis=0)
        if ((lengths > 1) & ((lengths != longest) | (lanes != lane))).any():
            return None
        # Of every set of rows that meet: is the share of lanes in use large enough?
        first, where = columns
        used = {*zip(where.tolist(), lane.tolist(), strict=True)}
        counts = np.bincount([row for row, _ in used], minlength=len(first))
        return columns if (counts >= _DENSE * longest[first]).all() else None

    def _best_axis(self, operands: list[References]) -> int | None:
        """Return the axis along which most entries go from lane to lane."""
        best_score, best = 0.0, None
        shape = operands[0].shape
        for axis, size in enumerate(shape):
            if size < 2:
                continue
            score = 0.0
            for refs in operands:
                if (self.graph.length[refs >> LANE_BITS] == 1).all():
                    continue
                steps = np.abs(np.diff(refs, axis=axis))
                score += float(np.mean((steps > 0) & (steps < LANE_MASK >> 1)))
            tie = score == best_score > 0.0 and size > shape[best or 0]
            if score > best_score + 1e-12 or tie:
                best_score, best = score, axis
        return best

    def rows(self, refs: References, axis: int | None) -> References:
        """Return the same entries in rows of their own along an axis; as single numbers if None.

        Args:
            refs: Entries, none of buffers.
            axis: The axis.
        """
        if axis is None:
            distinct, where = np.unique(refs.ravel(), return_inverse=True)
            single = [reference(self.shuffle((int(one),))) for one in distinct]
            return np.array(single, np.int64)[where.ravel()].reshape(refs.shape)
        moved = np.moveaxis(refs, axis, -1)
        distinct, where = np.unique(moved.reshape(-1, moved.shape[-1]), axis=0, return_inverse=True)
        made = np.array([self.row(one) for one in distinct], np.int64)[where.ravel()]
        return np.moveaxis(made.reshape(moved.shape), -1, axis)

    def row(self, refs: References) -> list[int]:
        """Return the entries of one row as the lanes of a node, or of a single number."""
        size = len(refs)
        if (refs == refs[0]).all():
            return [reference(self.shuffle((int(refs[0]),)))] * size
        node = int(refs[0]) >> LANE_BITS
        if self.graph.lanes[node] == size and (np.diff(refs) == 1).all():
            return refs.tolist()
        shuffled = self.shuffle(tuple(refs.tolist()))
        if self.graph.lanes[shuffled] == 1:
            return [reference(shuffled)] * size
        return [reference(shuffled, lane) for lane in range(size)]

    def shuffle(self, refs: tuple[int, ...]) -> int:
        """Return a node whose lanes are these entries."""
        graph = self.graph
        nodes = [one >> LANE_BITS for one in refs]
        if len(refs) == 1:
            if graph.lanes[nodes[0]] == 1:
                return nodes[0]
            return self.extract(nodes[0], refs[0] & LANE_MASK)
        kind = graph.kind[nodes[0]]
        known = [self._known(one) for one in refs]
        if all(value is not None for value in known):
            return self._constant_row(np.array(known), kind)
        return graph.intern("shuffle", refs, len(refs), kind, graph.placement(nodes))

    def extract(self, node: int, lane: int) -> int:
        """Return one lane of a row as a single number, found where the row came from."""
        graph = self.graph
        if graph.op[node] == "shuffle":
            return self.shuffle((graph.args[node][lane],))
        if graph.op[node] == "load":
            buffer, first, stride, _ = graph.args[node]
            return self._load(reference(buffer, first + lane * stride), 0, 1)
        if graph.op[node] == "constants":
            return graph.constant(graph.args[node][0][lane], graph.kind[node])
        args = (reference(node, lane),)
        return graph.intern("shuffle", args, 1, graph.kind[node], graph.placement((node,)))


def _distinct_columns(nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first position of every distinct column, and which of them each column is."""
    if len(nodes) == 1:
        key = nodes[0]
    elif len(nodes) == 2:
        key = (nodes[0] << 31) + nodes[1]
    else:
        key = (nodes[0] << 42) + (nodes[1] << 21) + nodes[2]
    # Of the few columns that there are NumPy's search would take several times as long.
    values = key.tolist()
    first = dict(zip(reversed(values), range(len(values) - 1, -1, -1), strict=True))
    ordered = sorted(first)
    rank = {value: number for number, value in enumerate(ordered)}
    return np.array([first[value] for value in ordered]), np.array([rank[one] for one in values])


def _empty(shape: tuple[int, ...]) -> References:
    return np.zeros(shape, np.int64)
