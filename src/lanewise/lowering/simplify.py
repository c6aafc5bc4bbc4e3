"""Statements made of others lane by lane, less what need not be computed.

What is known is worked out at once; a product with zero is zero and a sum with zero is the other
number. That leaves out most of the rows of a linear step, which are padded with zeros.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.ir.graph import Graph

_INT = 1 << 63

# Whole numbers wrap around as those of 64 bits do.


def _wrapped(value: int) -> int:
    return (value + _INT) % (2 * _INT) - _INT


def _divided(a: Any, b: Any) -> Any:
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _largest(a: Any, b: Any) -> Any:
    return a + b if a != a or b != b else max(a, b)


def _smallest(a: Any, b: Any) -> Any:
    return a + b if a != a or b != b else min(a, b)


def _float_bits(value: float) -> int:
    return int(np.float64(value).view(np.int64))


def _bits_float(value: int) -> float:
    return float(np.int64(value).view(np.float64))


KNOWN: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _divided,
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": lambda a: math.sqrt(a) if a >= 0.0 else math.nan,
    "max": _largest,
    "min": _smallest,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "and": lambda a, b: a & b,
    "or": lambda a, b: a | b,
    "xor": lambda a, b: a ^ b,
    "not": lambda a: (not a) if isinstance(a, bool) else ~a,
    "is_finite": math.isfinite,
    "floor": lambda a: float(np.floor(a)),
    "ceil": lambda a: float(np.ceil(a)),
    "round_even": lambda a: float(np.round(a)),
    "round_away": lambda a: math.copysign(math.floor(abs(a) + 0.5), a),
    "select": lambda p, a, b: a if p else b,
    "shl": lambda a, b: _wrapped(a << b),
    "lshr": lambda a, b: _wrapped((a % (2 * _INT)) >> b),
    "ashr": lambda a, b: a >> b,
    "to_float": float,
    "to_int": int,
    "to_bool": lambda a: a != 0,
    "as_bits": _float_bits,
    "of_bits": _bits_float,
}
"""What is done lane by lane, for numbers that are known."""

_COMPARE = {"eq", "ne", "lt", "le", "gt", "ge", "is_finite", "to_bool"}
_COMMUTES = {"add", "mul", "max", "min", "and", "or", "xor", "eq", "ne"}


def result_kind(op: str, kinds: list[str]) -> str:
    """Kind of what an operation makes of numbers of some kinds."""
    if op in _COMPARE:
        return "b"
    if op in ("to_float", "of_bits"):
        return "f"
    if op in ("to_int", "as_bits"):
        return "i"
    return kinds[-1]


class Maker:
    """Makes statements of a graph lane by lane.

    Args:
        graph: The graph.
    """

    def __init__(self, graph: Graph) -> None:
        """Begin with the numbers that are looked for most."""
        self.graph = graph

    def make(self, op: str, args: tuple[int, ...]) -> int:
        """A statement that does an operation lane by lane; lengths are equal, or 1."""
        graph = self.graph
        known = [graph.value(one) for one in args]
        if all(value is not None for value in known):
            kind = result_kind(op, [graph.kind[one] for one in args])
            try:
                return graph.const(KNOWN[op](*known), kind)
            except (OverflowError, ValueError):  # whole numbers of what is none
                return graph.const(0, kind)
        simple = self._simple(op, args, known)
        if simple is not None:
            return simple
        if op in _COMMUTES and args[0] > args[1]:
            args = (args[1], args[0])
        length = max(int(graph.length[one]) for one in args)
        kind = result_kind(op, [graph.kind[one] for one in args])
        return graph.once(op, args, length, kind, graph.home(args))

    def _simple(self, op: str, args: tuple[int, ...], known: list[Any]) -> int | None:
        """A statement that is there already, or a simpler one; None where there is none."""
        graph = self.graph
        if op == "select":
            return self._simple_select(args, known)
        if graph.kind[args[0]] == "b":
            return self._simple_logic(op, args, known)
        if op == "add":
            return _other(args, known, 0)
        if op == "sub":
            if known[1] == 0:
                return args[0]
            return self.make("neg", args[1:]) if known[0] == 0 else None
        if op == "mul":
            if 0 in known:
                return graph.const(0, graph.kind[args[0]])
            for at in (0, 1):
                if known[at] == -1:
                    return self.make("neg", (args[1 - at],))
            return _other(args, known, 1)
        if op == "div":
            if known[0] == 0:
                return args[0]
            if known[1] is not None and known[1] != 0 and _is_power_of_two(known[1]):
                return self.make("mul", (args[0], graph.const(1.0 / known[1], "f")))
            return None
        if op == "neg" and graph.op[args[0]] == "neg":
            return graph.args[args[0]][0]
        if op in ("max", "min") and args[0] == args[1]:
            return args[0]
        return None

    def _simple_select(self, args: tuple[int, ...], known: list[Any]) -> int | None:
        graph = self.graph
        if known[0] is not None:
            return args[1] if known[0] else args[2]
        if args[1] == args[2]:
            return args[1]
        if graph.kind[args[1]] == "b" and known[1] is not None and known[2] is not None:
            return args[0] if known[1] else self.make("not", args[:1])
        return None

    def _simple_logic(self, op: str, args: tuple[int, ...], known: list[Any]) -> int | None:
        graph = self.graph
        if op == "and":
            if False in known:
                return graph.const(False, "b")
            return args[0] if args[0] == args[1] else _other(args, known, True)
        if op == "or":
            if True in known:
                return graph.const(True, "b")
            return args[0] if args[0] == args[1] else _other(args, known, False)
        if op == "not" and graph.op[args[0]] == "not":
            return graph.args[args[0]][0]
        if op in ("to_bool",):
            return args[0]
        return None


def _other(args: tuple[int, ...], known: list[Any], neutral: Any) -> int | None:
    for at in (0, 1):
        if known[at] is not None and known[at] == neutral:
            return args[1 - at]
    return None


def _is_power_of_two(value: float) -> bool:
    return math.isfinite(value) and abs(math.frexp(value)[0]) == 0.5 and abs(value) < 2.0**1000
