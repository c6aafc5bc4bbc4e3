"""Tables that a loop runs along: what one step sees of them.

Entry by entry a table is the same at every step, moves through memory by an even stride, or is
neither. The first costs nothing, the second a pointer; only what is neither is copied to memory
before the loop. So structural zeros stay known inside the loop, and what is given stays where it
lies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from lanewise.ir.control_flow import Put
from lanewise.ir.graph import LANE, LANE_BITS, Block, Graph, Memory, Table, entry


@dataclass
class StepTables:
    """What a loop needs of the tables that it runs along.

    Attributes:
        graph: The statements of the program.
        body: The block of the loop.
        count: How many steps.
        rows: Whether the loop belongs to rows of a batch.
        before: What must be put in memory before the loop.
        along: Memory of the present step.
        looked: Entries of tables that lie in memory before the loop.
    """

    graph: Graph
    body: Block
    count: int
    rows: bool
    before: list[Put] = field(default_factory=list[Put])
    along: list[Memory] = field(default_factory=list[Memory])
    looked: list[int] = field(default_factory=list[int])

    def present(self, table: Table, local: Callable[[Table], Table]) -> Table:
        """Return the entries of the present step.

        Args:
            table: Entries, steps as leading axis.
            local: Loads the entries that lie in memory.
        """
        rows = _in_memory(self.graph, table).reshape(self.count, -1)
        first = rows[0]
        found = first.copy()
        apart = rows[1:] - rows[:-1]
        moving = np.flatnonzero((apart != 0).any(axis=0))
        if moving.size:
            stride = apart[0, moving]
            even = (apart[:, moving] == stride).all(axis=0)
            even &= (np.abs(stride) < LANE >> 1) & (
                self.graph.length[first[moving] >> LANE_BITS] == 0
            )
            even &= stride > 0
            kinds = (first[moving] >> LANE_BITS) * (LANE + 1) + stride
            for kind in np.unique(kinds[even]):
                own = moving[even & (kinds == kind)]
                found[own] = self._moving(first[own], int(apart[0, own[0]]))
            rest = moving[~even]
            if rest.size:
                found[rest] = self._copied(local(rows[:, rest]))
        return found.reshape(table.shape[1:])

    def _moving(self, first: Table, stride: int) -> Table:
        """Entries of memory that moves on by a stride."""
        number = int(first[0]) >> LANE_BITS
        whole: Memory = self.graph.args[number][0]
        lanes = first & LANE
        start = int(lanes.min())
        size = int(lanes.max()) - start + 1
        own = Memory("step", size, whole, start, whole.rows, whole.inside, stride, self.count)
        self.along.append(own)
        self.looked.append(int(first[0]))
        return entry(self.graph.memory(own, self.body)) + lanes - start

    def _copied(self, table: Table) -> Table:
        """Entries of a table that is put in memory before the loop."""
        kind, size = self.graph.kind[int(table[0, 0]) >> LANE_BITS], table.shape[1]
        whole = Memory("arena", table.size, rows=self.rows, inside=kind)
        self.before.append(Put(table.ravel(), whole, np.arange(table.size)))
        own = Memory("step", size, whole, 0, self.rows, kind, size, self.count)
        self.along.append(own)
        return entry(self.graph.memory(own, self.body)) + np.arange(size)


def _in_memory(graph: Graph, table: Table) -> Table:
    """The same entries; those of rows loaded from memory as entries of that memory."""
    flat = table.ravel()
    statements = flat >> LANE_BITS
    found = flat.copy()
    for number in np.unique(statements).tolist():
        if graph.op[number] == "load":
            memory, first, step, _ = graph.args[number]
            own = statements == number
            found[own] = entry(memory, first) + (flat[own] & LANE) * step
    return found.reshape(table.shape)


__all__ = ["StepTables"]
