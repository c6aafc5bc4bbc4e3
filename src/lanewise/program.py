"""Lower functions that JAX can trace, and call the programs made of them with arrays."""

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
from lanewise.lowering.lower import lower_batch, lower_path, lower_single
from lanewise.machine import load

_thread = threading.local()
_first_byte = ctypes.c_char.from_buffer


@dataclass(frozen=True)
class LoweredProgram:
    """A program as LLVM IR, the same for every kind of processor.

    Attributes:
        text: The IR.
        sizes: Number of entries of every result; of one row where there are rows.
        memory: Working memory that it needs, in numbers of eight bytes.
    """

    text: str
    sizes: tuple[int, ...]
    memory: int


def lower(
    function: Callable[..., Any],
    arguments: Sequence[Any],
    lane_sizes: Sequence[int],
    by_row: Sequence[bool] | None = None,
    *,
    carries: bool = False,
) -> tuple[LoweredProgram, Any]:
    """Lower a function to LLVM IR.

    Args:
        function: A function of vectors of floats that JAX can trace.
        arguments: Vectors of the sizes it takes, those of one row; their values are not used.
        lane_sizes: Sizes of axes that rows are laid out along, such as the number of bodies.
        by_row: Which arguments have a row for every row of a batch; None without a batch.
        carries: Whether rows follow one another: the first vector is carried from row to row, and
            the function returns it before its results.

    Returns:
        The program, and the tree of the function's results with shapes and dtypes.

    Raises:
        UnsupportedPrimitiveError: The function uses what is not supported.
    """
    closed, tree = jax.make_jaxpr(function, return_shape=True)(*arguments)
    if by_row is None:
        lowered = lower_single(closed, lane_sizes)
    elif carries:
        lowered = lower_path(closed, lane_sizes, by_row)
        tree = tree[1]
    else:
        lowered = lower_batch(closed, lane_sizes, by_row)
    emitter = Emitter(lowered)
    size = emitter.storage.arena.size + 64
    return LoweredProgram(emitter.source, tuple(lowered.sizes), size), tree


class Program:
    """A compiled program; threads may call it at the same time.

    Args:
        code: Machine code from `machine_code`; it is read and not kept.
        sizes: Number of entries of every result, by row where there are rows.
        memory: Working memory that it needs, in numbers of eight bytes.
        by_row: Which arguments have a row for every row of a batch; None without a batch.
    """

    def __init__(
        self, code: bytes, sizes: Sequence[int], memory: int, by_row: Sequence[bool] | None
    ) -> None:
        """Load the machine code."""
        self.sizes, self.memory, self.by_row = sizes, memory, by_row
        self._function = load(code)

    def __call__(self, arguments: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Run the program.

        Args:
            arguments: Arrays of floats; those by row have rows as leading axis.

        Returns:
            Flat arrays, rows as leading axis where there are any.
        """
        arrays = [np.ascontiguousarray(one, float) for one in arguments]
        rows, shape = 1, ()
        if self.by_row is not None:
            rows = max([len(one) for one, own in zip(arrays, self.by_row, strict=True) if own])
            shape = (rows,)
        results = [np.empty((*shape, size)) for size in self.sizes]
        if rows:
            memory = _working_memory(self.memory)
            self._function(_addresses(arrays), _addresses(results), memory, rows)
        return results


def _addresses(arrays: Sequence[np.ndarray]) -> bytes:
    """Return the addresses of arrays as an array of C pointers."""
    return pack(f"{len(arrays)}P", *map(_address, arrays))


def _address(array: np.ndarray) -> int:
    try:  # through the buffer it takes a fifth of the time
        return ctypes.addressof(_first_byte(array))  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError):  # read-only, or empty
        return array.__array_interface__["data"][0]


def _working_memory(count: int) -> int:
    """Return the address of this thread's memory; it is kept, as new memory takes longer."""
    size, start = getattr(_thread, "memory", (0, 0))
    if size < count:
        _thread.array = np.zeros(count + 8)
        start = _address(_thread.array)
        start += -start % 64
        _thread.memory = (count, start)
    return start
