"""Entries that go to memory together: lanes of one row at even distances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lanewise.ir.graph import LANE, LANE_BITS


@dataclass(frozen=True)
class Run:
    """Lanes of one row at even distances that go to places at even distances."""

    statement: int
    lane: int
    step: int
    place: int
    apart: int
    count: int

    def entry(self, number: int) -> int:
        """One of its entries."""
        return (self.statement << LANE_BITS) + self.lane + number * self.step


def runs(entries: Sequence[int], places: Sequence[int]) -> list[Run]:
    """Entries and the places that they go to, as few runs."""
    by_row: dict[int, list[tuple[int, int]]] = {}
    for one, place in zip(entries, places, strict=True):
        by_row.setdefault(one >> LANE_BITS, []).append((one & LANE, place))
    found: list[Run] = []
    for statement, pairs in by_row.items():
        first = 0
        while first < len(pairs):
            lane, place = pairs[first]
            last, step, apart = first + 1, 1, 1
            if last < len(pairs):
                step, apart = pairs[last][0] - lane, pairs[last][1] - place
                while step and last < len(pairs):
                    near, here = pairs[last - 1], pairs[last]
                    if (here[0] - near[0], here[1] - near[1]) != (step, apart):
                        break
                    last += 1
            found.append(Run(statement, lane, step, place, apart, last - first))
            first = last
    return found


__all__ = ["Run", "runs"]
