"""Arrays that nobody can change, and objects that are equal where their values are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, cast

import numpy as np

from notchflex._arrays import is_traced


class ByValue:
    """Base of records that are equal where all that `_value` returns is."""

    def _value(self) -> Any:
        """Return what is compared: the fields of a dataclass."""
        return tuple(getattr(self, field.name) for field in fields(cast("Any", self)))

    def __eq__(self, other: object) -> bool:
        """Compare by value with a record of the same type."""
        if not isinstance(other, ByValue) or type(self) is not type(other):
            return NotImplemented
        return self is other or same_values(self._value(), other._value())

    def __hash__(self) -> int:
        """Return a hash that equal records share: arrays are compared only where it is equal."""
        return hash((type(self), len(cast("Any", self)) if hasattr(self, "__len__") else 0))


def read_only(values: Any) -> Any:
    """Return a copy of an array that cannot be written to; one of JAX as it is."""
    if is_traced(values):
        return values
    copy = np.array(values)
    copy.setflags(write=False)
    return copy


def frozen(values: Any) -> Any:
    """Return an array as a view that cannot be written to; other values as they are."""
    if not isinstance(values, np.ndarray):
        return values
    view = values.view()
    view.setflags(write=False)
    return view


def same_values(first: Any, second: Any) -> bool:
    """Return whether two values are equal, arrays entry by entry; NaN equals NaN."""
    if hasattr(first, "__array__") or hasattr(second, "__array__"):
        exact = np.asarray(first).dtype.kind not in "fc"
        return np.array_equal(first, second, equal_nan=not exact)
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(
            same_values(first[k], second[k]) for k in first
        )
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(same_values, first, second))
    return first is second or bool(first == second)
