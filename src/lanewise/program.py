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
_first_byte, _address_of = ctypes.c_char.from_buffer, ctypes.addressof


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
    how: str = "rows",
) -> tuple[LoweredProgram, Any]:
    """Lower a function to LLVM IR.

    Args:
        function: A function of vectors of floats that JAX can trace.
        arguments: Vectors of the sizes it takes, those of one row; their values are not used.
        lane_sizes: Sizes of axes that rows are laid out along, such as the number of bodies.
        by_row: Which arguments have a row for every row of a batch; None without a batch.
        how: What happens to the rows of a batch: "rows" are computed side by side, "map" one after
            the other; "scan" also carries the first vector from row to row, which the function
            returns before its results.

    Returns:
        The program, and the tree of the function's results with shapes and dtypes.

    Raises:
        UnsupportedPrimitiveError: The function uses what is not supported.
    """
    closed, tree = jax.make_jaxpr(function, return_shape=True)(*arguments)
    if by_row is None:
        lowered = lower_single(closed, lane_sizes)
    elif how == "rows":
        lowered = lower_batch(closed, lane_sizes, by_row)
    else:
        lowered = lower_path(closed, lane_sizes, by_row, carries=how == "scan")
        tree = tree[1] if how == "scan" else tree
    emitter = Emitter(lowered)
    size = emitter.storage.arena.size + 64
    return LoweredProgram(emitter.source, tuple(lowered.sizes), size), tree


class FixedVector:
    """A vector of floats that nobody changes, with its address: for many calls of programs."""

    def __init__(self, values: Any) -> None:
        """Copy the numbers."""
        self.values = np.array(values, float)
        self.shape, self.address = self.values.shape, _address(self.values)

    def __array__(self, *options: Any, **named: Any) -> np.ndarray:
        """Return the numbers, for NumPy and JAX."""
        return np.asarray(self.values, *options, **named)


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
        self.sizes, self.memory = sizes, memory
        self._first_table = None if by_row is None else by_row.index(True)
        self._function = load(code)

    def __call__(self, arguments: Sequence[np.ndarray | FixedVector]) -> list[np.ndarray]:
        """Run the program.

        Args:
            arguments: Arrays of floats; those by row have rows as leading axis.

        Returns:
            Flat arrays, rows as leading axis where there are any.
        """
        addresses: list[int] = []
        arrays: list[np.ndarray] = []  # they live until the program has run
        for argument in arguments:
            if type(argument) is FixedVector:
                addresses.append(argument.address)
            else:
                arrays.append(np.ascontiguousarray(argument, float))
                addresses.append(_address(arrays[-1]))
        if self._first_table is None:
            rows, results = 1, [np.empty(size) for size in self.sizes]
        else:
            rows = arguments[self._first_table].shape[0]
            results = [np.empty((rows, size)) for size in self.sizes]
        if rows:
            given = pack(f"{len(addresses)}P", *addresses)
            returned = pack(f"{len(results)}P", *map(_address, results))
            self._function(given, returned, _working_memory(self.memory), rows)
        return results


def _address(array: Any) -> int:
    try:  # through the buffer it takes a fifth of the time
        return _address_of(_first_byte(array))
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
