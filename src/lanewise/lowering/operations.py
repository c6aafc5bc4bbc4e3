"""JAX's primitives, and what they do with tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.ir.graph import Table, UnknownHereError
from lanewise.lowering.data_movement import gathered, picked, scattered
from lanewise.lowering.tables import Tables


def kind_of(dtype: Any) -> str:
    """Kind of the numbers of an array."""
    kind = np.dtype(dtype).kind
    return "i" if kind == "u" else kind


LANES = {
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
INNER = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "core_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vjp_call": "call_jaxpr",
    "remat": "jaxpr",
    "checkpoint": "jaxpr",
}


def _select(tables: Tables, given: list[Table], _p: Any, equation: Any) -> Table:
    which, *cases = given
    if len(cases) != 2:
        raise UnknownHereError("a choice among more than two arrays")
    if equation.invars[0].aval.dtype != bool:
        which = tables.each("to_bool", which)
    return tables.each("select", which, cases[1], cases[0])


def _sign(tables: Tables, given: list[Table], _p: Any, _e: Any) -> Table:
    each, constant = tables.each, tables.constant
    (x,) = given
    zero = constant(0.0)
    below = each("select", each("lt", x, zero), constant(-1.0), x)
    return each("select", each("gt", x, zero), constant(1.0), below)


def _integer_pow(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
    power, (x,), each = parameters["y"], given, tables.each
    rest, total, square = abs(power), None, x
    while rest:
        if rest & 1:
            total = square if total is None else each("mul", total, square)
        rest >>= 1
        square = each("mul", square, square) if rest else square
    if total is None:
        return tables.constant(np.ones(x.shape))
    return each("div", tables.constant(1.0), total) if power < 0 else total


def _square(tables: Tables, given: list[Table], _p: Any, _e: Any) -> Table:
    return tables.each("mul", given[0], given[0])


def _clamp(tables: Tables, given: list[Table], _p: Any, _e: Any) -> Table:
    low, x, high = given
    return tables.each("min", tables.each("max", x, low), high)


def _round(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
    to_even = int(parameters["rounding_method"]) == 1
    return tables.each("round_even" if to_even else "round_away", *given)


def _convert(tables: Tables, given: list[Table], parameters: Any, equation: Any) -> Table:
    old, new = kind_of(equation.invars[0].aval.dtype), kind_of(parameters["new_dtype"])
    if old == new:
        return given[0]
    return tables.each({"f": "to_float", "i": "to_int", "b": "to_bool"}[new], given[0])


def _bits(tables: Tables, given: list[Table], parameters: Any, equation: Any) -> Table:
    old, new = np.dtype(equation.invars[0].aval.dtype), np.dtype(parameters["new_dtype"])
    if old.itemsize != 8 or new.itemsize != 8:
        raise UnknownHereError("numbers of other than 64 bits")
    if old.kind == new.kind:
        return given[0]
    return tables.each("as_bits" if old.kind == "f" else "of_bits", given[0])


def _iota(tables: Tables, _given: list[Table], parameters: Any, _e: Any) -> Table:
    shape, axis = parameters["shape"], parameters["dimension"]
    values = np.arange(shape[axis]).reshape([-1 if a == axis else 1 for a in range(len(shape))])
    values = np.broadcast_to(values, shape).astype(parameters["dtype"])
    return tables.constant(values)


def _platform(tables: Tables, _given: list[Table], parameters: Any, _e: Any) -> Table:
    own = (number for number, names in enumerate(parameters["platforms"]) if _serves(names))
    return tables.constant(next(own))


def _serves(names: tuple[str, ...] | None) -> bool:
    return names is None or "cpu" in names


def _product(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
    left, right = given
    contract, batch = parameters["dimension_numbers"]
    return tables.product(left, right, contract, batch)


def _gather(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
    places, each = tables.known(given[1]), tables.each

    def chosen(starts: Table, number: int, one: Table, other: Table) -> Table:
        return each("select", each("eq", starts, tables.constant(number)), one, other)

    if places is None:
        at = tables.local(given[1])
        return picked(tables.local(given[0]), at, parameters, chosen)
    return gathered(given[0], places, parameters)


def _scatter(op: str | None) -> Callable[..., Table]:
    def put(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
        table, at, updates = given
        places = tables.known(at)
        if places is None:
            raise UnknownHereError("places in an array that are computed")

        def joined(old: Table, new: Table) -> Table:
            return new if op is None else tables.each(op, old, new)

        return scattered(table, places, updates, parameters, joined)

    return put


def _reduced(op: str) -> Callable[..., Table]:
    def put_together(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
        return tables.reduced(op, given[0], parameters["axes"])

    return put_together


def _extreme(op: str) -> Callable[..., Table]:
    def place(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
        """Where the largest or smallest entry is; the first that is no number, if there is one."""
        each, constant = tables.each, tables.constant
        (axis,) = parameters["axes"]
        values = np.moveaxis(tables.local(given[0]), axis, 0)
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
    def running(tables: Tables, given: list[Table], parameters: Any, _e: Any) -> Table:
        return tables.along(op, given[0], parameters["axis"], parameters["reverse"])

    return running


OTHER: dict[str, Callable[..., Any]] = {
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
}

__all__ = ["INNER", "LANES", "OTHER", "kind_of"]
