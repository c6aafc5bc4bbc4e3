"""From a program that JAX has traced to statements, loops and conditions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from notchflex._jax import jax
from notchflex.native.elementary import ELEMENTARY
from notchflex.native.graph import (
    LANE,
    LANE_BITS,
    Block,
    Graph,
    Memory,
    Table,
    UnknownHereError,
    entry,
)
from notchflex.native.moves import MOVES, gathered, picked, scattered
from notchflex.native.tables import Tables

WIDTH = 8
"""Lanes that are computed at once."""

# What is told of every kind of item: the tables that it takes from the blocks around it.


@dataclass(eq=False)
class Put:
    """Entries to be written to memory.

    Attributes:
        table: Entries, flat.
        memory: Where to.
        places: Which of its numbers they become.
    """

    table: Table
    memory: Memory
    places: np.ndarray


@dataclass(eq=False)
class Loop:
    """A `while` loop.

    Attributes:
        before: What is carried into it.
        test: The block that says whether to go on.
        going: Its entry for that.
        body: The block that is repeated.
        after: What it carries on.
        rows: Whether every row of a batch goes on or stops by itself.
    """

    before: list[Put]
    test: Block
    going: int
    body: Block
    after: list[Put]
    rows: bool


@dataclass(eq=False)
class Steps:
    """A loop of a known number of steps, along tables.

    Attributes:
        before: What is carried into it, and tables that are put in memory first.
        count: How many steps.
        reverse: Whether from the last on.
        along: Memory of the present step, a part of that of its table.
        tables: Entries of tables that lie in memory before the loop.
        body: The block that is repeated.
        after: What it carries on, and what it adds to its tables.
    """

    before: list[Put]
    count: int
    reverse: bool
    along: list[Memory]
    tables: list[int]
    body: Block
    after: list[Put]


@dataclass(eq=False)
class Choice:
    """Blocks of which one is run.

    Attributes:
        which: Entry of its number.
        branches: The blocks, and what each hands on.
        rows: Whether rows of a batch may choose differently.
    """

    which: int
    branches: list[tuple[Block, list[Put]]]
    rows: bool


@dataclass(eq=False)
class Rows:
    """Rows of a batch, as many at once as there are lanes.

    Attributes:
        given: By number of the table that is given, memory of the present rows.
        body: What is done with them.
        put: What it hands on.
        out: Memory that this is put in, for each table handed on.
    """

    given: dict[int, Memory]
    body: Block
    put: list[Put]
    out: list[Memory]


@dataclass(eq=False)
class Program:
    """A program read whole.

    Attributes:
        graph: Its statements.
        put: What the outermost block writes to what is handed on.
        written: Statements of memory that is handed on as it is.
        sizes: Numbers handed on, by output; of a row where there are rows.
        rows: Whether it is a batch.
    """

    graph: Graph
    put: list[Put]
    written: list[int]
    sizes: list[int]
    rows: bool


class Reader:
    """Reads programs of JAX.

    Args:
        long: Sizes of axes along which rows are laid out.
    """

    def __init__(self, long: Sequence[int]) -> None:
        """Begin an empty program."""
        self.graph = Graph()
        self.tables = Tables(self.graph, long)
        self.rows = False

    # Memory

    def _arranged(self, shape: tuple[int, ...]) -> tuple[int, np.ndarray]:
        """How many numbers memory for an array has, and where its entries are in it.

        Rows along the long axis lie together, each filled up to whole vectors.
        """
        axis = next((a for a, size in enumerate(shape) if size in self.tables.long), None)
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
        return self.tables.local(table) if self._is_long(table.shape) else table

    def _is_long(self, shape: tuple[int, ...]) -> bool:
        return len(shape) > 1 and any(size in self.tables.long for size in shape)

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
            args.append(self._seen(memory, places, body if own else top))
        self.graph.block, self.rows = body, True
        put, sizes = self._handed(closed, args, lambda _: ("arena", None))
        self.graph.block, self.rows = top, False
        for one in put:
            one.memory.rows = True
        self._item(Rows(tables, body, put, [one.memory for one in put]), top)
        return Program(self.graph, [], [], sizes, True)

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

    def _as_numbers(self, flat: Table) -> Table:
        if not flat.size:
            return flat
        kinds = {self.graph.kind[int(one)] for one in np.unique(flat >> LANE_BITS).tolist()}
        return flat if kinds == {"f"} else self.tables.each("to_float", flat)

    def _item(self, item: Any, block: Block) -> None:
        """Put a loop or condition in a block, behind all statements that there are so far."""
        number = self.graph.add("item", (item,), 0, "f", block)
        block.items[number] = item

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
        if name in _LANES:
            return [self.tables.each(_LANES[name], *given)]
        if name in ELEMENTARY:
            return self.closed(_elementary(name, len(given)), given, lanes=True)
        if name in _INNER:
            inner = parameters[_INNER[name]]
            if hasattr(inner, "consts"):
                return self.closed(inner, given, lanes=lanes)
            return self._traced(inner, [], given, lanes)
        if name in _OTHER:
            came = _OTHER[name](self, given, parameters, equation)
            return came if isinstance(came, list) else [came]
        raise UnknownHereError(f"JAX's primitive `{name}`")

    def _unpacked(self, table: Table) -> Table:
        return self.tables.local(table) if self._is_long(table.shape) else table

    def known(self, table: Table) -> np.ndarray | None:
        """The numbers of an array where all are known."""
        flat = [self.graph.value(int(one)) for one in (table >> LANE_BITS).ravel()]
        if any(value is None for value in flat):
            return None
        return np.array(flat).reshape(table.shape) if flat else np.zeros(table.shape, int)

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
        memory = [self._new(one.shape, _kind(one.dtype)) for one in carried]
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
        # Looked at here, so that it is there before the loop.
        self._item(Loop(before, test, going, body, after, self.rows), self.graph.block)
        return [self._seen(*one, self.graph.block) for one in memory]

    def _put(self, table: Table, where: tuple[Memory, np.ndarray]) -> Put:
        memory, places = where
        flat = self._rows_of(table, places)
        return Put(flat.ravel(), memory, places.ravel())

    def _rows_of(self, table: Table, places: np.ndarray) -> Table:
        """Entries in rows as memory has them, so that they can be written row by row."""
        table = np.broadcast_to(table, places.shape)
        if not self._is_long(places.shape):
            return table
        table = self.tables.local(table)
        axis = next(a for a, size in enumerate(places.shape) if size in self.tables.long)
        return self.tables.rows(table, axis)

    def steps(self, given: list[Table], parameters: dict[str, Any]) -> list[Table]:
        """A loop along tables."""
        known, carried = parameters["num_consts"], parameters["num_carry"]
        closed, count = parameters["jaxpr"], parameters["length"]
        start, tables = given[known : known + carried], given[known + carried :]
        avals = closed.out_avals
        memory = [self._new(one.shape, _kind(one.dtype)) for one in avals[:carried]]
        before = [self._put(*pair) for pair in zip(start, memory, strict=True)]
        body = self.graph.block.inner(repeats=True)
        along: list[Memory] = []
        looked: list[int] = []
        present: list[Table] = []
        for table, aval in zip(tables, closed.in_avals[known + carried :], strict=True):
            size = int(np.prod(aval.shape))
            whole, first = self._whole(table, before)
            looked.append(int(table.ravel()[0]))
            own = Memory("step", size, whole, first, rows=whole.rows, inside=whole.inside)
            along.append(own)
            present.append(
                entry(self.graph.memory(own, body)) + np.arange(size).reshape(aval.shape)
            )
        with self.inside(body):
            present = [self._unpacked(one) for one in present]
            seen = [self._seen(*one, body) for one in memory]
            came = self.closed(closed, [*given[:known], *seen, *present])
            after = [self._put(*pair) for pair in zip(came[:carried], memory, strict=True)]
            results: list[Memory] = []
            for table, aval in zip(came[carried:], avals[carried:], strict=True):
                size = int(np.prod(aval.shape))
                inside = _kind(aval.dtype)
                whole = Memory("arena", size * count, rows=self.rows, inside=inside)
                own = Memory("step", size, whole, 0, rows=self.rows, inside=inside)
                results.append(whole)
                along.append(own)
                after.append(Put(table.ravel(), own, np.arange(size)))
        item = Steps(before, count, parameters["reverse"], along, looked, body, after)
        self._item(item, self.graph.block)
        carry = [self._seen(*one, self.graph.block) for one in memory]
        made: list[Table] = []
        for whole, aval in zip(results, avals[carried:], strict=True):
            places = np.arange(whole.size).reshape(count, *aval.shape)
            made.append(entry(self.graph.memory(whole, self.graph.block)) + places)
        return [*carry, *made]

    def _whole(self, table: Table, before: list[Put]) -> tuple[Memory, int]:
        """Memory that holds a table in order, and where it begins there; put there if need be."""
        flat = table.ravel()
        first = int(flat[0])
        statement = first >> LANE_BITS
        if self.graph.length[statement] == 0 and (np.diff(flat) == 1).all():
            return self.graph.args[statement][0], first & LANE
        flat = self.tables.local(flat)
        kind = self.graph.kind[int(flat[0]) >> LANE_BITS]
        memory = Memory("arena", flat.size, rows=self.rows, inside=kind)
        before.append(Put(flat, memory, np.arange(flat.size)))
        return memory, 0

    def choice(self, given: list[Table], parameters: dict[str, Any]) -> list[Table]:
        """A condition."""
        branches = parameters["branches"]
        which = self.tables.local(given[0])
        known = self.known(which)
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
        memory = [self._new(one.shape, _kind(one.dtype)) for one in avals]
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


def _kind(dtype: Any) -> str:
    kind = np.dtype(dtype).kind
    return "i" if kind == "u" else kind


@cache
def _elementary(name: str, count: int) -> Any:
    return jax.make_jaxpr(ELEMENTARY[name])(*[1.0] * count)


_LANES = {
    "add": "add",
    "add_any": "add",
    "sub": "sub",
    "mul": "mul",
    "div": "div",
    "neg": "neg",
    "abs": "abs",
    "sqrt": "sqrt",
    "max": "max",
    "min": "min",
    "eq": "eq",
    "ne": "ne",
    "lt": "lt",
    "le": "le",
    "gt": "gt",
    "ge": "ge",
    "and": "and",
    "or": "or",
    "xor": "xor",
    "not": "not",
    "is_finite": "is_finite",
    "floor": "floor",
    "ceil": "ceil",
    "shift_left": "shl",
    "shift_right_logical": "lshr",
    "shift_right_arithmetic": "ashr",
}
_INNER = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "core_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vjp_call": "call_jaxpr",
    "remat": "jaxpr",
    "checkpoint": "jaxpr",
}


def _select(reader: Reader, given: list[Table], _p: Any, equation: Any) -> Table:
    which, *cases = given
    if len(cases) != 2:
        raise UnknownHereError("a choice among more than two arrays")
    if equation.invars[0].aval.dtype != bool:
        which = reader.tables.each("to_bool", which)
    return reader.tables.each("select", which, cases[1], cases[0])


def _sign(reader: Reader, given: list[Table], _p: Any, _e: Any) -> Table:
    each, constant = reader.tables.each, reader.tables.constant
    (x,) = given
    zero = constant(0.0)
    below = each("select", each("lt", x, zero), constant(-1.0), x)
    return each("select", each("gt", x, zero), constant(1.0), below)


def _integer_pow(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
    power, (x,), each = parameters["y"], given, reader.tables.each
    rest, total, square = abs(power), None, x
    while rest:
        if rest & 1:
            total = square if total is None else each("mul", total, square)
        rest >>= 1
        square = each("mul", square, square) if rest else square
    if total is None:
        return reader.tables.constant(np.ones(x.shape))
    return each("div", reader.tables.constant(1.0), total) if power < 0 else total


def _square(reader: Reader, given: list[Table], _p: Any, _e: Any) -> Table:
    return reader.tables.each("mul", given[0], given[0])


def _clamp(reader: Reader, given: list[Table], _p: Any, _e: Any) -> Table:
    low, x, high = given
    return reader.tables.each("min", reader.tables.each("max", x, low), high)


def _round(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
    to_even = int(parameters["rounding_method"]) == 1
    return reader.tables.each("round_even" if to_even else "round_away", *given)


def _convert(reader: Reader, given: list[Table], parameters: Any, equation: Any) -> Table:
    old, new = _kind(equation.invars[0].aval.dtype), _kind(parameters["new_dtype"])
    if old == new:
        return given[0]
    return reader.tables.each({"f": "to_float", "i": "to_int", "b": "to_bool"}[new], given[0])


def _bits(reader: Reader, given: list[Table], parameters: Any, equation: Any) -> Table:
    old, new = np.dtype(equation.invars[0].aval.dtype), np.dtype(parameters["new_dtype"])
    if old.itemsize != 8 or new.itemsize != 8:
        raise UnknownHereError("numbers of other than 64 bits")
    if old.kind == new.kind:
        return given[0]
    return reader.tables.each("as_bits" if old.kind == "f" else "of_bits", given[0])


def _iota(reader: Reader, _given: list[Table], parameters: Any, _e: Any) -> Table:
    shape, axis = parameters["shape"], parameters["dimension"]
    values = np.arange(shape[axis]).reshape([-1 if a == axis else 1 for a in range(len(shape))])
    values = np.broadcast_to(values, shape).astype(parameters["dtype"])
    return reader.tables.constant(values)


def _platform(reader: Reader, _given: list[Table], parameters: Any, _e: Any) -> Table:
    own = (number for number, names in enumerate(parameters["platforms"]) if _serves(names))
    return reader.tables.constant(next(own))


def _serves(names: tuple[str, ...] | None) -> bool:
    return names is None or "cpu" in names


def _product(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
    left, right = given
    contract, batch = parameters["dimension_numbers"]
    return reader.tables.product(left, right, contract, batch)


def _gather(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
    places, each = reader.known(given[1]), reader.tables.each

    def chosen(starts: Table, number: int, one: Table, other: Table) -> Table:
        return each("select", each("eq", starts, reader.tables.constant(number)), one, other)

    if places is None:
        at = reader.tables.local(given[1])
        return picked(reader.tables.local(given[0]), at, parameters, chosen)
    return gathered(given[0], places, parameters)


def _scatter(op: str | None) -> Callable[..., Table]:
    def put(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
        table, at, updates = given
        places = reader.known(at)
        if places is None:
            raise UnknownHereError("places in an array that are computed")

        def joined(old: Table, new: Table) -> Table:
            return new if op is None else reader.tables.each(op, old, new)

        return scattered(table, places, updates, parameters, joined)

    return put


def _reduced(op: str) -> Callable[..., Table]:
    def put_together(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
        return reader.tables.reduced(op, given[0], parameters["axes"])

    return put_together


def _extreme(op: str) -> Callable[..., Table]:
    def place(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
        """Where the largest or smallest entry is; the first that is no number, if there is one."""
        each, constant = reader.tables.each, reader.tables.constant
        (axis,) = parameters["axes"]
        values = np.moveaxis(reader.tables.local(given[0]), axis, 0)
        best = values[0]
        found = np.broadcast_to(constant(0), best.shape)
        for number in range(1, len(values)):
            own = values[number]
            none = each("and", each("ne", own, own), each("eq", best, best))
            better = each("or", each(op, own, best), none)
            found = each("select", better, constant(number), found)
            best = each("select", better, own, best)
        return found

    return place


def _running(op: str) -> Callable[..., Table]:
    def running(reader: Reader, given: list[Table], parameters: Any, _e: Any) -> Table:
        return reader.tables.along(op, given[0], parameters["axis"], parameters["reverse"])

    return running


_OTHER: dict[str, Callable[..., Any]] = {
    "select_n": _select,
    "sign": _sign,
    "integer_pow": _integer_pow,
    "square": _square,
    "clamp": _clamp,
    "round": _round,
    "convert_element_type": _convert,
    "bitcast_convert_type": _bits,
    "iota": _iota,
    "platform_index": _platform,
    "dot_general": _product,
    "gather": _gather,
    "scatter": _scatter(None),
    "scatter-add": _scatter("add"),
    "scatter_add": _scatter("add"),
    "reduce_sum": _reduced("add"),
    "reduce_prod": _reduced("mul"),
    "reduce_max": _reduced("max"),
    "reduce_min": _reduced("min"),
    "reduce_and": _reduced("and"),
    "reduce_or": _reduced("or"),
    "argmax": _extreme("gt"),
    "argmin": _extreme("lt"),
    "cumsum": _running("add"),
    "cumprod": _running("mul"),
    "cummax": _running("max"),
    "cummin": _running("min"),
    "while": lambda reader, given, parameters, _e: reader.loop(given, parameters),
    "scan": lambda reader, given, parameters, _e: reader.steps(given, parameters),
    "cond": lambda reader, given, parameters, _e: reader.choice(given, parameters),
}

__all__ = ["WIDTH", "Choice", "Loop", "Program", "Put", "Reader", "Rows", "Steps"]
