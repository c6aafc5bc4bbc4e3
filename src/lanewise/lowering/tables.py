"""Operations on whole arrays: which statements they need, and which lane is which entry.

Lane by lane an operation needs one statement for every set of rows that it meets in the same lanes.
Where the lanes of its arguments do not match, rows are taken along one axis of the array first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from lanewise.ir.graph import LANE, LANE_BITS, Graph, Table, entry
from lanewise.lowering.simplify import Maker

# Rows of which fewer lanes are wanted are not computed whole.
_DENSE = 0.6


class Tables:
    """Makes tables of what is done with tables.

    Args:
        graph: The graph.
        long: Sizes of axes along which rows are laid out: the number of flexures, and of bodies.
    """

    def __init__(self, graph: Graph, long: Sequence[int]) -> None:
        """Begin an empty program."""
        self.graph = graph
        self.long = tuple(size for size in long if size > 1)
        self.maker = Maker(graph)

    def constant(self, values: Any) -> Table:
        """An array that is known."""
        values = np.asarray(values)
        kind = "b" if values.dtype == bool else "f" if values.dtype.kind == "f" else "i"
        different, where = np.unique(values.ravel(), return_inverse=True)
        entries = np.array([entry(self.graph.const(one, kind)) for one in different], np.int64)
        return entries[where.ravel()].reshape(values.shape) if values.size else _empty(values.shape)

    def known(self, table: Table) -> np.ndarray | None:
        """The numbers of an array where all are known."""
        flat = [self._known(int(one)) for one in table.ravel()]
        if any(value is None for value in flat):
            return None
        return np.array(flat).reshape(table.shape) if flat else np.zeros(table.shape, int)

    def _constant_row(self, row: np.ndarray, kind: str) -> list[int]:
        if (row == row[0]).all():
            return [entry(self.graph.const(row[0], kind))] * len(row)
        key = (row.tobytes(), len(row))
        lanes = self.graph.once("lanes", (row,), len(row), kind, self.graph.top, key=key)
        return [entry(lanes, lane) for lane in range(len(row))]

    def long_axis(self, shape: tuple[int, ...]) -> int | None:
        """The first axis along which rows are laid out; None where there is none."""
        return next((axis for axis, size in enumerate(shape) if size in self.long), None)

    def local(self, table: Table) -> Table:
        """The same with numbers in memory loaded, as rows along the long axis where there is one.

        Args:
            table: Entries, some of them of memory.
        """
        flat = table.ravel()
        if not flat.size:
            return table
        in_memory = self.graph.length[flat >> LANE_BITS] == 0
        if not in_memory.any():
            return table
        axis = self.long_axis(table.shape)
        if axis is None:
            return self._load_each(table, in_memory)
        rows = np.moveaxis(table, axis, -1)
        out = rows.reshape(-1, rows.shape[-1]).copy()
        apart = np.diff(out, axis=1)
        stored = np.moveaxis(in_memory.reshape(table.shape), axis, -1).reshape(out.shape)
        even = (apart == apart[:, :1]).all(axis=1) & stored.all(axis=1)
        even &= (out[:, 0] >> LANE_BITS) == (out[:, -1] >> LANE_BITS)
        even &= apart[:, 0] != 0
        for number in np.flatnonzero(even):
            first, step = int(out[number, 0]), int(apart[number, 0])
            loaded = self._load(first, step, out.shape[1])
            out[number] = (loaded << LANE_BITS) + np.arange(out.shape[1])
        rest = ~even[:, None] & stored
        if rest.any():
            out = self._load_each(out, rest.ravel())
        return np.moveaxis(out.reshape(rows.shape), -1, axis)

    def _load_each(self, table: Table, in_memory: np.ndarray) -> Table:
        flat = table.ravel().copy()
        different, where = np.unique(flat[in_memory], return_inverse=True)
        loaded = [entry(self._load(int(one), 0, 1)) for one in different]
        flat[in_memory] = np.array(loaded, np.int64)[where.ravel()]
        return flat.reshape(table.shape)

    def _load(self, first: int, step: int, length: int) -> int:
        graph, memory = self.graph, first >> LANE_BITS
        args = (memory, first & LANE, step, length)
        return graph.once("load", args, length, graph.kind[memory], graph.home((memory,)))

    def each(self, op: str, *tables: Table) -> Table:
        """An operation lane by lane; arrays are of one shape, or single numbers."""
        shape = np.broadcast_shapes(*(table.shape for table in tables))
        if 0 in shape:
            return _empty(shape)
        given = [np.broadcast_to(self.local(table), shape) for table in tables]
        flat = [table.reshape(-1) for table in given]
        if not self._matching(flat):
            given = self._aligned(given)
            flat = [table.reshape(-1) for table in given]
        if len(flat[0]) == 1:
            made = self.maker.make(op, tuple(int(one[0]) >> LANE_BITS for one in flat))
            lanes = [int(one[0]) & LANE for one in flat]
            return np.array(entry(made, max(lanes) if self._is_long(made) else 0)).reshape(shape)
        statements = np.stack([one >> LANE_BITS for one in flat])
        lanes = np.max([one & LANE for one in flat], axis=0)
        first, where = _different(statements)
        columns = statements[:, first].T.tolist()
        made = np.array([self.maker.make(op, tuple(column)) for column in columns], np.int64)
        numbers = made[where]
        lanes = np.where(self.graph.length[numbers] > 1, lanes, 0)
        return ((numbers << LANE_BITS) + lanes).reshape(shape)

    def _is_long(self, statement: int) -> bool:
        return self.graph.length[statement] > 1

    def _matching(self, flat: list[Table]) -> bool:
        """Whether rows meet in the same lanes, and most of their lanes are wanted."""
        lengths = [self.graph.length[one >> LANE_BITS] for one in flat]
        if all((length == 1).all() for length in lengths):
            return True
        long = np.max(lengths, axis=0)
        lane = np.max([one & LANE for one in flat], axis=0)
        for one, length in zip(flat, lengths, strict=True):
            own = length > 1
            if (own & ((length != long) | ((one & LANE) != lane))).any():
                return False
        # Of every set of rows that meet: are most of their lanes there?
        statements = np.stack([one >> LANE_BITS for one in flat])
        first, where = _different(statements)
        wanted = np.unique(where.astype(np.int64) * (1 << 24) + lane)
        counts = np.bincount(wanted >> 24, minlength=len(first))
        return bool((counts >= _DENSE * long[first]).all())

    def _aligned(self, given: list[Table]) -> list[Table]:
        """The same entries in rows along the axis that suits most of them."""
        axis = self._axis(given)
        return [self.rows(table, axis) for table in given]

    def _axis(self, given: list[Table]) -> int | None:
        """The axis along which most entries go from lane to lane."""
        best, found = 0.0, None
        for axis, size in enumerate(given[0].shape):
            if size < 2:
                continue
            score = 0.0
            for table in given:
                if (self.graph.length[table >> LANE_BITS] == 1).all():
                    continue
                apart = np.abs(np.diff(table, axis=axis))
                score += float(np.mean((apart > 0) & (apart < LANE >> 1)))
            if score > best + 1e-12 or (score == best > 0.0 and size > given[0].shape[found or 0]):
                best, found = score, axis
        return found

    def rows(self, table: Table, axis: int | None) -> Table:
        """The same entries in rows of their own along an axis; as single numbers without one.

        Args:
            table: Entries, none of memory.
            axis: The axis.
        """
        if axis is None:
            flat = table.ravel()
            different, where = np.unique(flat, return_inverse=True)
            single = [entry(self.take((int(one),))) for one in different]
            return np.array(single, np.int64)[where.ravel()].reshape(table.shape)
        along = np.moveaxis(table, axis, -1)
        flat = along.reshape(-1, along.shape[-1])
        different, where = np.unique(flat, axis=0, return_inverse=True)
        made = np.array([self._row(row) for row in different], np.int64)[where.ravel()]
        return np.moveaxis(made.reshape(along.shape), -1, axis)

    def _row(self, row: Table) -> list[int]:
        size = len(row)
        if (row == row[0]).all():
            return [entry(self.take((int(row[0]),)))] * size
        statement = int(row[0]) >> LANE_BITS
        if self.graph.length[statement] == size and (np.diff(row) == 1).all():
            return row.tolist()
        taken = self.take(tuple(row.tolist()))
        return [entry(taken, lane) for lane in range(size)]

    def take(self, entries: tuple[int, ...]) -> int:
        """A statement whose lanes are given entries."""
        graph = self.graph
        statements = [one >> LANE_BITS for one in entries]
        if len(entries) == 1:
            if graph.length[statements[0]] == 1:
                return statements[0]
            return self._lane_of(statements[0], entries[0] & LANE)
        kind = graph.kind[statements[0]]
        known = [self._known(one) for one in entries]
        if all(value is not None for value in known):
            return self._constant_row(np.array(known), kind)[0] >> LANE_BITS
        return graph.once("take", entries, len(entries), kind, graph.home(statements))

    def _known(self, one: int) -> Any:
        statement = one >> LANE_BITS
        if self.graph.op[statement] == "lanes":
            return self.graph.args[statement][0][one & LANE]
        return self.graph.value(statement)

    def _lane_of(self, statement: int, lane: int) -> int:
        """One lane of a row as a single number, looked up where the row was put together."""
        graph = self.graph
        if graph.op[statement] == "take":
            return self.take((graph.args[statement][lane],))
        if graph.op[statement] == "load":
            memory, first, step, _ = graph.args[statement]
            return self._load(entry(memory, first + lane * step), 0, 1)
        if graph.op[statement] == "lanes":
            return graph.const(graph.args[statement][0][lane], graph.kind[statement])
        args = (entry(statement, lane),)
        return graph.once("take", args, 1, graph.kind[statement], graph.home((statement,)))

    def reduced(self, op: str, table: Table, axes: Sequence[int]) -> Table:
        """All entries along some axes put together by an operation."""
        kept = [axis for axis in range(table.ndim) if axis not in axes]
        shape = tuple(table.shape[axis] for axis in kept)
        moved = np.transpose(self.local(table), [*kept, *axes]).reshape(*shape, -1)
        if 0 in moved.shape:
            return self.constant(np.full(shape, NEUTRAL[op]))
        if moved.shape[-1] == 1:
            return moved[..., 0]
        flat = moved.reshape(-1, moved.shape[-1])
        if not self._along_lanes(flat):
            parts = [moved[..., number] for number in range(moved.shape[-1])]
            return reduce(lambda a, b: self.each(op, a, b), parts)
        made = [entry(self._reduced_row(op, row)) for row in flat]
        return np.array(made, np.int64).reshape(shape)

    def _along_lanes(self, flat: Table) -> bool:
        """Whether entries that are put together are mostly lanes of the same rows."""
        statements = flat >> LANE_BITS
        long = self.graph.length[statements] > 1
        if not long.any():
            return False
        ordered = np.sort(np.where(long, statements, -1), axis=1)
        repeated = (np.diff(ordered, axis=1) == 0) & (ordered[:, 1:] >= 0)
        return bool(repeated.sum() * 2 >= long.sum()) and len(flat) <= flat.shape[1] * 64

    def _reduced_row(self, op: str, row: Table) -> int:
        """One number made of all entries of a row."""
        graph = self.graph
        statements, lanes = row >> LANE_BITS, row & LANE
        of_lanes: dict[tuple[int, ...], list[int]] = {}
        single: list[int] = []
        for statement in dict.fromkeys(statements.tolist()):
            own = lanes[statements == statement]
            if graph.length[statement] == 1:
                single += [statement] * len(own)
                continue
            if len(set(own.tolist())) < len(own):
                single += [self._lane_of(statement, int(lane)) for lane in own]
                continue
            key = (int(graph.length[statement]), *sorted(own.tolist()))
            of_lanes.setdefault(key, []).append(statement)
        for (length, *own), rows in of_lanes.items():
            if len(own) * 2 < length:
                single += [self._lane_of(one, lane) for one in rows for lane in own]
                continue
            together = reduce(lambda a, b: self.maker.make(op, (a, b)), rows)
            if graph.length[together] == 1:  # known after all
                single += [together] * (len(own) if op == "add" else 1)
                continue
            first, count = own[0], len(own)
            if own != list(range(first, first + count)):
                together, first = self.take(tuple(entry(together, lane) for lane in own)), 0
            args = (op, together, first, count)
            kind, owner = graph.kind[together], graph.home((together,))
            single.append(graph.once("reduce", args, 1, kind, owner))
        return reduce(lambda a, b: self.maker.make(op, (a, b)), single)

    def along(self, op: str, table: Table, axis: int, reverse: bool) -> Table:
        """Entries put together up to each along an axis."""
        moved = np.moveaxis(self.local(table), axis, -1)
        if 0 in moved.shape:
            return table
        flat = moved.reshape(-1, moved.shape[-1])
        if moved.shape[-1] > 1 and self._along_lanes(flat):
            made = np.array([self._running(op, row, reverse) for row in flat], np.int64)
            return np.moveaxis(made.reshape(moved.shape), -1, axis)
        places = range(moved.shape[-1])
        parts, total = {}, None
        for place in reversed(places) if reverse else places:
            own = moved[..., place]
            total = own if total is None else self.each(op, total, own)
            parts[place] = total
        return np.moveaxis(np.stack([parts[place] for place in places], axis=-1), -1, axis)

    def _running(self, op: str, row: Table, reverse: bool) -> list[int]:
        graph, size = self.graph, len(row)
        backward = bool((np.diff(row) == -1).all())
        own = np.array(self._row(row[::-1] if backward else row))
        statement = int(own[0]) >> LANE_BITS
        if graph.length[statement] == 1:
            statement = self._spread(statement, size)
        args = (op, statement, reverse != backward)
        kind, owner = graph.kind[statement], graph.home((statement,))
        made = graph.once("along", args, size, kind, owner)
        found = [entry(made, lane) for lane in range(size)]
        return found[::-1] if backward else found

    def _spread(self, statement: int, size: int) -> int:
        graph, args = self.graph, (entry(statement),) * size
        return graph.once("take", args, size, graph.kind[statement], graph.home((statement,)))

    def product(
        self,
        left: Table,
        right: Table,
        contract: tuple[Sequence[int], Sequence[int]],
        batch: tuple[Sequence[int], Sequence[int]],
    ) -> Table:
        """Sum of products over some axes of two arrays, as JAX's `dot_general`."""
        left, right = self.local(left), self.local(right)
        free = [
            [axis for axis in range(one.ndim) if axis not in (*over, *both)]
            for one, over, both in zip((left, right), contract, batch, strict=True)
        ]
        a = np.transpose(left, [*batch[0], *free[0], *contract[0]])
        b = np.transpose(right, [*batch[1], *free[1], *contract[1]])
        shared = a.shape[: len(batch[0])]
        own = a.shape[len(shared) : len(shared) + len(free[0])]
        other = b.shape[len(shared) : len(shared) + len(free[1])]
        over = math.prod(left.shape[axis] for axis in contract[0])
        if 0 in (over, *shared, *own, *other):
            return self.constant(np.zeros((*shared, *own, *other)))
        a = a.reshape(*shared, *own, *(1,) * len(other), over)
        b = b.reshape(*shared, *(1,) * len(own), *other, over)
        if self._along_lanes(a.reshape(-1, a.shape[-1])):
            whole = np.broadcast_shapes(a.shape, b.shape)
            products = self.each("mul", np.broadcast_to(a, whole), np.broadcast_to(b, whole))
            return self.reduced("add", products, [products.ndim - 1])
        total = None
        for number in range(a.shape[-1]):
            parts = np.broadcast_arrays(a[..., number], b[..., number])
            term = self.each("mul", *parts)
            total = term if total is None else self.each("add", total, term)
        assert total is not None
        return total


NEUTRAL: dict[str, Any] = {
    "add": 0.0,
    "mul": 1.0,
    "max": -np.inf,
    "min": np.inf,
    "and": True,
    "or": False,
}
"""What makes no difference to an operation that puts entries together."""


def _different(statements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First places of all different columns, and which one every column is."""
    if len(statements) == 1:
        key = statements[0]
    elif len(statements) == 2:
        key = (statements[0] << 31) + statements[1]
    else:
        key = (statements[0] << 42) + (statements[1] << 21) + statements[2]
    _, first, where = np.unique(key, return_index=True, return_inverse=True)
    return first, where.ravel()


def _empty(shape: tuple[int, ...]) -> Table:
    return np.zeros(shape, np.int64)


__all__ = ["NEUTRAL", "Tables"]
