"""Find entries that can be stored together: lanes of one row at a constant stride."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lanewise.ir.graph import LANE_BITS, LANE_MASK, reference


@dataclass(frozen=True)
class Run:
    """Lanes of one node at a constant stride that go to offsets at a constant stride."""

    node: int
    lane: int
    lane_stride: int
    offset: int
    offset_stride: int
    count: int

    def ref(self, number: int) -> int:
        """Return the reference to one of its entries."""
        return reference(self.node, self.lane + number * self.lane_stride)


def find_runs(refs: Sequence[int], offsets: Sequence[int]) -> list[Run]:
    """Return entries and the offsets that they go to, as few runs."""
    by_node: dict[int, list[tuple[int, int]]] = {}
    for ref, offset in zip(refs, offsets, strict=True):
        by_node.setdefault(ref >> LANE_BITS, []).append((ref & LANE_MASK, offset))
    runs: list[Run] = []
    for node, pairs in by_node.items():
        first = 0
        while first < len(pairs):
            lane, offset = pairs[first]
            end, lane_stride, offset_stride = first + 1, 1, 1
            if end < len(pairs):
                lane_stride, offset_stride = pairs[end][0] - lane, pairs[end][1] - offset
                while lane_stride and end < len(pairs):
                    previous, present = pairs[end - 1], pairs[end]
                    step = (present[0] - previous[0], present[1] - previous[1])
                    if step != (lane_stride, offset_stride):
                        break
                    end += 1
            runs.append(Run(node, lane, lane_stride, offset, offset_stride, end - first))
            first = end
    return runs
