"""From a program that JAX has traced to statements, loops and conditions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from lanewise._jax import jax
from lanewise.elementary import ELEMENTARY
from lanewise.ir.control_flow import Choice, Loop, Program, Put, Rows, Steps
from lanewise.ir.graph import LANE_BITS, Block, Memory, Table, UnknownHereError, entry
from lanewise.lowering.arrange import Arranger
from lanewise.lowering.data_movement import MOVES
from lanewise.lowering.operations import INNER, LANES, OTHER, kind_of
from lanewise.lowering.step_tables import StepTables


class Reader(Arranger):
    """Reads programs of JAX.

    Args:
        long: Sizes of axes along which rows are laid out.
    """

    # Whole programs

    def single(self, closed: Any) -> Program:
        """A program of arrays; what it hands on becomes vectors."""
        args: list[Table] = []
        for number, aval in enumerate(closed.in_avals):
            places = _in_order(aval.shape)
            args.append(self._seen(Memory("given", places.size, number), places, self.graph.top))
        put, sizes = self._handed(closed, args, lambda number: ("result", number))
        written = [self._in_place(one) for one in put]
        left = [one for one, number in zip(put, written, strict=True) if number is None]
        whole = [number for number in written if number is not None]
        return Program(self.graph, left, whole, sizes, False)

    def _in_place(self, put: Put) -> int | None:
        """A statement of memory that is handed on whole and in order, which then lies there."""
        if not put.table.size:
            return None
        number = int(put.table[0]) >> LANE_BITS
        if self.graph.op[number] != "memory":
            return None
        memory: Memory = self.graph.args[number][0]
        whole = entry(number) + np.arange(memory.size)
        if memory.place != "arena" or not np.array_equal(put.table, whole):
            return None
        memory.place, memory.number = "result", put.memory.number
        return number

    def batch(self, closed: Any, by_row: Sequence[bool]) -> Program:
        """A program of which some arrays are rows of tables, all rows alike."""
        top = self.graph.top
        body = top.inner(repeats=True)
        tables: dict[int, Memory] = {}
        args: list[Table] = []
        for number, (aval, own) in enumerate(zip(closed.in_avals, by_row, strict=True)):
            places = _in_order(aval.shape)
            if own:
                tables[number] = Memory("arena", places.size, rows=True)
            memory = tables.get(number) or Memory("given", places.size, number)
            block = body if own else top
            with self.inside(block):
                args.append(self._seen(memory, places, block))
        self.graph.block, self.rows = body, True
        put, sizes = self._handed(closed, args, lambda _: ("arena", None))
        self.graph.block, self.rows = top, False
        for one in put:
            one.memory.rows = True
        self._item(Rows(tables, body, put, [one.memory for one in put]), top)
        return Program(self.graph, [], [], sizes, True)

    def path(self, closed: Any, by_row: Sequence[bool]) -> Program:
        """A program that runs along tables and carries a vector from row to row.

        The first array is the vector carried into it; the function returns the vector carried on,
        and then the results of the row.
        """
        top = self.graph.top
        body = top.inner(repeats=True)
        carried, before = self._new(closed.in_avals[0].shape, "f"), list[Put]()
        args: list[Table] = []
        along: list[Memory] = []
        for number, (aval, own) in enumerate(zip(closed.in_avals, by_row, strict=True)):
            places = _in_order(aval.shape)
            memory = Memory("given", places.size, number)
            if own:
                memory = Memory("step", places.size, memory, 0, stride=places.size)
                along.append(memory)
            block = body if own else top
            with self.inside(block):
                table = self._seen(memory, places, block)
            if number == 0:
                before = [self._put(self.tables.local(table), carried)]
                with self.inside(body):
                    table = self._seen(*carried, body)
            args.append(table)
        with self.inside(body):
            carry, *results = self.closed(closed, args)
            after = [self._put(carry, carried)]
            sizes: list[int] = []
            for number, table in enumerate(results):
                flat = self._as_numbers(table.ravel())
                whole = Memory("result", flat.size, number)
                own = Memory("step", flat.size, whole, 0, stride=flat.size)
                along.append(own)
                after.append(Put(flat, own, np.arange(flat.size)))
                sizes.append(flat.size)
        self._item(Steps(before, None, False, along, [], body, after), top)
        return Program(self.graph, [], [], sizes, False)

    def _handed(
        self, closed: Any, args: list[Table], where: Callable[[int], tuple[str, Any]]
    ) -> tuple[list[Put], list[int]]:
        out = self.closed(closed, args)
        put: list[Put] = []
        for number, table in enumerate(out):
            place, of = where(number)
            flat = self._as_numbers(table.ravel())
            put.append(Put(flat, Memory(place, flat.size, of), np.arange(flat.size)))
        return put, [one.memory.size for one in put]

    def _item(self, item: Any, block: Block) -> None:
        """Put a loop or condition in a block, behind all statements that there are so far."""
        self.graph.add("item", (item,), 0, "f", block)

    # What JAX has traced

    def closed(self, closed: Any, args: Sequence[Table], *, lanes: bool = False) -> list[Table]:
        """What a traced function makes of tables.

        Args:
            closed: The function.
            args: Tables.
            lanes: Whether it was traced for one number, and is meant for arrays of any shape.
        """
        consts = [self.tables.constant(np.asarray(value)) for value in closed.consts]
        return self._traced(closed.jaxpr, consts, args, lanes)

    def _traced(
        self, jaxpr: Any, consts: Sequence[Table], args: Sequence[Table], lanes: bool = False
    ) -> list[Table]:
        known: dict[Any, Table] = {}
        known.update(zip(jaxpr.constvars, consts, strict=True))
        known.update(zip(jaxpr.invars, args, strict=True))

        def at(variable: Any) -> Table:
            if hasattr(variable, "val"):
                return self.tables.constant(np.asarray(variable.val))
            return known[variable]

        for equation in jaxpr.eqns:
            given = [at(variable) for variable in equation.invars]
            if lanes and equation.primitive.name == "broadcast_in_dim":
                came: list[Table] = [given[0]]
            else:
                came = self._equation(equation, given, lanes)
            for variable, table in zip(equation.outvars, came, strict=True):
                known[variable] = table
        return [at(variable) for variable in jaxpr.outvars]

    def _equation(self, equation: Any, given: list[Table], lanes: bool) -> list[Table]:
        name, parameters = equation.primitive.name, equation.params
        if name in MOVES:
            came = MOVES[name](*given, **parameters)
            came = came if isinstance(came, list) else [came]
            return [self._unpacked(table) for table in came] if name == "reshape" else came
        if name in LANES:
            return [self.tables.each(LANES[name], *given)]
        if name in ELEMENTARY:
            return self.closed(_elementary(name, len(given)), given, lanes=True)
        if name in INNER:
            inner = parameters[INNER[name]]
            if hasattr(inner, "consts"):
                return self.closed(inner, given, lanes=lanes)
            return self._traced(inner, [], given, lanes)
        if name in _CONTROL:
            return _CONTROL[name](self, given, parameters)
        if name in OTHER:
            came = OTHER[name](self.tables, given, parameters, equation)
            return came if isinstance(came, list) else [came]
        raise UnknownHereError(f"JAX's primitive `{name}`")

    # Loops and conditions

    def inside(self, block: Block) -> _Inside:
        """Read what follows into a block."""
        return _Inside(self, block)

    def loop(self, given: list[Table], parameters: dict[str, Any]) -> list[Table]:
        """A `while` loop."""
        test_known, body_known = parameters["cond_nconsts"], parameters["body_nconsts"]
        for_test, for_body = given[:test_known], given[test_known : test_known + body_known]
        start = given[test_known + body_known :]
        carried = parameters["body_jaxpr"].out_avals
        memory = [self._new(one.shape, kind_of(one.dtype)) for one in carried]
        test, body = (self.graph.block.inner(repeats=True) for _ in range(2))
        with self.inside(test):
            seen = [self._seen(*one, test) for one in memory]
            going = self.closed(parameters["cond_jaxpr"], [*for_test, *seen])[0]
            going = int(self.tables.local(going).reshape(()))
        with self.inside(body):
            seen = [self._seen(*one, body) for one in memory]
            came = self.closed(parameters["body_jaxpr"], [*for_body, *seen])
            after = [self._put(*pair) for pair in zip(came, memory, strict=True)]
        before = [self._put(*pair) for pair in zip(start, memory, strict=True)]
        self._item(Loop(before, test, going, body, after, self.rows), self.graph.block)
        return [self._seen(*one, self.graph.block) for one in memory]

    def steps(self, given: list[Table], parameters: dict[str, Any]) -> list[Table]:
        """A loop along tables."""
        known, carried = parameters["num_consts"], parameters["num_carry"]
        closed, count = parameters["jaxpr"], parameters["length"]
        start, tables = given[known : known + carried], given[known + carried :]
        avals = closed.out_avals
        if count == 0:
            none = [np.zeros((0, *one.shape)) for one in avals[carried:]]
            return [*start, *map(self.tables.constant, none)]
        memory = [self._new(one.shape, kind_of(one.dtype)) for one in avals[:carried]]
        before = [self._put(*pair) for pair in zip(start, memory, strict=True)]
        body = self.graph.block.inner(repeats=True)
        seen = StepTables(self.graph, body, count, self.rows)
        present = [seen.present(table, self.tables.local) for table in tables]
        before += seen.before
        with self.inside(body):
            present = [self._unpacked(one) for one in present]
            seen_carry = [self._seen(*one, body) for one in memory]
            came = self.closed(closed, [*given[:known], *seen_carry, *present])
            after = [self._put(*pair) for pair in zip(came[:carried], memory, strict=True)]
            results: list[tuple[Memory, np.ndarray]] = []
            for number, aval in enumerate(avals[carried:]):
                size, places = self._arranged(aval.shape)
                inside = kind_of(aval.dtype)
                whole = Memory("arena", size * count, rows=self.rows, inside=inside)
                results.append((whole, places))
                own = Memory("step", size, whole, 0, self.rows, inside, size, count)
                seen.along.append(own)
                after.append(self._put(came[carried + number], (own, places)))
        reverse = parameters["reverse"]
        item = Steps(before, count, reverse, seen.along, seen.looked, body, after)
        self._item(item, self.graph.block)
        carry = [self._seen(*one, self.graph.block) for one in memory]
        made: list[Table] = []
        for whole, places in results:
            stride = whole.size // count
            steps = np.arange(count).reshape(-1, *(1,) * places.ndim) * stride
            made.append(entry(self.graph.memory(whole, self.graph.block)) + steps + places)
        return [*carry, *made]

    def choice(self, given: list[Table], parameters: dict[str, Any]) -> list[Table]:
        """A condition."""
        branches = parameters["branches"]
        which = self.tables.local(given[0])
        known = self.tables.known(which)
        if known is not None:
            number = int(np.clip(int(known), 0, len(branches) - 1))
            return self.closed(branches[number], given[1:])
        avals = branches[0].out_avals
        blocks: list[Block] = []
        came: list[list[Table]] = []
        for branch in branches:
            block = self.graph.block.inner(repeats=False)
            with self.inside(block):
                came.append(self.closed(branch, given[1:]))
            blocks.append(block)
        memory = [self._new(one.shape, kind_of(one.dtype)) for one in avals]
        same = [
            all(np.array_equal(tables[at], came[0][at]) for tables in came)
            for at in range(len(avals))
        ]
        made: list[tuple[Block, list[Put]]] = []
        for block, tables in zip(blocks, came, strict=True):
            with self.inside(block):
                put = [
                    self._put(table, own)
                    for table, own, alike in zip(tables, memory, same, strict=True)
                    if not alike
                ]
            made.append((block, put))
        self._item(Choice(int(which.reshape(())), made, self.rows), self.graph.block)
        return [
            came[0][at] if same[at] else self._seen(*memory[at], self.graph.block)
            for at in range(len(avals))
        ]


class _Inside:
    """What is read meanwhile belongs to a block."""

    def __init__(self, reader: Reader, block: Block) -> None:
        self._reader, self._block = reader, block

    def __enter__(self) -> None:
        graph = self._reader.graph
        self._outer, graph.block = graph.block, self._block

    def __exit__(self, *_: object) -> None:
        self._reader.graph.block = self._outer


def _in_order(shape: tuple[int, ...]) -> np.ndarray:
    return np.arange(math.prod(shape)).reshape(shape)


@cache
def _elementary(name: str, count: int) -> Any:
    return jax.make_jaxpr(ELEMENTARY[name])(*[1.0] * count)


_CONTROL: dict[str, Callable[[Reader, list[Table], dict[str, Any]], list[Table]]] = {
    "while": Reader.loop,
    "scan": Reader.steps,
    "cond": Reader.choice,
}

__all__ = ["Reader"]
