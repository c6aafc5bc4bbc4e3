"""Programs for this processor, made of functions that JAX can trace, and called with arrays.

JAX stays the one language that the mechanics are written in; XLA, which compiles it elsewhere, is
made for few operations on large arrays, and a robot is many on small ones. Here they become one
piece of straight vector code: the lanes of a vector are flexures, or rows of a batch.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lanewise._jax import jax
from lanewise.codegen.emit import Emitter
from lanewise.lowering.lower import Reader
from lanewise.machine import compiled, loaded

_own = threading.local()


@dataclass(frozen=True, eq=False)
class Program:
    """A program that may be called from several threads at once.

    Attributes:
        code: Its machine code.
        sizes: How many numbers each result has, by row where there are rows.
        room: How much memory it needs, in numbers.
        by_row: Which arrays have a row of numbers for every row of a batch; None without rows.
    """

    code: bytes
    sizes: tuple[int, ...]
    room: int
    by_row: tuple[bool, ...] | None
    _function: Callable[..., None] = field(init=False)

    def __post_init__(self) -> None:
        """Make it ready to be called."""
        object.__setattr__(self, "_function", loaded(self.code))

    def __reduce__(self) -> Any:
        """Pickled without what belongs to this process."""
        return Program, (self.code, self.sizes, self.room, self.by_row)

    def __call__(self, given: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Run it.

        Args:
            given: Arrays of floats; those by row have rows as leading axis.

        Returns:
            Flat arrays, rows as leading axis where there are any.
        """
        arrays = [np.ascontiguousarray(one, float) for one in given]
        rows, shape = 1, ()
        if self.by_row is not None:
            rows = max(len(one) for one, own in zip(arrays, self.by_row, strict=True) if own)
            shape = (rows,)
        results = [np.empty((*shape, size)) for size in self.sizes]
        if rows:
            where = (_addresses(arrays), _addresses(results))
            at = [ctypes.addressof(addresses) for addresses in where]
            self._function(*at, _memory(self.room), rows)
        return results


def _addresses(arrays: Sequence[np.ndarray]) -> Any:
    at = [one.__array_interface__["data"][0] for one in arrays]
    return (ctypes.c_void_p * max(len(at), 1))(*at)


def _memory(numbers: int) -> int:
    """Address of memory of this thread, kept for the next program: fresh memory takes longer."""
    room = getattr(_own, "room", None)
    if room is None or room.size < numbers + 8:
        room = _own.room = np.zeros(numbers + 8)
    start: int = room.__array_interface__["data"][0]
    return start + -start % 64


def program(
    function: Callable[..., Any],
    given: Sequence[Any],
    long: Sequence[int],
    by_row: Sequence[bool] | None = None,
    *,
    carries: bool = False,
) -> tuple[Program, Any]:
    """Make a program of a function.

    Args:
        function: A function of vectors of floats that JAX can trace.
        given: Vectors as it takes them, of which only the sizes matter; those of one row.
        long: Sizes of axes that rows are laid out along, such as the number of flexures.
        by_row: Which of them have a row for every row of a batch; no batch where not given.
        carries: Whether rows follow one after the other: the first vector is carried from row to
            row, and the function returns it before its results.

    Returns:
        The program, and the tree of what the function returns, with shapes and kinds of numbers.

    Raises:
        UnknownHereError: The function does what cannot be done here.
    """
    closed, tree = jax.make_jaxpr(function, return_shape=True)(*given)
    reader = Reader(long)
    if by_row is None:
        read = reader.single(closed)
    elif carries:
        read = reader.path(closed, by_row)
        tree = tree[1]
    else:
        read = reader.batch(closed, by_row)
    emitter = Emitter(read)
    rows = None if by_row is None else tuple(by_row)
    return Program(compiled(emitter.source), tuple(read.sizes), emitter.arena.size + 64, rows), tree


__all__ = ["Program", "program"]
