"""Make nodes lane by lane, with constant folding and algebraic simplification.

Operations on known numbers are evaluated at once. A product with a known zero is zero (even if the
other factor is not finite), a sum with a known zero is the other term (even if that is -0.0). This
removes most rows of a linear step, which are padded with zeros.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.ir.graph import Graph

_INT_MAX = 1 << 63


def _wrap(value: Any) -> Any:
    """Reduce an integer to 64 bits, as two's complement does; other values stay."""
    if isinstance(value, int) and not isinstance(value, bool):
        return (value + _INT_MAX) % (2 * _INT_MAX) - _INT_MAX
    return value


def _divide(a: Any, b: Any) -> Any:
    if isinstance(a, int):
        return -1 if b == 0 else abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _maximum(a: Any, b: Any) -> Any:
    if a != a or b != b:
        return a + b
    return max(a, b, key=lambda one: (one, math.copysign(1.0, one)))


def _round_away(value: float) -> float:
    return math.copysign(np.floor(abs(value)) + (abs(value) % 1.0 >= 0.5), value)


def _to_int(value: Any) -> int:
    """Convert to an integer: the nearest one possible, and 0 for NaN."""
    if value != value:
        return 0
    return int(min(max(value, -_INT_MAX), _INT_MAX - 1))


def _shift(operation: Callable[[int, int], int]) -> Callable[[int, int], int]:
    """Shift by 64 bits or more (a negative count is one) as if bit by bit."""
    return lambda a, b: _wrap(operation(a, b if 0 <= b < 64 else 64))


_SAME_NAME = ("add", "sub", "mul", "neg", "eq", "ne", "lt", "le", "gt", "ge", "xor")
FOLD: dict[str, Callable[..., Any]] = {name: getattr(operator, name) for name in _SAME_NAME} | {
    "div": _divide,
    "abs": abs,
    "sqrt": lambda a: math.sqrt(a) if a >= 0.0 else math.nan,
    "max": _maximum,
    "min": lambda a, b: -_maximum(-a, -b) if not isinstance(a, bool) else a and b,
    "and": operator.and_,
    "or": operator.or_,
    "not": lambda a: (not a) if isinstance(a, bool) else ~a,
    "is_finite": math.isfinite,
    "floor": lambda a: float(np.floor(a)),
    "ceil": lambda a: float(np.ceil(a)),
    "round_even": lambda a: float(np.round(a)),
    "round_away": lambda a: _round_away(a) if math.isfinite(a) else a,
    "select": lambda p, a, b: a if p else b,
    "shl": _shift(lambda a, b: a << b),
    "lshr": _shift(lambda a, b: (a % (2 * _INT_MAX)) >> b),
    "ashr": _shift(lambda a, b: a >> b),
    "to_float": float,
    "to_int": _to_int,
    "to_bool": lambda a: a != 0,
    "as_bits": lambda a: int(np.float64(a).view(np.int64)),
    "of_bits": lambda a: float(np.int64(a).view(np.float64)),
}
"""Operations lane by lane, evaluated on known numbers."""

_PREDICATES = {"eq", "ne", "lt", "le", "gt", "ge", "is_finite", "to_bool"}
_COMMUTATIVE = {"add", "mul", "max", "min", "and", "or", "xor", "eq", "ne"}


def result_kind(op: str, kinds: list[str]) -> str:
    """Return the kind of an operation's result, given the kinds of its operands."""
    if op in _PREDICATES:
        return "b"
    if op in ("to_float", "of_bits"):
        return "f"
    if op in ("to_int", "as_bits"):
        return "i"
    return kinds[-1]


class NodeBuilder:
    """Add nodes that compute lane by lane to a graph, folded and simplified.

    Args:
        graph: The graph.
    """

    def __init__(self, graph: Graph) -> None:
        """Hold the graph."""
        self.graph = graph

    def make(self, op: str, args: tuple[int, ...]) -> int:
        """Return a node that computes an operation lane by lane; lengths are equal, or 1."""
        graph = self.graph
        known = [graph.number[node] for node in args]
        kind = result_kind(op, [graph.kind[node] for node in args])
        if None not in known:
            return graph.constant(_wrap(FOLD[op](*known)), kind)
        simple = self._simplify(op, args, known)
        if simple is not None:
            return simple
        if op in _COMMUTATIVE and args[0] > args[1]:
            args = (args[1], args[0])
        length = max([graph.lanes[node] for node in args])
        return graph.intern(op, args, length, kind, graph.placement(args))

    def _simplify(self, op: str, args: tuple[int, ...], known: list[Any]) -> int | None:
        """Return an existing or a simpler node that computes the same; None if there is none."""
        graph = self.graph
        if op == "select":
            return self._simplify_select(args, known)
        kind = graph.kind[args[0]]
        if kind == "b":
            return self._simplify_logic(op, args, known)
        if op == "add":
            return _other_operand(args, known, 0)
        if op == "sub":
            if known[1] == 0:
                return args[0]
            return self.make("neg", args[1:]) if known[0] == 0 else None
        if op == "mul":
            if 0 in known:
                return graph.constant(0, kind)
            for at in (0, 1):
                if known[at] == -1:
                    return self.make("neg", (args[1 - at],))
            return _other_operand(args, known, 1)
        if op == "div" and kind == "f":
            if known[0] == 0:
                return args[0]
            if known[1] is not None and _has_exact_inverse(known[1]):
                return self.make("mul", (args[0], graph.constant(1.0 / known[1], "f")))
            return None
        if op == "neg" and graph.op[args[0]] == "neg":
            return graph.args[args[0]][0]
        if op in ("max", "min") and args[0] == args[1]:
            return args[0]
        return None

    def _simplify_select(self, args: tuple[int, ...], known: list[Any]) -> int | None:
        if known[0] is not None:
            return args[1] if known[0] else args[2]
        if args[1] == args[2] or (known[1] is not None and known[1] == known[2]):
            return args[1]  # signs of known zeros do not count
        if self.graph.kind[args[1]] == "b" and known[1] is not None and known[2] is not None:
            return args[0] if known[1] else self.make("not", args[:1])
        return None

    def _simplify_logic(self, op: str, args: tuple[int, ...], known: list[Any]) -> int | None:
        graph = self.graph
        if op in ("and", "or"):
            absorbing = op == "or"
            if absorbing in known:
                return graph.constant(absorbing, "b")
            return args[0] if args[0] == args[1] else _other_operand(args, known, not absorbing)
        if op == "not" and graph.op[args[0]] == "not":
            return graph.args[args[0]][0]
        return args[0] if op == "to_bool" else None


def _other_operand(args: tuple[int, ...], known: list[Any], neutral: Any) -> int | None:
    for at in (0, 1):
        if known[at] is not None and known[at] == neutral:
            return args[1 - at]
    return None


def _has_exact_inverse(value: float) -> bool:
    """Return whether a float is a power of two whose inverse is a normal float."""
    return abs(math.frexp(value)[0]) == 0.5 and 2.0**-1000 < abs(value) < 2.0**1000
