"""List what nodes and regions depend on and what they write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from lanewise.ir.control_flow import BatchLoop, Conditional, ScanLoop, Store, WhileLoop
from lanewise.ir.graph import LANE_BITS, Block, Buffer, Graph


class RegionParts(NamedTuple):
    """Blocks of a region, its stores, and the references that it reads."""

    blocks: list[Block]
    stores: list[Store]
    reads: list[int]

    def stored_nodes(self) -> Iterable[int]:
        """Return the nodes that it stores."""
        return stored_nodes(self.stores)

    def read_nodes(self) -> Iterable[int]:
        """Return the nodes that it reads directly."""
        return [one >> LANE_BITS for one in self.reads]

    def written(self) -> list[Buffer]:
        """Return the buffers that it writes, with those that slices belong to."""
        buffers = [store.buffer for store in self.stores]
        return buffers + [one.source for one in buffers if one.space == "slice"]


def parts(region: Any) -> RegionParts:
    """Return the parts of a loop or branch."""
    match region:
        case WhileLoop():
            stores = [*region.initial, *region.updates]
            return RegionParts([region.condition, region.body], stores, [region.predicate])
        case ScanLoop():
            return RegionParts([region.body], [*region.initial, *region.updates], region.inputs)
        case Conditional():
            stores = [store for _, own in region.branches for store in own]
            return RegionParts([block for block, _ in region.branches], stores, [region.index])
        case BatchLoop():
            return RegionParts([region.body], region.stores, [])
        case _:
            raise TypeError(region)


def returns_results(region: Any) -> bool:
    """Return whether a region writes the function's results row by row."""
    return isinstance(region, BatchLoop) or (isinstance(region, ScanLoop) and region.length is None)


def regions(graph: Graph) -> Iterator[tuple[int, Any]]:
    """Return all regions with the numbers of their nodes."""
    for node, op in enumerate(graph.op):
        if op == "region":
            yield node, graph.args[node][0]


def stored_nodes(stores: Iterable[Store]) -> Iterable[int]:
    """Return the nodes that are stored."""
    for store in stores:
        yield from np.unique(store.refs >> LANE_BITS).tolist()


def operand_nodes(graph: Graph, node: int) -> Iterable[int]:
    """Return the nodes that a node is computed from."""
    op, args = graph.op[node], graph.args[node]
    if op in ("const", "constants", "buffer", "region"):
        return ()
    if op == "shuffle":
        return {one >> LANE_BITS for one in args}
    if op == "load":
        return args[:1]
    if op in ("reduce", "prefix"):
        return args[1:2]
    return args
