"""Describe where rows lie in memory while a program runs."""

from __future__ import annotations

from dataclasses import dataclass

from lanewise.ir.control_flow import WIDTH
from lanewise.ir.graph import Buffer


@dataclass(frozen=True)
class Address:
    """Locate numbers at a constant stride in memory.

    Attributes:
        pointer: LLVM's name of the pointer that offsets count from.
        first: Offset of lane 0, in numbers of eight bytes.
        stride: Offset from lane to lane.
        batched: Whether there is a vector of `WIDTH` rows for every lane.
        buffer: The buffer, if it is one that may be written to again.
    """

    pointer: str
    first: int
    stride: int
    batched: bool
    buffer: Buffer | None = None

    def of_lane(self, lane: int) -> int:
        """Return the offset of a lane."""
        return self.first + lane * self.stride

    def part(self, lane: int, stride: int) -> Address:
        """Return the address of the lanes from one on, at a stride in lanes."""
        return Address(
            self.pointer, self.of_lane(lane), stride * self.stride, self.batched, self.buffer
        )


class Arena:
    """Assign the working memory of a program.

    Attributes:
        size: Size assigned so far, in numbers of eight bytes.
    """

    def __init__(self) -> None:
        """Begin with no memory."""
        self.size = 0
        self._free: dict[int, list[int]] = {}

    def allocate(self, count: int) -> int:
        """Return the offset of memory for some numbers, in whole vectors."""
        size = -(-count // WIDTH) * WIDTH
        free = self._free.get(size)
        if free:
            return free.pop()
        first, self.size = self.size, self.size + size
        return first

    def free(self, first: int, count: int) -> None:
        """Allow memory to be assigned again."""
        self._free.setdefault(-(-count // WIDTH) * WIDTH, []).append(first)
