"""Programs for this processor, made of functions that JAX can trace, and called with arrays.

JAX stays the one language that the mechanics are written in; XLA, which compiles it elsewhere, is
made for few operations on large arrays, and a robot is many on small ones. Here they become one
piece of straight vector code: the lanes of a vector are flexures, or rows of a batch.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from struct import pack
from typing import Any

import numpy as np

from lanewise._jax import jax
from lanewise.codegen.emit import Emitter
from lanewise.lowering.lower import Reader
from lanewise.machine import loaded

_own = threading.local()


class Program:
    """A program that may be called from several threads at once.

    Args:
        code: Its machine code; it is read and not kept.
        sizes: How many numbers each result has, by row where there are rows.
        room: How much memory it needs, in numbers.
        by_row: Which arrays have a row of numbers for every row of a batch; None without rows.
    """

    def __init__(
        self, code: bytes, sizes: Sequence[int], room: int, by_row: Sequence[bool] | None
    ) -> None:
        """Make it ready to be called."""
        self.sizes, self.room, self.by_row = sizes, room, by_row
        self._function = loaded(code)

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
            self._function(_addresses(arrays), _addresses(results), _memory(self.room), rows)
        return results


def _addresses(arrays: Sequence[np.ndarray]) -> bytes:
    """Addresses of arrays, one after the other, as a C program reads them."""
    return pack(f"{len(arrays)}P", *map(_address, arrays))


def _address(array: np.ndarray) -> int:
    # Through the buffer it takes a fifth of the time; buffers of read-only arrays are refused.
    if array.size and array.flags.writeable:
        return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
    return array.__array_interface__["data"][0]


def _memory(numbers: int) -> int:
    """Address of memory of this thread, kept for the next program: fresh memory takes longer."""
    size, start = getattr(_own, "room", (0, 0))
    if size < numbers:
        _own.memory = np.zeros(numbers + 8)
        start = _address(_own.memory)
        start += -start % 64
        _own.room = (numbers, start)
    return start


@dataclass(frozen=True)
class Source:
    """A program as text, the same for every kind of processor.

    Attributes:
        text: The program, in LLVM's language.
        sizes: How many numbers each result has, as `Program` takes it.
        room: How much memory it needs, in numbers.
    """

    text: str
    sizes: tuple[int, ...]
    room: int


def source(
    function: Callable[..., Any],
    given: Sequence[Any],
    long: Sequence[int],
    by_row: Sequence[bool] | None = None,
    *,
    carries: bool = False,
) -> tuple[Source, Any]:
    """Write the program of a function.

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
    return Source(emitter.source, tuple(read.sizes), emitter.arena.size + 64), tree


__all__ = ["Program", "Source", "source"]
