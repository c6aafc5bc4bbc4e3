"""Checks of values that a user gives in loads: the value converted, or an `InputError`."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from notchflex.errors import InputError
from notchflex.robot import Robot

# Offsets of sensors of tension: so large, N, or such a part of the largest tension.
_OFFSET, _PART = 0.05, 0.1


def check_number(value: Any, what: str, form: str = "a number") -> float:
    """Return a number as a float; text and truth values are refused."""
    if type(value) is float:  # as most often
        return value
    try:
        if isinstance(value, str | bytes | bytearray | bool | np.bool_):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(f"{what} must be {form}; got {short_repr(value)}") from None


def check_integer(value: Any, what: str) -> int:
    """Return a whole number."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise InputError.WRONG_TYPE(
            f"{what} must be a whole number; got {short_repr(value)}"
        ) from None


def check_bool(value: Any, what: str) -> bool:
    """Return True or False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError.WRONG_TYPE(f"{what} must be True or False; got {short_repr(value)}")


def check_vector(value: Any, what: str, form: str) -> tuple[float, float, float]:
    """Return three finite numbers.

    Args:
        value: What was given.
        what: Its name, for the message.
        form: Meaning and unit of the numbers, for the message.

    Example:
        >>> check_vector([0, 0, 1], "tip_force", "N")
        (0.0, 0.0, 1.0)
    """
    if type(value) is tuple and len(value) == 3 and all(map(_is_finite_float, value)):
        return value  # as most often: nothing to change
    several = np.asarray(value).tolist() if hasattr(value, "__array__") else value
    numbers: list[float] = []
    if isinstance(several, Sequence) and not isinstance(several, str | bytes | bytearray):
        try:
            numbers = [check_number(entry, what) for entry in several]
        except InputError:
            numbers = []
    if len(numbers) != 3 or not all(isfinite(one) for one in numbers):
        raise InputError.NOT_FINITE(
            f"{what} needs three finite numbers ({form}); got {short_repr(value)}"
        )
    return numbers[0], numbers[1], numbers[2]


def _is_finite_float(value: Any) -> bool:
    return type(value) is float and isfinite(value)


def check_table(value: Any, what: str) -> np.ndarray:
    """Return numbers, steps by tendons; None within them is NaN."""
    if type(value) is np.ndarray and value.dtype == float:
        return value
    try:
        if value is None or np.asarray(value).dtype.kind not in "iufO":
            raise TypeError
        return np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise InputError.WRONG_TYPE(
            f"{what} of a load path must be numbers, steps by tendons; got {short_repr(value)}"
        ) from None


def check_pulls(tension: np.ndarray, minimum: float = 0.0, source: str = "") -> None:
    """Refuse measured tensions of a tendon that are all negative.

    Small ones are a sensor's offset, of a slack tendon or among others that are pulled.

    Args:
        tension: Tensions by rows and tendons, N, NaN where not measured.
        minimum: Negative tensions up to this are an offset, N, if it is more than 0.05 N.
        source: The file, for the message.

    Raises:
        InputError: The sign or the zero of the sensor is wrong.
    """
    largest = float(np.nanmax(np.abs(tension), initial=0.0))
    minimum = max(minimum, _OFFSET, _PART * largest)
    prefix = f"{source}: " if source else ""
    for tendon, values in enumerate(tension.T, 1):
        finite = values[np.isfinite(values)]
        if len(finite) and finite.max() < 0.0 and finite.min() < -minimum:
            raise InputError.OUT_OF_RANGE(
                f"{prefix}all tensions of tendon {tendon} are negative, down to {finite.min():g} "
                "N, but a tendon only pulls; change their sign, or take away the sensor's offset"
            )


def one_or_several(value: Any, kind: type, what: str) -> list[Any]:
    """Return one value of a kind, or several in order, as a list; the entries are not checked."""
    try:
        return [value] if isinstance(value, kind) else list(value)
    except TypeError:
        raise InputError.WRONG_TYPE(f"{what}; got {short_repr(value)}") from None


def check_is_robot(value: Any) -> Robot:
    """Return a robot."""
    if not isinstance(value, Robot):
        raise InputError.WRONG_TYPE(
            'a notchflex.Robot is needed, such as load_robot("pacheco2021-a"); '
            f"got {short_repr(value)}"
        )
    return value


def short_repr(value: Any) -> str:
    """Return a value as Python writes it, at most 60 characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
