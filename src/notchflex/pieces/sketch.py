"""Statistics of a column that are merged from pieces: the order of merging changes nothing.

Values are counted in bins: equal ones where a sample of the sweep has its values, and such of equal
ratios beyond. Counts of pieces are added, so that the bins of a sweep are those of all its rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float, Int

HALF = 1024
"""Bins on either side of the middle of the sample."""

_MAX_BIN = 64 * HALF


@dataclass(frozen=True)
class Scale:
    """Range of the values of a sample: a finite middle, and half the range, above 0."""

    middle: float
    half: float

    @classmethod
    def of(cls, values: Float[np.ndarray, " k"]) -> Scale:
        """Find the scale of a sample; NaN is left out."""
        finite = values[np.isfinite(values)]
        if not len(finite):
            return cls(0.0, 1.0)
        low, high = float(finite.min()), float(finite.max())
        middle = 0.5 * low + 0.5 * high
        return cls(middle, max(0.5 * high - 0.5 * low, 1e-9 * abs(middle), 1e-12))

    def bins(self, values: Float[np.ndarray, " k"]) -> Int[np.ndarray, " k"]:
        """Return the bin of every value."""
        position = (values - self.middle) / self.half
        beyond = np.abs(position) > 1.0
        bins = np.floor(position * HALF)
        if beyond.any():
            far = position[beyond]
            bins[beyond] = np.floor(np.copysign(HALF * (1.0 + np.log(np.abs(far))), far))
        return np.clip(bins, -_MAX_BIN, _MAX_BIN).astype(np.int64)

    def edge(self, number: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """Return values whose bins are given; between whole numbers those in between."""
        position = np.asarray(number, float) / HALF
        far = np.abs(position) > 1.0
        with np.errstate(over="ignore"):
            position = np.where(
                far, np.copysign(np.exp(np.abs(position) - 1.0), position), position
            )
        return self.middle + self.half * position


@dataclass
class Sketch:
    """Counts of the values of one column, their extremes and their sums.

    Attributes:
        count: Number of values.
        total: Their sum, less the middle of the scale.
        squares: Sum of squares of the same.
        smallest: Rows with the smallest values: (value, row), in order.
        largest: Rows with the largest values, the largest first.
        first: Bin of the first count.
        counts: Values in every bin from there on.
    """

    count: int = 0
    total: float = 0.0
    squares: float = 0.0
    smallest: list[tuple[float, int]] = field(default_factory=list[tuple[float, int]])
    largest: list[tuple[float, int]] = field(default_factory=list[tuple[float, int]])
    first: int = 0
    counts: Int[np.ndarray, " bins"] = field(default_factory=lambda: np.zeros(0, np.int64))

    @classmethod
    def of(cls, values: Float[np.ndarray, " k"], start: int, scale: Scale, extremes: int) -> Sketch:
        """Describe a column of a piece, whose first row has the number `start`; NaN is left out."""
        rows = np.arange(start, start + len(values))
        is_finite = np.isfinite(values)
        if not is_finite.all():
            values, rows = values[is_finite], rows[is_finite]
        if not len(values):
            return cls()
        bins = scale.bins(values)
        first = int(bins.min())
        counts = np.bincount(bins - first)
        moved = values - scale.middle
        with np.errstate(over="ignore"):
            total, squares = float(moved.sum()), float(np.square(moved).sum())
        # All values are never put in order: extremes are in the outermost bins.
        keep = max(extremes, 1)
        low = np.flatnonzero(bins <= first + _holding(counts, keep))
        high = np.flatnonzero(bins >= first + len(counts) - 1 - _holding(counts[::-1], keep))
        smallest = _least(values[low], rows[low], keep)
        largest = [(-value, row) for value, row in _least(-values[high], rows[high], keep)]
        return cls(len(values), total, squares, smallest, largest, first, counts)

    def merged(self, other: Sketch, extremes: int) -> Sketch:
        """Return the description of both columns."""
        if not (self.count and other.count):
            return self if self.count else other
        first = min(self.first, other.first)
        last = max(self.first + len(self.counts), other.first + len(other.counts))
        counts = np.zeros(last - first, np.int64)
        for one in (self, other):
            offset = one.first - first
            counts[offset : offset + len(one.counts)] += one.counts
        keep = max(extremes, 1)
        largest = sorted(self.largest + other.largest, key=lambda one: (-one[0], one[1]))
        return Sketch(
            self.count + other.count,
            self.total + other.total,
            self.squares + other.squares,
            sorted(self.smallest + other.smallest)[:keep],
            largest[:keep],
            first,
            counts,
        )

    def quantile(self, part: float, scale: Scale) -> float:
        """Return the value that a part of all values lies below, within its bin; NaN of none."""
        if not self.count:
            return math.nan
        target = part * self.count
        below = np.concatenate([[0], np.cumsum(self.counts)])
        bin_number = max(int(np.searchsorted(below, target)) - 1, 0)
        inside = (target - below[bin_number]) / max(int(self.counts[bin_number]), 1)
        value = float(scale.edge(np.array(self.first + bin_number + inside)))
        return min(max(value, self.smallest[0][0]), self.largest[0][0])

    def histogram(self, bins: int, scale: Scale) -> tuple[list[float], list[int]]:
        """Return edges and counts of equal bins; a fine bin counts where its middle lies."""
        if not self.count or not bins:
            return [], []
        edges = np.linspace(self.smallest[0][0], self.largest[0][0], bins + 1)
        middles = scale.edge(self.first + 0.5 + np.arange(len(self.counts)))
        bin_numbers = np.clip(np.searchsorted(edges, middles, side="right") - 1, 0, bins - 1)
        return edges.tolist(), np.bincount(bin_numbers, self.counts, bins).astype(int).tolist()

    def document(self) -> dict[str, Any]:
        """Return plain values, which `read` takes."""
        return {**vars(self), "counts": self.counts.tolist()}

    @classmethod
    def read(cls, document: dict[str, Any]) -> Sketch:
        """Make a description of its plain values."""
        changed: dict[str, Any] = {
            key: [(value, row) for value, row in document[key]] for key in ("smallest", "largest")
        }
        changed["counts"] = np.array(document["counts"], np.int64)
        return cls(**(document | changed))


def _holding(counts: Int[np.ndarray, " bins"], keep: int) -> int:
    """Return the first place up to which so many values are counted, or the last place."""
    return min(int(np.searchsorted(np.cumsum(counts), keep)), len(counts) - 1)


def _least(
    values: Float[np.ndarray, " k"], rows: Int[np.ndarray, " k"], keep: int
) -> list[tuple[float, int]]:
    """Return the smallest values with their rows; of equal ones those of the first rows."""
    if keep < len(values):
        end = np.partition(values, keep - 1)[keep - 1]
        below = np.flatnonzero(values <= end)
        values, rows = values[below], rows[below]
    order = np.argsort(values, kind="stable")[:keep]
    return list(zip(values[order].tolist(), rows[order].tolist(), strict=True))
