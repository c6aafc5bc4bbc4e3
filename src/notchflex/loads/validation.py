"""Numbers as people give them in loads: taken as floats, or refused with a sentence."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from notchflex.errors import InputError
from notchflex.robot import Robot


def number(value: Any, what: str, form: str = "a number") -> float:
    """A number, which text and truth values are not.

    Raises:
        InputError: It is none.
    """
    if type(value) is float:  # as most often
        return value
    try:
        if isinstance(value, str | bytes | bytearray | bool | np.bool_):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(f"{what} must be {form}; got {shown(value)}") from None


def whole(value: Any, what: str) -> int:
    """A whole number.

    Raises:
        InputError: It is none.
    """
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise InputError.WRONG_TYPE(f"{what} must be a whole number; got {shown(value)}") from None


def truth(value: Any, what: str) -> bool:
    """True or false.

    Raises:
        InputError: It is neither.
    """
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError.WRONG_TYPE(f"{what} must be True or False; got {shown(value)}")


def vector(value: Any, what: str, form: str) -> tuple[float, float, float]:
    """Three finite numbers.

    Args:
        value: What was given.
        what: Its name, for the message.
        form: What the numbers are, with their unit.

    Raises:
        InputError: They are not three, or one is no finite number.

    Example:
        >>> vector([0, 0, 1], "tip_force", "N")
        (0.0, 0.0, 1.0)
    """
    if type(value) is tuple and len(value) == 3 and all(map(_finite, value)):
        return value  # as most often: nothing to change
    given = np.asarray(value).tolist() if hasattr(value, "__array__") else value
    numbers: list[float] = []
    if isinstance(given, Sequence) and not isinstance(given, str | bytes | bytearray):
        try:
            numbers = [number(entry, what) for entry in given]
        except InputError:
            numbers = []
    if len(numbers) != 3 or not all(isfinite(one) for one in numbers):
        raise InputError.NOT_FINITE(
            f"{what} needs three finite numbers ({form}); got {shown(value)}"
        )
    return numbers[0], numbers[1], numbers[2]


def _finite(value: Any) -> bool:
    return type(value) is float and isfinite(value)


def table(value: Any, what: str) -> np.ndarray:
    """Numbers, steps by tendons; None within them is NaN.

    Raises:
        InputError: They are no such numbers.
    """
    if type(value) is np.ndarray and value.dtype == float:
        return value
    try:
        if value is None or np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        return np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(
            f"{what} of a load path must be numbers, steps by tendons; got {shown(value)}"
        ) from None


def robot_given(value: Any) -> Robot:
    """A robot.

    Raises:
        InputError: It is none.
    """
    if not isinstance(value, Robot):
        raise InputError.WRONG_TYPE(
            f'a notchflex.Robot is needed, such as load_robot("pacheco2021-a"); got {shown(value)}'
        )
    return value


def shown(value: Any) -> str:
    """A value as Python writes it, cut short."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


__all__ = ["number", "robot_given", "shown", "table", "truth", "vector", "whole"]
