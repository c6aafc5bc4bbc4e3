"""Lower JAX's primitives that compute, other than loops and branches.

Each function takes the array lowering, the operands, the parameters of the primitive and the kinds
of numbers (as dtypes) of its operands and results.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from lanewise.ir.graph import References, UnsupportedPrimitiveError
from lanewise.lowering.arrays import ArrayLowering
from lanewise.lowering.data_movement import gather_candidates, gather_static, scatter_static
from lanewise.lowering.reductions import dot_general, prefix, reduce_axes


def kind_of(dtype: Any) -> str:
    """Return the kind of an array's numbers: "f", "i" or "b".

    Raises:
        UnsupportedPrimitiveError: The numbers are not 64-bit floats, signed integers or booleans.
    """
    dtype = np.dtype(dtype)
    if dtype.kind not in "fib" or (dtype.kind == "f" and dtype.itemsize != 8):
        raise UnsupportedPrimitiveError(f"numbers of type {dtype}")
    return dtype.kind


ELEMENTWISE = {
    name: name
    for name in (
        *("add", "sub", "mul", "neg", "abs", "sqrt", "max", "min", "floor", "ceil"),
        *("eq", "ne", "lt", "le", "gt", "ge", "and", "or", "xor", "not", "is_finite"),
    )
} | {"add_any": "add"}
"""The operation of a node for each primitive that is one operation lane by lane."""

Operands = list[References]


def _kind(equation: Any) -> str:
    return kind_of(equation.invars[0].aval.dtype)


def _div(arrays: ArrayLowering, operands: Operands, _p: Any, equation: Any) -> References:
    """Divide; integers as XLA does, without the traps of processors."""
    each, constant = arrays.elementwise, arrays.constant
    if _kind(equation) == "f":
        return each("div", *operands)
    a, b = operands
    zero, minus = (each("eq", b, constant(one)) for one in (0, -1))
    quotient = each("div", a, each("select", each("or", zero, minus), constant(1), b))
    quotient = each("select", minus, each("neg", a), quotient)
    return each("select", zero, constant(-1), quotient)


def _shift(op: str) -> Callable[..., References]:
    def lower(arrays: ArrayLowering, operands: Operands, _p: Any, equation: Any) -> References:
        """Shift by any count; by all bits where it is negative or too large."""
        each, constant = arrays.elementwise, arrays.constant
        value, count = operands
        bits = 8 * np.dtype(equation.invars[0].aval.dtype).itemsize
        if bits != 64:
            raise UnsupportedPrimitiveError("shifts of other than 64 bits", equation.primitive.name)
        known = arrays.known(count)
        if known is not None and ((known >= 0) & (known < bits)).all():
            return each(op, value, count)
        valid = each("and", each("ge", count, constant(0)), each("lt", count, constant(bits)))
        shifted = each(op, value, each("select", valid, count, constant(bits - 1)))
        return shifted if op == "ashr" else each("select", valid, shifted, constant(0))

    return lower


def _select(arrays: ArrayLowering, operands: Operands, _p: Any, equation: Any) -> References:
    which, *cases = operands
    if len(cases) != 2:
        raise UnsupportedPrimitiveError("a choice among more than two arrays", "select_n")
    if _kind(equation) != "b":
        which = arrays.elementwise("to_bool", which)
    return arrays.elementwise("select", which, cases[1], cases[0])


def _sign(arrays: ArrayLowering, operands: Operands, _p: Any, equation: Any) -> References:
    each, (x,) = arrays.elementwise, operands
    zero, minus, one = (
        arrays.constant(np.asarray(value, float if _kind(equation) == "f" else int))
        for value in (0, -1, 1)
    )
    negative = each("select", each("lt", x, zero), minus, x)
    return each("select", each("gt", x, zero), one, negative)


def _integer_pow(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> Any:
    power, (x,), each = params["y"], operands, arrays.elementwise
    rest, result, square = abs(power), None, x
    while rest:
        if rest & 1:
            result = square if result is None else each("mul", result, square)
        rest >>= 1
        square = each("mul", square, square) if rest else square
    if result is None:
        return arrays.constant(np.ones(x.shape, float if _kind(equation) == "f" else int))
    return each("div", arrays.constant(1.0), result) if power < 0 else result


def _square(arrays: ArrayLowering, operands: Operands, _p: Any, _e: Any) -> References:
    return arrays.elementwise("mul", operands[0], operands[0])


def _one_minus_square(arrays: ArrayLowering, operands: Operands, _p: Any, equation: Any) -> Any:
    """Return (1 + x)(1 - x), which keeps its digits where x is near 1 (JAX 0.12 or later)."""
    each, (x,) = arrays.elementwise, operands
    one = arrays.constant(np.asarray(1, float if _kind(equation) == "f" else int))
    return each("mul", each("add", one, x), each("sub", one, x))


def _polynomial(arrays: ArrayLowering, operands: Operands, _p: Any, _e: Any) -> References:
    """Evaluate by Horner's rule; coefficients from the lowest degree (JAX 0.12 or later)."""
    x, *coefficients = operands
    result = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = arrays.elementwise("add", arrays.elementwise("mul", result, x), coefficient)
    return result


def _clamp(arrays: ArrayLowering, operands: Operands, _p: Any, _e: Any) -> References:
    low, x, high = operands
    return arrays.elementwise("min", arrays.elementwise("max", x, low), high)


def _round(arrays: ArrayLowering, operands: Operands, params: Any, _e: Any) -> References:
    to_even = int(params["rounding_method"]) == 1
    return arrays.elementwise("round_even" if to_even else "round_away", *operands)


def _convert(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> References:
    old, new = _kind(equation), kind_of(params["new_dtype"])
    each, constant, result = arrays.elementwise, arrays.constant, operands[0]
    narrowed = 8 * (8 - np.dtype(params["new_dtype"]).itemsize)
    if old == new == "i" and 8 * (8 - equation.invars[0].aval.dtype.itemsize) < narrowed:
        return each("ashr", each("shl", result, constant(narrowed)), constant(narrowed))
    if old != new:
        result = each({"f": "to_float", "i": "to_int", "b": "to_bool"}[new], result)
    if (old, new) == ("f", "i") and narrowed:
        limits = np.iinfo(params["new_dtype"])
        result = each("min", each("max", result, constant(limits.min)), constant(limits.max))
    return result


def _bitcast(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> References:
    old, new = np.dtype(equation.invars[0].aval.dtype), np.dtype(params["new_dtype"])
    if old.itemsize != 8 or new.itemsize != 8:
        raise UnsupportedPrimitiveError("numbers of other than 64 bits", "bitcast_convert_type")
    if old.kind == new.kind:
        return operands[0]
    return arrays.elementwise("as_bits" if old.kind == "f" else "of_bits", operands[0])


def _iota(arrays: ArrayLowering, _o: Operands, params: Any, _e: Any) -> References:
    shape, axis = params["shape"], params["dimension"]
    values = np.arange(shape[axis]).reshape([-1 if a == axis else 1 for a in range(len(shape))])
    return arrays.constant(np.broadcast_to(values, shape).astype(params["dtype"]))


def _platform_index(arrays: ArrayLowering, _o: Operands, params: Any, _e: Any) -> References:
    platforms = enumerate(params["platforms"])
    return arrays.constant(next(at for at, one in platforms if one is None or "cpu" in one))


def _dot_general(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> Any:
    if _kind(equation) != "f":
        raise UnsupportedPrimitiveError("products of integers", "dot_general")
    left, right = operands
    return dot_general(arrays, left, right, params["dimension_numbers"])


def _gather(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> References:
    """Select among all candidates if the indices are computed at run time."""
    refs, indices = operands
    known, each, constant = arrays.known(indices), arrays.elementwise, arrays.constant
    if known is not None:
        return gather_static(refs, known, params)
    indices, mode = arrays.loaded(indices), params["mode"].name
    starts, candidates = gather_candidates(arrays.loaded(refs), indices, params)
    last = len(candidates) - 1
    if mode == "CLIP":
        starts = each("min", each("max", starts, constant(0)), constant(last))
    result = candidates[0]
    for number, candidate in enumerate(candidates[1:], 1):
        result = each("select", each("eq", starts, constant(number)), candidate, result)
    if mode != "FILL_OR_DROP":
        return result
    if _kind(equation) != "f":
        raise UnsupportedPrimitiveError("indices out of bounds of integers", "gather")
    fill = np.nan if params["fill_value"] is None else float(params["fill_value"])
    valid = each("and", each("ge", starts, constant(0)), each("le", starts, constant(last)))
    return each("select", valid, result, constant(fill))


def _scatter(op: str | None) -> Callable[..., References]:
    def lower(arrays: ArrayLowering, operands: Operands, params: Any, _e: Any) -> References:
        refs, indices, updates = operands
        known = arrays.known(indices)
        if known is None:
            raise UnsupportedPrimitiveError("computed indices", "scatter")

        combine = None if op is None else partial(arrays.elementwise, op)
        return scatter_static(refs, known, updates, params, combine)

    return lower


def _reduce(op: str) -> Callable[..., References]:
    def lower(arrays: ArrayLowering, operands: Operands, params: Any, equation: Any) -> Any:
        return reduce_axes(arrays, op, operands[0], params["axes"], _kind(equation))

    return lower


def _argument_of_extreme(op: str) -> Callable[..., References]:
    def lower(arrays: ArrayLowering, operands: Operands, params: Any, _e: Any) -> References:
        """Return the index of the first extreme entry; of the first NaN if there is one."""
        each, constant = arrays.elementwise, arrays.constant
        (axis,) = params["axes"]
        values = np.moveaxis(arrays.loaded(operands[0]), axis, 0)
        best = values[0]
        index = np.broadcast_to(constant(0), best.shape)
        for number, value in enumerate(values[1:], 1):
            first_nan = each("and", each("ne", value, value), each("eq", best, best))
            better = each("or", each(op, value, best), first_nan)
            index = each("select", better, constant(number), index)
            best = each("select", better, value, best)
        return index

    return lower


def _cumulative(op: str) -> Callable[..., References]:
    def lower(arrays: ArrayLowering, operands: Operands, params: Any, _e: Any) -> References:
        return prefix(arrays, op, operands[0], params["axis"], params["reverse"])

    return lower


PRIMITIVES: dict[str, Callable[..., References]] = {
    "div": _div,
    "shift_left": _shift("shl"),
    "shift_right_logical": _shift("lshr"),
    "shift_right_arithmetic": _shift("ashr"),
    "select_n": _select,
    "sign": _sign,
    "integer_pow": _integer_pow,
    "square": _square,
    "one_minus_square": _one_minus_square,
    "polynomial": _polynomial,
    "clamp": _clamp,
    "round": _round,
    "convert_element_type": _convert,
    "bitcast_convert_type": _bitcast,
    "iota": _iota,
    "platform_index": _platform_index,
    "dot_general": _dot_general,
    "gather": _gather,
    "scatter": _scatter(None),
    "scatter-add": _scatter("add"),
    "scatter_add": _scatter("add"),
    "argmax": _argument_of_extreme("gt"),
    "argmin": _argument_of_extreme("lt"),
}
_COMBINED = {"sum": "add", "prod": "mul", "max": "max", "min": "min", "and": "and", "or": "or"}
PRIMITIVES.update({f"reduce_{name}": _reduce(op) for name, op in _COMBINED.items()})
PRIMITIVES.update({f"cum{name}": _cumulative(op) for name, op in _COMBINED.items()})
"""Functions by the name of JAX's primitive."""
