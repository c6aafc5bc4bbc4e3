"""Lower what combines entries of an array: reductions, running sums, sums of products."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from lanewise.ir.graph import LANE_BITS, LANE_MASK, References, reference
from lanewise.lowering.arrays import ArrayLowering

_LOWEST = {"f": -np.inf, "i": -(1 << 63), "b": False}
_HIGHEST = {"f": np.inf, "i": (1 << 63) - 1, "b": True}


def neutral(op: str, kind: str) -> Any:
    """Return the number that changes nothing when an operation combines it with others."""
    if op in ("max", "min"):
        return (_LOWEST if op == "max" else _HIGHEST)[kind]
    if op in ("and", "or"):
        return -1 if op == "and" and kind == "i" else op == "and"
    return (0.0 if kind == "f" else 0) if op == "add" else (1.0 if kind == "f" else 1)


def reduce_axes(
    arrays: ArrayLowering, op: str, refs: References, axes: Sequence[int], kind: str
) -> References:
    """Combine all entries along some axes by an operation."""
    kept = [axis for axis in range(refs.ndim) if axis not in axes]
    shape = tuple(refs.shape[axis] for axis in kept)
    count = math.prod(refs.shape[axis] for axis in axes)
    moved = np.transpose(arrays.loaded(refs), [*kept, *axes]).reshape(*shape, count)
    if 0 in moved.shape:
        return arrays.constant(np.full(shape, neutral(op, kind)))
    if count == 1:
        return moved[..., 0]
    flat = moved.reshape(-1, count)
    if not _mostly_within_rows(arrays, flat):
        parts = [moved[..., number] for number in range(count)]
        return reduce(lambda a, b: arrays.elementwise(op, a, b), parts)
    made = [reference(_reduce_row(arrays, op, row)) for row in flat]
    return np.array(made, np.int64).reshape(shape)


def _mostly_within_rows(arrays: ArrayLowering, flat: References) -> bool:
    """Return whether the entries to be combined are mostly lanes of the same rows."""
    nodes = flat >> LANE_BITS
    in_rows = arrays.graph.length[nodes] > 1
    if not in_rows.any():
        return False
    ordered = np.sort(np.where(in_rows, nodes, -1), axis=1)
    repeated = (np.diff(ordered, axis=1) == 0) & (ordered[:, 1:] >= 0)
    return bool(repeated.sum() * 2 >= in_rows.sum()) and len(flat) <= flat.shape[1] * 64


def _reduce_row(arrays: ArrayLowering, op: str, row: References) -> int:
    """Return the node of one number that combines all entries of a row."""
    graph, make = arrays.graph, arrays.nodes.make
    nodes, lanes = row >> LANE_BITS, row & LANE_MASK
    by_lanes: dict[tuple[int, ...], list[int]] = {}
    single: list[int] = []
    for node in dict.fromkeys(nodes.tolist()):
        used = lanes[nodes == node].tolist()
        if graph.lanes[node] == 1:
            single += [node] * len(used)
        elif len(set(used)) < len(used):
            single += [arrays.extract(node, lane) for lane in used]
        else:
            by_lanes.setdefault((graph.lanes[node], *sorted(used)), []).append(node)
    for (length, *used), rows in by_lanes.items():
        if len(used) * 2 < length:
            single += [arrays.extract(node, lane) for node in rows for lane in used]
            continue
        combined = reduce(lambda a, b: make(op, (a, b)), rows)
        if graph.lanes[combined] == 1:  # folded to a known number
            single += [combined] * (len(used) if op in ("add", "mul") else 1)
            continue
        first, count = used[0], len(used)
        if used != list(range(first, first + count)):
            combined = arrays.shuffle(tuple(reference(combined, lane) for lane in used))
            first = 0
        args = (op, combined, first, count)
        owner = graph.placement((combined,))
        single.append(graph.intern("reduce", args, 1, graph.kind[combined], owner))
    return reduce(lambda a, b: make(op, (a, b)), single)


def prefix(
    arrays: ArrayLowering, op: str, refs: References, axis: int, reverse: bool
) -> References:
    """Combine the entries up to each one along an axis."""
    moved = np.moveaxis(arrays.loaded(refs), axis, -1)
    if 0 in moved.shape:
        return refs
    flat = moved.reshape(-1, moved.shape[-1])
    if moved.shape[-1] > 1 and _mostly_within_rows(arrays, flat):
        made = np.array([_prefix_row(arrays, op, row, reverse) for row in flat], np.int64)
        return np.moveaxis(made.reshape(moved.shape), -1, axis)
    order = range(moved.shape[-1])
    parts: dict[int, References] = {}
    total = None
    for position in reversed(order) if reverse else order:
        one = moved[..., position]
        total = one if total is None else arrays.elementwise(op, total, one)
        parts[position] = total
    return np.moveaxis(np.stack([parts[position] for position in order], axis=-1), -1, axis)


def _prefix_row(arrays: ArrayLowering, op: str, row: References, reverse: bool) -> list[int]:
    graph, size = arrays.graph, len(row)
    backward = bool((np.diff(row) == -1).all())
    node = arrays.row(row[::-1] if backward else row)[0] >> LANE_BITS
    owner = graph.placement((node,))
    if graph.lanes[node] == 1:
        node = graph.intern("shuffle", (reference(node),) * size, size, graph.kind[node], owner)
    args = (op, node, reverse != backward)
    made = graph.intern("prefix", args, size, graph.kind[node], owner)
    results = [reference(made, lane) for lane in range(size)]
    return results[::-1] if backward else results


def dot_general(
    arrays: ArrayLowering,
    left: References,
    right: References,
    dimension_numbers: Any,
) -> References:
    """Sum products over some axes of two arrays, as JAX's `dot_general`."""
    contract, batch = dimension_numbers
    left, right = arrays.loaded(left), arrays.loaded(right)
    free = [
        [axis for axis in range(one.ndim) if axis not in (*over, *both)]
        for one, over, both in zip((left, right), contract, batch, strict=True)
    ]
    a = np.transpose(left, [*batch[0], *free[0], *contract[0]])
    b = np.transpose(right, [*batch[1], *free[1], *contract[1]])
    shared = a.shape[: len(batch[0])]
    rows = a.shape[len(shared) : len(shared) + len(free[0])]
    columns = b.shape[len(shared) : len(shared) + len(free[1])]
    count = math.prod(left.shape[axis] for axis in contract[0])
    if 0 in (count, *shared, *rows, *columns):
        return arrays.constant(np.zeros((*shared, *rows, *columns)))
    a = a.reshape(*shared, *rows, *(1,) * len(columns), count)
    b = b.reshape(*shared, *(1,) * len(rows), *columns, count)
    if _mostly_within_rows(arrays, a.reshape(-1, count)):
        products = arrays.elementwise("mul", *np.broadcast_arrays(a, b))
        return reduce_axes(arrays, "add", products, [products.ndim - 1], "f")
    terms = (
        arrays.elementwise("mul", *np.broadcast_arrays(a[..., number], b[..., number]))
        for number in range(count)
    )
    return reduce(lambda total, term: arrays.elementwise("add", total, term), terms)
