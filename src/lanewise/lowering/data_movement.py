"""Lower what only rearranges entries: slices, transposes, concatenation, padding, gather, scatter.

Each function takes references and the parameters of one of JAX's primitives and returns references;
nothing remains to be done at run time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lanewise.ir.graph import References, UnsupportedPrimitiveError


def _broadcast(
    refs: References, *, shape: tuple[int, ...], broadcast_dimensions: tuple[int, ...], **_: Any
) -> References:
    aligned = [1] * len(shape)
    for axis, target in enumerate(broadcast_dimensions):
        aligned[target] = refs.shape[axis]
    return np.broadcast_to(refs.reshape(aligned), shape)


def _reshape(
    refs: References, *, new_sizes: tuple[int, ...], dimensions: Any = None, **_: Any
) -> References:
    if dimensions is not None:
        refs = np.transpose(refs, dimensions)
    return refs.reshape(new_sizes)


def _slice(
    refs: References, *, start_indices: Any, limit_indices: Any, strides: Any, **_: Any
) -> References:
    steps = strides or (1,) * refs.ndim
    cut = (slice(*one) for one in zip(start_indices, limit_indices, steps, strict=True))
    return refs[tuple(cut)]


def _pad(refs: References, filling: References, *, padding_config: Any, **_: Any) -> References:
    shape = [
        low + high + size + max(size - 1, 0) * interior
        for size, (low, high, interior) in zip(refs.shape, padding_config, strict=True)
    ]
    out = np.broadcast_to(filling, shape).copy()
    targets: list[slice] = []
    sources: list[slice] = []
    for size, whole, (low, _high, interior) in zip(refs.shape, shape, padding_config, strict=True):
        positions = low + np.arange(size) * (interior + 1)
        kept = np.flatnonzero((positions >= 0) & (positions < whole))
        if not len(kept):
            return out
        first, last = kept[0], kept[-1]
        targets.append(slice(int(positions[first]), int(positions[last]) + 1, interior + 1))
        sources.append(slice(int(first), int(last) + 1))
    out[tuple(targets)] = refs[tuple(sources)]
    return out


def _identity(refs: References, **_: Any) -> References:
    return refs


DATA_MOVEMENT: dict[str, Callable[..., Any]] = {
    "broadcast_in_dim": _broadcast,
    "reshape": _reshape,
    "squeeze": lambda refs, *, dimensions, **_: np.squeeze(refs, tuple(dimensions)),
    "expand_dims": lambda refs, *, dimensions, **_: np.expand_dims(refs, tuple(dimensions)),
    "transpose": lambda refs, *, permutation, **_: np.transpose(refs, permutation),
    "rev": lambda refs, *, dimensions, **_: np.flip(refs, dimensions),
    "slice": _slice,
    "concatenate": lambda *arrays, dimension, **_: np.concatenate(arrays, axis=dimension),
    "stack": lambda *arrays, axis=0, **_: np.stack(arrays, axis),
    "unstack": lambda refs, *, axis, **_: list(np.moveaxis(refs, axis, 0)),
    "split": lambda refs, *, sizes, axis, **_: np.split(refs, np.cumsum(sizes)[:-1], axis),
    "pad": _pad,
    "copy": _identity,
    "copy_p": _identity,
    "stop_gradient": _identity,
    "optimization_barrier": lambda *arrays, **_: list(arrays),
}
"""Functions by the name of JAX's primitive."""


def gather_static(refs: References, indices: np.ndarray, params: dict[str, Any]) -> References:
    """Return entries at known indices, as JAX's `gather`.

    Raises:
        UnsupportedPrimitiveError: Some indices are out of bounds.
    """
    sizes = params["slice_sizes"]
    at, grid = _gather_windows(refs, indices.shape, params)
    starts = indices[grid]
    for number, axis in enumerate(params["dimension_numbers"].start_index_map):
        limit, start = refs.shape[axis] - sizes[axis], starts[..., number]
        if params["mode"].name == "CLIP":
            start = np.clip(start, 0, limit)
        at[axis] = at[axis] + _in_bounds(start, limit)
    return refs[tuple(at)]


def gather_candidates(
    refs: References, indices: References, params: dict[str, Any]
) -> tuple[References, list[References]]:
    """Return what `gather` selects from if its indices are only known at run time.

    Returns:
        The index of each result, and for every value it may have the entries it selects.

    Raises:
        UnsupportedPrimitiveError: Indices along more than one axis.
    """
    axes = params["dimension_numbers"].start_index_map
    if len(axes) != 1:
        raise UnsupportedPrimitiveError("computed indices along several axes", "gather")
    at, grid = _gather_windows(refs, indices.shape, params)
    count = refs.shape[axes[0]] - params["slice_sizes"][axes[0]] + 1
    candidates = [
        refs[tuple(one + number * (axis == axes[0]) for axis, one in enumerate(at))]
        for number in range(count)
    ]
    return indices[grid][..., 0], candidates


def _gather_windows(
    refs: References, indices: tuple[int, ...], params: dict[str, Any]
) -> tuple[list[np.ndarray], tuple[np.ndarray, ...]]:
    """Return where entries come from if all indices are 0, and which index each entry has."""
    numbers, sizes = params["dimension_numbers"], params["slice_sizes"]
    batch = list(numbers.operand_batching_dims)
    dropped = (*numbers.collapsed_slice_dims, *batch)
    window = [axis for axis in range(refs.ndim) if axis not in dropped]
    rank = len(indices) - 1 + len(numbers.offset_dims)
    batch_axes = [axis for axis in range(rank) if axis not in numbers.offset_dims]
    out_shape = [0] * rank
    for axis, size in zip(batch_axes, indices[:-1], strict=True):
        out_shape[axis] = size
    for axis, own in zip(numbers.offset_dims, window, strict=True):
        out_shape[axis] = sizes[own]
    grid = np.indices(out_shape)
    at = [np.zeros(out_shape, int) for _ in range(refs.ndim)]
    for axis, own in zip(numbers.offset_dims, window, strict=True):
        at[own] = at[own] + grid[axis]
    for own, axis in zip(batch, numbers.start_indices_batching_dims, strict=True):
        at[own] = at[own] + grid[batch_axes[axis]]
    return at, tuple(grid[axis] for axis in batch_axes)


def scatter_static(
    refs: References,
    indices: np.ndarray,
    updates: References,
    params: dict[str, Any],
    combine: Callable[[References, References], References] | None,
) -> References:
    """Return an array with entries at known indices changed, as JAX's `scatter`.

    Args:
        refs: The array.
        indices: Where to write.
        updates: What to write.
        params: Parameters of the primitive.
        combine: Computes the new entry from the old one and the update; None replaces it.

    Raises:
        UnsupportedPrimitiveError: Indices are out of bounds, or repeated where entries are
            replaced.
    """
    numbers = params["dimension_numbers"]
    batch = list(numbers.operand_batching_dims)
    dropped = (*numbers.inserted_window_dims, *batch)
    window_axes = [axis for axis in range(refs.ndim) if axis not in dropped]
    batch_axes = [a for a in range(updates.ndim) if a not in numbers.update_window_dims]
    grid = np.indices(updates.shape)
    starts = indices[tuple(grid[axis] for axis in batch_axes)]
    pairs = list(zip(numbers.update_window_dims, window_axes, strict=True))
    window = {own: updates.shape[a] for a, own in pairs}
    at: list[np.ndarray] = [np.zeros(updates.shape, int) for _ in range(refs.ndim)]
    for number, axis in enumerate(numbers.scatter_dims_to_operand_dims):
        limit = refs.shape[axis] - window.get(axis, 1)
        at[axis] = at[axis] + _in_bounds(starts[..., number], limit)
    for axis, own in pairs:
        at[own] = at[own] + grid[axis]
    for own, axis in zip(batch, numbers.scatter_indices_batching_dims, strict=True):
        at[own] = at[own] + grid[batch_axes[axis]]
    flat = np.ravel_multi_index(tuple(at), refs.shape).ravel()
    out, new = refs.ravel().copy(), updates.ravel()
    order = np.argsort(flat, kind="stable")
    turn = np.empty_like(flat)  # how often the same index has come before
    turn[order] = np.arange(len(flat)) - np.searchsorted(flat[order], flat[order])
    if combine is None and turn.any():
        raise UnsupportedPrimitiveError("repeated indices", "scatter")
    for number in range(turn.max(initial=-1) + 1):
        some = turn == number
        target = flat[some]
        out[target] = new[some] if combine is None else combine(out[target], new[some])
    return out.reshape(refs.shape)


def _in_bounds(starts: np.ndarray, limit: int) -> np.ndarray:
    if (starts < 0).any() or (starts > limit).any():
        raise UnsupportedPrimitiveError("indices out of bounds", "gather or scatter")
    return starts
