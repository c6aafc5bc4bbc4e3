"""Where arrays lie in memory, and tables of what lies there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lanewise.ir.control_flow import WIDTH, Put
from lanewise.ir.graph import LANE_BITS, Block, Graph, Memory, Table, entry
from lanewise.lowering.tables import Tables


class Arranger:
    """Finds memory for arrays.

    Args:
        long: Sizes of axes along which rows are laid out.
    """

    def __init__(self, long: Sequence[int]) -> None:
        """Begin an empty program."""
        self.graph = Graph()
        self.tables = Tables(self.graph, long)
        self.rows = False

    def _arranged(self, shape: tuple[int, ...]) -> tuple[int, np.ndarray]:
        """How many numbers memory for an array has, and where its entries are in it.

        Rows along the long axis lie together, each filled up to whole vectors.
        """
        axis = self.tables.long_axis(shape)
        count = int(np.prod(shape))
        if axis is None or len(shape) == 1:
            return count, np.arange(count).reshape(shape)
        size = shape[axis]
        room = size if self.rows else -(-size // WIDTH) * WIDTH
        others = count // size
        places = np.arange(others)[:, None] * room + np.arange(size)
        rest = [length for a, length in enumerate(shape) if a != axis]
        return others * room, np.moveaxis(places.reshape(*rest, size), -1, axis)

    def _new(self, shape: tuple[int, ...], kind: str) -> tuple[Memory, np.ndarray]:
        size, places = self._arranged(shape)
        return Memory("arena", size, rows=self.rows, inside=kind), places

    def _seen(self, memory: Memory, places: np.ndarray, block: Block) -> Table:
        """The array that memory holds, as seen in a block."""
        statement = self.graph.memory(memory, block)
        table = entry(statement) + places.astype(np.int64)
        return self._unpacked(table)

    def _unpacked(self, table: Table) -> Table:
        """The same; numbers in memory loaded as rows, where there is a long axis for them."""
        return self.tables.local(table) if self._is_long(table.shape) else table

    def _is_long(self, shape: tuple[int, ...]) -> bool:
        return len(shape) > 1 and self.tables.long_axis(shape) is not None

    def _put(self, table: Table, where: tuple[Memory, np.ndarray]) -> Put:
        memory, places = where
        flat = self._rows_of(table, places)
        return Put(flat.ravel(), memory, places.ravel())

    def _rows_of(self, table: Table, places: np.ndarray) -> Table:
        """Entries in rows as memory has them, so that they can be written row by row."""
        table = np.broadcast_to(table, places.shape)
        if not self._is_long(places.shape):
            return table
        return self.tables.rows(self.tables.local(table), self.tables.long_axis(places.shape))

    def _as_numbers(self, flat: Table) -> Table:
        if not flat.size:
            return flat
        kinds = {self.graph.kind[int(one)] for one in np.unique(flat >> LANE_BITS).tolist()}
        return flat if kinds == {"f"} else self.tables.each("to_float", flat)


__all__ = ["Arranger"]
