"""Where rows lie in memory while a program runs."""

from __future__ import annotations

from dataclasses import dataclass

from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import Memory


@dataclass(frozen=True)
class Place:
    """Numbers at even distances in memory.

    Attributes:
        pointer: Where that memory begins, as LLVM calls it.
        first: Place of lane 0, in numbers of eight bytes.
        step: From lane to lane, likewise.
        rows: Whether there is a number for every row of a batch.
        memory: The memory, where it is one that may be written to again.
    """

    pointer: str
    first: int
    step: int
    rows: bool
    memory: Memory | None = None

    def of_lane(self, lane: int) -> int:
        """Place of a lane."""
        return self.first + lane * self.step


class Arena:
    """Room for everything that a program puts in memory.

    Attributes:
        size: How much there is, in numbers of eight bytes.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.size = 0
        self._free: dict[int, list[int]] = {}

    def room(self, numbers: int) -> int:
        """Room for so many numbers, whole vectors."""
        wanted = -(-numbers // WIDTH) * WIDTH
        left = self._free.get(wanted)
        if left:
            return left.pop()
        first, self.size = self.size, self.size + wanted
        return first

    def leave(self, first: int, numbers: int) -> None:
        """Room that may be used for something else."""
        self._free.setdefault(-(-numbers // WIDTH) * WIDTH, []).append(first)
