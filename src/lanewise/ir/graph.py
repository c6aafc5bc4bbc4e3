"""Represent what a program computes as a graph of nodes over lanes.

A node computes a row of numbers ("lanes") from rows of the same length or from single numbers. An
array of JAX has no node of its own: it is an array of references, one per entry, each naming a lane
of a node. Slices, transposes, padding and concatenations rearrange references and cost nothing at
run time; known zeros and ones are folded when the program is made.

Nodes belong to blocks: the function, the body of a loop, a branch. A node stands in the outermost
block that has all its operands, so that what a loop does not change is computed before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

# A program of more nodes is refused: compiling it would take minutes.
_MAX_NODES = 1_000_000


class UnsupportedPrimitiveError(Exception):
    """The traced function uses what this compiler does not support; the caller may use XLA.

    Attributes:
        primitive: Name of JAX's primitive; None where the program as a whole is refused.
    """

    def __init__(self, reason: str, primitive: str | None = None) -> None:
        """Describe what is not supported."""
        super().__init__(reason)
        self.primitive = primitive


# A reference to an entry: number of the node shifted by this, plus the lane.
LANE_BITS = 32
LANE_MASK = (1 << LANE_BITS) - 1

References = np.ndarray
"""References to the entries of an array, int64, in the shape of the array."""


@dataclass(eq=False)
class Block:
    """Group nodes that run together.

    Attributes:
        parent: The block around it.
        depth: Number of blocks around it.
        repeats: Whether it runs repeatedly, as the body of a loop, not at most once as a branch.
    """

    parent: Block | None = None
    depth: int = 0
    repeats: bool = False

    def nested(self, *, repeats: bool) -> Block:
        """Return a new block inside this one."""
        return Block(self, self.depth + 1, repeats)


@dataclass(eq=False)
class Buffer:
    """Describe numbers in memory: an argument, a result, or values carried between blocks.

    Attributes:
        space: "argument", "result", "arena", or "slice" (what one step of a scan sees of a buffer).
        size: Number of entries.
        source: Index of the argument or result; for "slice" the buffer that it is a part of.
        offset: Position in the arena once assigned; for "slice" that of the first step.
        batched: Whether every row of a batch has its own entries.
        kind: Kind of its numbers: "f", "i" or "b".
        stride: For "slice": entries from one step to the next.
        steps: For "slice": number of steps; 0 if only known at run time.
    """

    space: str
    size: int
    source: Any = None
    offset: int = -1
    batched: bool = False
    kind: str = "f"
    stride: int = 0
    steps: int = 0


class Graph:
    """Hold all nodes of a program, by number.

    Attributes:
        op: Operation of every node: "const", "constants" (a row of known numbers), "buffer",
            "load", "shuffle", "reduce", "prefix", "region" (a loop or branch), or an operation
            lane by lane.
        args: Operands: numbers of nodes, for some operations other data.
        kind: "f" floats, "i" integers, "b" booleans.
        lanes: Number of lanes; 0 for buffers and regions.
        number: Value of a known number; None for others.
        owner: The block of every node.
        block: The block that nodes are added for at present.
    """

    def __init__(self) -> None:
        """Begin with the outermost block alone."""
        self.top = Block()
        self.block = self.top
        self.op: list[str] = []
        self.args: list[tuple[Any, ...]] = []
        self.kind: list[str] = []
        self.lanes: list[int] = []
        self.number: list[Any] = []
        self.owner: list[Block] = []
        self._length = np.zeros(4096, np.int64)
        self._interned: dict[Any, int] = {}

    @property
    def length(self) -> np.ndarray:
        """Number of lanes of every node, as an array."""
        return self._length

    def add(self, op: str, args: tuple[Any, ...], length: int, kind: str, owner: Block) -> int:
        """Add a node and return its number."""
        number = len(self.op)
        if number == _MAX_NODES:
            raise UnsupportedPrimitiveError(f"a program of more than {_MAX_NODES} operations")
        if number == len(self._length):
            self._length = np.concatenate([self._length, np.zeros_like(self._length)])
        self._length[number] = length
        self.op.append(op)
        self.args.append(args)
        self.kind.append(kind)
        self.lanes.append(length)
        self.number.append(args[0] if op == "const" else None)
        self.owner.append(owner)
        return number

    def intern(
        self, op: str, args: tuple[Any, ...], length: int, kind: str, owner: Block, key: Any = None
    ) -> int:
        """Return the visible node that computes the same, or add one."""
        key = (op, kind, args if key is None else key)
        node = self._interned.get(key)
        if node is None or not self._is_visible(self.owner[node]):
            node = self._interned[key] = self.add(op, args, length, kind, owner)
        return node

    def _is_visible(self, block: Block) -> bool:
        """Return whether the present block is that block or inside it."""
        here: Block | None = self.block
        while here is not None and here.depth > block.depth:
            here = here.parent
        return here is block

    def constant(self, value: Any, kind: str) -> int:
        """Return the node of a known number."""
        number = float(value) if kind == "f" else bool(value) if kind == "b" else int(value)
        key = float(number).hex() if kind == "f" else number
        return self.intern("const", (number,), 1, kind, self.top, key=key)

    def placement(self, operands: Any) -> Block:
        """Return the block for a node with these operands.

        It is hoisted out of loops that do not change it, but not out of a branch alone.
        """
        innermost = self.top
        for node in operands:
            if self.owner[node].depth > innermost.depth:
                innermost = self.owner[node]
        hoisted = here = self.block
        while here is not innermost:
            assert here.parent is not None
            if here.repeats:
                hoisted = here.parent
            here = here.parent
        return hoisted

    def add_buffer(self, buffer: Buffer, owner: Block) -> int:
        """Add a node that stands for a buffer; its lanes are the buffer's entries."""
        return self.add("buffer", (buffer,), 0, buffer.kind, owner)


def reference(node: int, lane: int = 0) -> int:
    """Return the reference to a lane of a node."""
    return (node << LANE_BITS) + lane
