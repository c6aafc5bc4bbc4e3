"""What a program computes, as a graph of statements over rows of numbers.

A statement makes a row of numbers ("lanes") from rows as long, or from single numbers; most often
one lane stands for one flexure. An array of JAX is no thing of its own here: it is a table that
tells for every entry which lane of which statement it is. To slice, transpose, pad or join arrays
moves entries of such tables and costs a program nothing; zeros and ones are known when the program
is made, and what is multiplied by them is left out.

Statements belong to blocks: the program, the body of a loop, the branch of a condition. A statement
stands in the outermost block that holds all that it is made of, so that what does not change in a
loop is computed once before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

# A program of more statements is not written out: to compile it would take minutes.
_MOST = 400_000


class UnknownHereError(Exception):
    """Something that cannot be made here; such a program is left to XLA."""


# An entry of an array: number of the statement times this, plus the lane.
LANE_BITS = 32
LANE = (1 << LANE_BITS) - 1

Table = np.ndarray
"""Entries of an array, int64, in the shape of the array."""


@dataclass(eq=False)
class Block:
    """Statements that run together.

    Attributes:
        outer: The block around it.
        depth: How many blocks are around it.
        repeats: Whether it runs again and again, and not at most once each time.
    """

    outer: Block | None = None
    depth: int = 0
    repeats: bool = False

    def inner(self, *, repeats: bool) -> Block:
        """A block inside this one."""
        return Block(self, self.depth + 1, repeats)


@dataclass(eq=False)
class Memory:
    """Numbers that lie in memory: what is given, carried round a loop or handed on by a branch.

    Attributes:
        place: Where: "given", "arena", "step" (a row of a table that a loop runs along).
        size: How many numbers.
        number: Which of those given; for "step" the memory that it is a row of.
        offset: Where in the arena, when it is known.
        rows: Whether every row of a batch has numbers of its own.
        inside: Numbers of the kind "f", "i" or "b".
        stride: For "step": how far the memory moves from step to step.
        steps: For "step": how many steps there are; 0 where that is not known.
    """

    place: str
    size: int
    number: Any = None
    offset: int = -1
    rows: bool = False
    inside: str = "f"
    stride: int = 0
    steps: int = 0


class Graph:
    """All statements of a program, by number.

    Attributes:
        op: What is done; "const", "lanes" (given numbers), "memory", "load", "take", "reduce",
            "along" (running sum) or an operation lane by lane.
        args: Statements that it is made of, or, for some, what else it needs.
        length: How many lanes.
        kind: "f" numbers, "i" whole numbers, "b" yes or no.
        owner: The block it stands in.
        block: The block that is read at present.
    """

    def __init__(self) -> None:
        """Begin with nothing but the outermost block."""
        self.top = Block()
        self.block = self.top
        self.op: list[str] = []
        self.args: list[tuple[Any, ...]] = []
        self.kind: list[str] = []
        self.owner: list[Block] = []
        self._length = np.zeros(4096, np.int64)
        self._known: dict[Any, int] = {}

    def __len__(self) -> int:
        """Number of statements."""
        return len(self.op)

    @property
    def length(self) -> np.ndarray:
        """How many lanes every statement has; 0 where it is memory."""
        return self._length

    def add(self, op: str, args: tuple[Any, ...], length: int, kind: str, owner: Block) -> int:
        """A new statement."""
        number = len(self.op)
        if number == _MOST:
            raise UnknownHereError("a program that is too long to be written out")
        if number == len(self._length):
            self._length = np.concatenate([self._length, np.zeros_like(self._length)])
        self._length[number] = length
        self.op.append(op)
        self.args.append(args)
        self.kind.append(kind)
        self.owner.append(owner)
        return number

    def once(
        self, op: str, args: tuple[Any, ...], length: int, kind: str, owner: Block, key: Any = None
    ) -> int:
        """A statement, the same one where it is there already."""
        key = (op, kind, args if key is None else key)
        found = self._known.get(key)
        if found is None or not self._is_around(self.owner[found]):
            found = self._known[key] = self.add(op, args, length, kind, owner)
        return found

    def _is_around(self, block: Block) -> bool:
        """Whether what stands in a block is there for the block that is read."""
        here: Block | None = self.block
        while here is not None and here.depth > block.depth:
            here = here.outer
        return here is block

    def const(self, value: Any, kind: str) -> int:
        """A number that is known."""
        number = _as_kind(value, kind)
        key = float(number).hex() if kind == "f" else number
        return self.once("const", (number,), 1, kind, self.top, key=key)

    def value(self, statement: int) -> Any:
        """The number that is known; None where it is not."""
        return self.args[statement][0] if self.op[statement] == "const" else None

    def home(self, statements: Any) -> Block:
        """The block for what is made of some statements.

        It is taken out of loops in which it does not change, but not out of a condition alone.
        """
        most = self.top
        for one in statements:
            if self.owner[one].depth > most.depth:
                most = self.owner[one]
        found = here = self.block
        while here is not most:
            assert here.outer is not None
            if here.repeats:
                found = here.outer
            here = here.outer
        return found

    def memory(self, memory: Memory, owner: Block) -> int:
        """A statement that stands for memory; its lanes are its numbers."""
        return self.add("memory", (memory,), 0, memory.inside, owner)


def _as_kind(value: Any, kind: str) -> Any:
    return float(value) if kind == "f" else bool(value) if kind == "b" else int(value)


def entry(statement: int, lane: int = 0) -> int:
    """The entry of a table for a lane of a statement."""
    return (statement << LANE_BITS) + lane


__all__ = ["LANE", "LANE_BITS", "Block", "Graph", "Memory", "Table", "UnknownHereError", "entry"]
