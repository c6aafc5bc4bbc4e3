"""Represent regions: loops, branches, and the stores that carry values out of blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lanewise.ir.graph import Block, Buffer, Graph, References

WIDTH = 8
"""Lanes of a vector."""


@dataclass(eq=False)
class Store:
    """Entries to be written to a buffer.

    Attributes:
        refs: References to the entries, flat.
        buffer: The buffer.
        offsets: Position of each entry in the buffer.
        row: Length of the buffer's rows, if each is padded to whole vectors; else 0.
    """

    refs: References
    buffer: Buffer
    offsets: np.ndarray
    row: int = 0


@dataclass(eq=False)
class WhileLoop:
    """A `while` loop.

    Attributes:
        initial: Stores of the values carried into it.
        condition: The block that computes whether to continue.
        predicate: Reference to that boolean.
        body: The block that is repeated.
        updates: Stores of the values carried to the next iteration.
        batched: Whether every row of a batch stops independently.
    """

    initial: list[Store]
    condition: Block
    predicate: int
    body: Block
    updates: list[Store]
    batched: bool


@dataclass(eq=False)
class ScanLoop:
    """A loop over the leading axis of arrays.

    Attributes:
        initial: Stores of the values carried into it, and of arrays copied to memory first.
        length: Number of steps; None if only known at run time.
        reverse: Whether it runs from the last step to the first.
        slices: Buffers of the present step.
        inputs: References into the buffers that these are slices of.
        body: The block that is repeated.
        updates: Stores of the carried values and of the results of a step.
    """

    initial: list[Store]
    length: int | None
    reverse: bool
    slices: list[Buffer]
    inputs: list[int]
    body: Block
    updates: list[Store]


@dataclass(eq=False)
class Conditional:
    """Blocks of which one is executed.

    Attributes:
        index: Reference to the number of the branch.
        branches: The blocks, each with the stores of its results.
        batched: Whether rows of a batch choose independently.
    """

    index: int
    branches: list[tuple[Block, list[Store]]]
    batched: bool


@dataclass(eq=False)
class BatchLoop:
    """A loop over the rows of a batch, `WIDTH` at a time.

    Attributes:
        inputs: Buffers of the present rows, by number of the argument.
        body: The block that computes them.
        stores: Stores of its results.
        outputs: Buffers of these results.
    """

    inputs: dict[int, Buffer]
    body: Block
    stores: list[Store]
    outputs: list[Buffer]


@dataclass(eq=False)
class LoweredFunction:
    """A function, lowered completely.

    Attributes:
        graph: Its nodes.
        stores: Stores of its results in the outermost block.
        in_place: Nodes of result buffers that regions write directly.
        sizes: Number of entries of every result; of one row where there are rows.
        batched: Whether it computes the rows of a batch.
    """

    graph: Graph
    stores: list[Store]
    in_place: list[int]
    sizes: list[int]
    batched: bool
