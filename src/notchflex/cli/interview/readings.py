"""Typed readings: numbers, sums of numbers, one for each notch, words."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable

from notchflex.errors import InputError

_OPERATIONS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_BOUNDS = {
    "above": (operator.gt, "greater than"),
    "at_least": (operator.ge, "at least"),
    "below": (operator.lt, "less than"),
    "at_most": (operator.le, "at most"),
}


def reading(text: str, **bounds: float) -> float:
    """Return a typed number; sums such as `1.62-0.22` are evaluated.

    Args:
        text: A number, or numbers joined by + - * /.
        **bounds: `above`, `at_least`, `below`, `at_most`: limits of the number.

    Raises:
        InputError: Not a number, not finite, or outside its bounds.

    Example:
        >>> round(reading("1.62-0.22", above=0, below=1.62), 9)
        1.4
    """
    try:
        value = _evaluate(ast.parse(text.replace("−", "-"), mode="eval").body)
    except (ValueError, SyntaxError, ZeroDivisionError, OverflowError, RecursionError, MemoryError):
        raise InputError.NOT_A_NUMBER(
            f"got {_got(text)}; give a number such as 1.62, or a sum: 1.62-0.22."
        ) from None
    checks = [(*_BOUNDS[word], bounds[word]) for word in _BOUNDS if word in bounds]
    if not math.isfinite(value) or not all(holds(value, bound) for holds, _, bound in checks):
        allowed = " and ".join(f"{words} {bound:g}" for _, words, bound in checks)
        wanted = f"a finite number {allowed}".strip()
        raise InputError.OUT_OF_RANGE(f"got {value:g}; give {wanted}.")
    # Nobody reads callipers to a nanometre; this drops the noise of 1.62-0.22.
    return round(value, 9)


def readings(text: str, count: int, **bounds: float) -> list[float]:
    """Return one number for each of `count` notches; a single one holds for all.

    Raises:
        InputError: As `reading`, or another number of numbers.
    """
    values = [reading(part.strip(), **bounds) for part in text.split(",")]
    if len(values) not in (1, count):
        raise InputError.WRONG_SHAPE(
            f"got {len(values)} numbers; give one for all, or {count} joined by commas, "
            "base to tip."
        )
    return values * count if len(values) == 1 else values


def choice(text: str, allowed: tuple[str, ...]) -> str:
    """Return one of the allowed words; its beginning is enough.

    Raises:
        InputError: Not one of them, or the beginning of several.
    """
    matches = [word for word in allowed if word == text] or [
        word for word in allowed if text and word.startswith(text.lower())
    ]
    if len(matches) != 1:
        raise InputError.UNKNOWN_NAME(f"got {_got(text)}; give {' or '.join(allowed)}.")
    return matches[0]


def whole(text: str, *, at_least: int, at_most: int) -> int:
    """Return a whole number within bounds.

    Raises:
        InputError: Not a whole number, or outside its bounds.
    """
    try:
        value = int(text)
    except ValueError:
        raise InputError.NOT_A_NUMBER(f"got {_got(text)}; give a whole number.") from None
    if not at_least <= value <= at_most:
        raise InputError.OUT_OF_RANGE(f"got {value}; give {at_least} to {at_most}.")
    return value


def _got(text: str) -> str:
    return repr(text) if text else "nothing"


def _evaluate(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluate(operand)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _evaluate(operand)
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _OPERATIONS:
            return _OPERATIONS[type(operation)](_evaluate(left), _evaluate(right))
        case _:
            raise ValueError("not a sum of numbers")
