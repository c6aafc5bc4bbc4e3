"""Lower whole functions: called once, for every row of a batch, or along a path of rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lanewise.ir.control_flow import BatchLoop, LoweredFunction, ScanLoop, Store
from lanewise.ir.graph import LANE_BITS, Buffer, References, reference
from lanewise.lowering.jaxpr import JaxprLowering


def lower_single(closed: Any, lane_sizes: Sequence[int]) -> LoweredFunction:
    """Lower a function of arrays; its results become vectors."""
    lowering = JaxprLowering(lane_sizes)
    graph, top = lowering.graph, lowering.graph.top
    args: list[References] = []
    for number, aval in enumerate(closed.in_avals):
        positions = _in_order(aval.shape)
        buffer = Buffer("argument", positions.size, number)
        args.append(lowering.buffers.read((buffer, positions), top))
    stores = lowering.buffers.store_results(
        lowering.function(closed, args), lambda number, size: Buffer("result", size, number)
    )
    direct = [_written_directly(lowering, store) for store in stores]
    left = [store for store, node in zip(stores, direct, strict=True) if node is None]
    nodes = [node for node in direct if node is not None]
    return LoweredFunction(graph, left, nodes, [store.buffer.size for store in stores], False)


def _written_directly(lowering: JaxprLowering, store: Store) -> int | None:
    """Return the node of a whole buffer that is a result; that buffer becomes the result's."""
    if not store.refs.size:
        return None
    node = int(store.refs[0]) >> LANE_BITS
    if lowering.graph.op[node] != "buffer":
        return None
    buffer: Buffer = lowering.graph.args[node][0]
    whole = reference(node) + np.arange(buffer.size)
    if buffer.space != "arena" or not np.array_equal(store.refs, whole):
        return None
    buffer.space, buffer.source = "result", store.buffer.source
    return node


def lower_batch(closed: Any, lane_sizes: Sequence[int], by_row: Sequence[bool]) -> LoweredFunction:
    """Lower a function of which some arguments are rows of arrays; rows are independent."""
    lowering = JaxprLowering(lane_sizes)
    graph, top = lowering.graph, lowering.graph.top
    body = top.nested(repeats=True)
    inputs: dict[int, Buffer] = {}
    args: list[References] = []
    for number, (aval, has_rows) in enumerate(zip(closed.in_avals, by_row, strict=True)):
        positions = _in_order(aval.shape)
        buffer = Buffer("argument", positions.size, number)
        if has_rows:
            buffer = inputs[number] = Buffer("arena", positions.size, batched=True)
        block = body if has_rows else top
        with lowering.inside(block):
            args.append(lowering.buffers.read((buffer, positions), block))
    lowering.buffers.batched = True
    with lowering.inside(body):
        stores = lowering.buffers.store_results(
            lowering.function(closed, args), lambda _, size: Buffer("arena", size, batched=True)
        )
    outputs = [store.buffer for store in stores]
    lowering.add_region(BatchLoop(inputs, body, stores, outputs), top)
    return LoweredFunction(graph, [], [], [buffer.size for buffer in outputs], True)


def lower_path(
    closed: Any, lane_sizes: Sequence[int], by_row: Sequence[bool], *, carries: bool
) -> LoweredFunction:
    """Lower a function that is called along rows of arrays, perhaps with a vector carried.

    The vector carried into the first row is then the first argument, and the function returns the
    vector carried to the next row, and then the results of the row.
    """
    lowering = JaxprLowering(lane_sizes)
    buffers, top = lowering.buffers, lowering.graph.top
    body = top.nested(repeats=True)
    carried: list[Any] = []
    initial: list[Store] = []
    args: list[References] = []
    slices: list[Buffer] = []
    for number, (aval, has_rows) in enumerate(zip(closed.in_avals, by_row, strict=True)):
        positions = _in_order(aval.shape)
        buffer = Buffer("argument", positions.size, number)
        if has_rows:
            buffer = Buffer("slice", positions.size, buffer, 0, stride=positions.size)
            slices.append(buffer)
        block = body if has_rows else top
        with lowering.inside(block):
            refs = buffers.read((buffer, positions), block)
        if carries and number == 0:
            carried = [buffers.allocate(aval.shape, "f")]
            initial = [buffers.store(lowering.arrays.loaded(refs), carried[0])]
            with lowering.inside(body):
                refs = buffers.read(carried[0], body)
        args.append(refs)
    with lowering.inside(body):
        results = lowering.function(closed, args)
        updates = list(map(buffers.store, results, carried))
        stores = buffers.store_results(results[len(carried) :], _result_slice)
    slices += [store.buffer for store in stores]
    loop = ScanLoop(initial, None, False, slices, [], body, [*updates, *stores])
    lowering.add_region(loop, top)
    sizes = [store.buffer.size for store in stores]
    return LoweredFunction(lowering.graph, [], [], sizes, False)


def _result_slice(number: int, size: int) -> Buffer:
    """Return the buffer of a result at the present row."""
    return Buffer("slice", size, Buffer("result", size, number), 0, stride=size)


def _in_order(shape: tuple[int, ...]) -> np.ndarray:
    return np.arange(math.prod(shape)).reshape(shape)
