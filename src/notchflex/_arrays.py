"""Formulas of a robot's arrays, once for plain numbers and once for JAX to trace.

The description of one robot becomes arrays in NumPy, where nothing is compiled. The same formulas,
traced by JAX, make programs for many robots and for slopes by their numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache, wraps
from types import ModuleType
from typing import Any

import numpy as np

# To ask for jax.Array takes long; most that is asked for is plain.
_PLAIN = {np.ndarray, np.float64, np.int64, np.bool_, float, int, str, bool, type(None)}


def is_traced(value: Any) -> bool:
    """Return whether a value, or an entry of a list, is an array of JAX."""
    if type(value) in _PLAIN:
        return False
    if isinstance(value, list | tuple):
        return not _PLAIN.issuperset(map(type, value)) and any(map(is_traced, value))
    jax = sys.modules.get("jax")  # robots are described without JAX
    return jax is not None and isinstance(value, jax.Array)


class _Dispatched:
    """The functions of NumPy; those of JAX for arguments that JAX traces."""

    def __init__(self, plain: Any, path: str) -> None:
        """Take functions from a module of NumPy, and from that of JAX with the same path."""
        self._plain, self._path = plain, path

    def __getattr__(self, name: str) -> Any:
        """Return a function that selects by its arguments; other attributes are NumPy's."""
        plain = getattr(self._plain, name)
        if isinstance(plain, ModuleType):
            chosen: Any = _Dispatched(plain, f"{self._path}.{name}")
        elif isinstance(plain, type) or not callable(plain):
            chosen = plain
        else:
            chosen = self._selecting(plain, name)
        setattr(self, name, chosen)
        return chosen

    def _selecting(self, plain: Callable[..., Any], name: str) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            for argument in arguments:
                kind = type(argument)
                if kind in _PLAIN or (kind is list and _PLAIN.issuperset(map(type, argument))):
                    continue  # a hundred calls a link; nearly all are of these
                if is_traced(argument):
                    return getattr(sys.modules[self._path], name)(*arguments, **options)
            return plain(*arguments, **options)

        return call


xp: Any = _Dispatched(np, "jax.numpy")
"""NumPy for plain numbers, `jax.numpy` where an argument is traced; their types have no base."""


def plain_number(value: Any) -> Any:
    """Return an array of one number as a plain float, or as it is traced."""
    return value if is_traced(value) else float(value)


def cached(maxsize: int) -> Callable[[Callable[..., Any]], Any]:
    """Make a function keep its last results; while decisions are taken, for the same objects."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        remembered = lru_cache(maxsize)(function)

        @wraps(function)
        def call(*arguments: Any) -> Any:
            decisions = _deciding.get()
            if decisions is not None:  # values may be traced, which are compared as objects
                key = (function, *map(id, arguments))
                if key not in decisions.results:
                    decisions.results[key] = arguments, function(*arguments)
                return decisions.results[key][1]
            try:
                hash(arguments)
            except TypeError:
                return function(*arguments)
            return remembered(*arguments)

        return call

    return decorate


class Decisions:
    """What the values of a robot decide about the form of its arrays.

    Attributes:
        made: The decisions of the example, in order.
        alike: Of the trace, whether every decision is the example's; traced.
        kept: Arguments and results of functions that are `cached`.
    """

    # An example decides; a trace follows it, and says of its own values whether they decide alike.

    def __init__(self, made: tuple[bool, ...] | None = None) -> None:
        """Follow decisions, or note those of an example where none are given."""
        self.follows = made is not None
        self.made: list[bool] = list(made or ())
        self.alike: list[Any] = []
        self.results: dict[Any, tuple[Any, Any]] = {}

    def take(self, value: Any) -> bool:
        """Take one decision."""
        if not self.follows:
            self.made.append(bool(value))
            return self.made[-1]
        expected = self.made[len(self.alike)]
        self.alike.append(value if expected else xp.logical_not(value))
        return expected

    @contextmanager
    def deciding(self) -> Generator[Decisions]:
        """Take all decisions of a block of code, in this thread."""
        token = _deciding.set(self)
        try:
            yield self
        finally:
            _deciding.reset(token)


_deciding: ContextVar[Decisions | None] = ContextVar("deciding", default=None)


def decide(value: Any) -> bool:
    """Return whether a value is true, where that changes the form of a robot's arrays."""
    decisions = _deciding.get()
    return bool(value) if decisions is None else decisions.take(value)
