"""What only moves entries of arrays: slices, transposes, joins, padding, picking by known places.

Each takes tables and the parameters of a primitive of JAX, and returns a table; programs do
nothing for them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.ir.graph import Table, UnknownHereError


def _broadcast(
    table: Table, *, shape: tuple[int, ...], broadcast_dimensions: tuple[int, ...], **_: Any
) -> Table:
    own = [1] * len(shape)
    for axis, place in enumerate(broadcast_dimensions):
        own[place] = table.shape[axis]
    return np.broadcast_to(table.reshape(own), shape)


def _reshape(
    table: Table, *, new_sizes: tuple[int, ...], dimensions: Any = None, **_: Any
) -> Table:
    if dimensions is not None:
        table = np.transpose(table, dimensions)
    return table.reshape(new_sizes)


def _squeeze(table: Table, *, dimensions: tuple[int, ...], **_: Any) -> Table:
    return np.squeeze(table, axis=tuple(dimensions))


def _expand(table: Table, *, dimensions: tuple[int, ...], **_: Any) -> Table:
    return np.expand_dims(table, tuple(dimensions))


def _transpose(table: Table, *, permutation: tuple[int, ...], **_: Any) -> Table:
    return np.transpose(table, permutation)


def _rev(table: Table, *, dimensions: tuple[int, ...], **_: Any) -> Table:
    return np.flip(table, dimensions)


def _slice(
    table: Table, *, start_indices: Any, limit_indices: Any, strides: Any, **_: Any
) -> Table:
    steps = strides or (1,) * table.ndim
    cut = (slice(*one) for one in zip(start_indices, limit_indices, steps, strict=True))
    return table[tuple(cut)]


def _concatenate(*tables: Table, dimension: int, **_: Any) -> Table:
    return np.concatenate(tables, axis=dimension)


def _stack(*tables: Table, axis: int = 0, **_: Any) -> Table:
    return np.stack(tables, axis=axis)


def _unstack(table: Table, *, axis: int, **_: Any) -> list[Table]:
    return list(np.moveaxis(table, axis, 0))


def _split(table: Table, *, sizes: tuple[int, ...], axis: int, **_: Any) -> list[Table]:
    return np.split(table, np.cumsum(sizes)[:-1], axis=axis)


def _pad(table: Table, filling: Table, *, padding_config: Any, **_: Any) -> Table:
    shape = [
        low + high + size + max(size - 1, 0) * inside
        for size, (low, high, inside) in zip(table.shape, padding_config, strict=True)
    ]
    out = np.broadcast_to(filling, shape).copy()
    goes: list[slice] = []
    comes: list[slice] = []
    for size, whole, (low, _high, inside) in zip(table.shape, shape, padding_config, strict=True):
        places = low + np.arange(size) * (inside + 1)
        own = np.flatnonzero((places >= 0) & (places < whole))
        if not len(own):
            return out
        goes.append(slice(int(places[own[0]]), int(places[own[-1]]) + 1, inside + 1))
        comes.append(slice(int(own[0]), int(own[-1]) + 1))
    out[tuple(goes)] = table[tuple(comes)]
    return out


def _same(table: Table, **_: Any) -> Table:
    return table


def _all_same(*tables: Table, **_: Any) -> list[Table]:
    return list(tables)


MOVES: dict[str, Callable[..., Any]] = {
    "broadcast_in_dim": _broadcast,
    "reshape": _reshape,
    "squeeze": _squeeze,
    "expand_dims": _expand,
    "transpose": _transpose,
    "rev": _rev,
    "slice": _slice,
    "concatenate": _concatenate,
    "stack": _stack,
    "unstack": _unstack,
    "split": _split,
    "pad": _pad,
    "copy": _same,
    "copy_p": _same,
    "stop_gradient": _same,
    "optimization_barrier": _all_same,
}
"""By the name of JAX's primitive."""


def gathered(table: Table, places: np.ndarray, parameters: dict[str, Any]) -> Table:
    """Entries at known places, as JAX's `gather`.

    Raises:
        UnknownHereError: Some places are outside the array.
    """
    sizes = parameters["slice_sizes"]
    at, grid = _windows(table, places.shape, parameters)
    starts = places[grid]
    for number, axis in enumerate(parameters["dimension_numbers"].start_index_map):
        at[axis] = at[axis] + _inside(starts[..., number], table.shape[axis] - sizes[axis])
    return table[tuple(at)]


def picked(
    table: Table,
    places: Table,
    parameters: dict[str, Any],
    chosen: Callable[[Table, int, Table, Table], Table],
) -> Table:
    """Entries at places that are computed, as JAX's `gather`: chosen among all there are.

    Args:
        table: The array.
        places: Entries of the places.
        parameters: Of the primitive.
        chosen: From places, a number, and two tables: the first where the place is that number.

    Raises:
        UnknownHereError: Places along more than one axis.
    """
    axes = parameters["dimension_numbers"].start_index_map
    if len(axes) != 1:
        raise UnknownHereError("computed places along several axes")
    at, grid = _windows(table, places.shape, parameters)
    starts = places[grid][..., 0]
    count = table.shape[axes[0]] - parameters["slice_sizes"][axes[0]] + 1
    found = None
    for number in range(count):
        moved = [own + number if axis == axes[0] else own for axis, own in enumerate(at)]
        own = table[tuple(moved)]
        found = own if found is None else chosen(starts, number, own, found)
    assert found is not None
    return found


def _windows(
    table: Table, places: tuple[int, ...], parameters: dict[str, Any]
) -> tuple[list[np.ndarray], tuple[np.ndarray, ...]]:
    """Where entries would come from if all places were 0, and which place each entry has."""
    numbers, sizes = parameters["dimension_numbers"], parameters["slice_sizes"]
    batch = list(numbers.operand_batching_dims)
    left_out = (*numbers.collapsed_slice_dims, *batch)
    within = [axis for axis in range(table.ndim) if axis not in left_out]
    rank = len(places) - 1 + len(numbers.offset_dims)
    batch_axes = [axis for axis in range(rank) if axis not in numbers.offset_dims]
    out_shape = [0] * rank
    for axis, size in zip(batch_axes, places[:-1], strict=True):
        out_shape[axis] = size
    for axis, own in zip(numbers.offset_dims, within, strict=True):
        out_shape[axis] = sizes[own]
    grid = np.indices(out_shape)
    at = [np.zeros(out_shape, int) for _ in range(table.ndim)]
    for axis, own in zip(numbers.offset_dims, within, strict=True):
        at[own] = at[own] + grid[axis]
    for own, axis in zip(batch, numbers.start_indices_batching_dims, strict=True):
        at[own] = at[own] + grid[batch_axes[axis]]
    return at, tuple(grid[axis] for axis in batch_axes)


def scattered(
    table: Table,
    places: np.ndarray,
    updates: Table,
    parameters: dict[str, Any],
    joined: Callable[[Table, Table], Table],
) -> Table:
    """An array with entries at known places replaced, as JAX's `scatter`.

    Args:
        table: The array.
        places: Where.
        updates: What is put there.
        parameters: Of the primitive.
        joined: What is made of an old and a new entry.

    Raises:
        UnknownHereError: Some places are outside the array, or are met twice.
    """
    numbers = parameters["dimension_numbers"]
    batch = list(numbers.operand_batching_dims)
    within = [
        axis for axis in range(table.ndim) if axis not in (*numbers.inserted_window_dims, *batch)
    ]
    batch_axes = [a for a in range(updates.ndim) if a not in numbers.update_window_dims]
    grid = np.indices(updates.shape)
    starts = places[tuple(grid[axis] for axis in batch_axes)]
    window = {
        own: updates.shape[a] for a, own in zip(numbers.update_window_dims, within, strict=True)
    }
    at: list[np.ndarray] = [np.zeros(updates.shape, int) for _ in range(table.ndim)]
    for number, axis in enumerate(numbers.scatter_dims_to_operand_dims):
        most = table.shape[axis] - window.get(axis, 1)
        at[axis] = at[axis] + _inside(starts[..., number], most)
    for axis, own in zip(numbers.update_window_dims, within, strict=True):
        at[own] = at[own] + grid[axis]
    for own, axis in zip(batch, numbers.scatter_indices_batching_dims, strict=True):
        at[own] = at[own] + grid[batch_axes[axis]]
    flat = np.ravel_multi_index(tuple(at), table.shape).ravel()
    if len(set(flat.tolist())) < len(flat):
        raise UnknownHereError("entries that are put in the same place")
    out = table.ravel().copy()
    out[flat] = joined(out[flat], updates.ravel())
    return out.reshape(table.shape)


def _inside(starts: np.ndarray, most: int) -> np.ndarray:
    if (starts < 0).any() or (starts > most).any():
        raise UnknownHereError("places outside an array")
    return starts


__all__ = ["MOVES", "gathered", "picked", "scattered"]
