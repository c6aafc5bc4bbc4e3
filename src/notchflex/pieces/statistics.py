"""Points and statistics of rows that do not fit into memory at once.

Values are counted in bins: equal ones where a sample has its values, and such of equal ratios
beyond. Counts of pieces are added, so that the bins of a table are those of all its rows.
"""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import qmc

from notchflex.pieces.folder import CODES

_HALF = 1024
"""Bins on either side of the middle of the sample."""

_MAX_BIN = 64 * _HALF


Numbers = Float[np.ndarray, " k"]
Integers = Int[np.ndarray, " k"]
Scale = tuple[float, float]
"""Range of the values of a sample: a finite middle, and half the range, above 0."""


def scale_of(values: Numbers) -> Scale:
    """Find the scale of a sample; NaN is left out."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1.0
    low, high = 0.5 * float(finite.min()), 0.5 * float(finite.max())
    return low + high, max(high - low, 1e-9 * abs(low + high), 1e-12)


@dataclass
class Sketch:
    """Statistics of a column that are merged from pieces.

    Attributes:
        count: Number of values.
        total: Their sum, less the middle of the scale.
        squares: Sum of squares of the same.
        smallest: Smallest values with their rows, in order.
        largest: Largest values with their rows, the largest first.
        first: Bin of the first count.
        counts: Values in every bin from there on.
        scale: Range of a sample.
    """

    count: int = 0
    total: float = 0.0
    squares: float = 0.0
    smallest: list[list[Any]] = field(default_factory=list[list[Any]])
    largest: list[list[Any]] = field(default_factory=list[list[Any]])
    first: int = 0
    counts: Int[np.ndarray, " bins"] = field(default_factory=lambda: np.zeros(0, np.int64))
    scale: Scale = (0.0, 1.0)

    @classmethod
    def of(cls, values: Numbers, start: int, scale: Scale, keep: int) -> Sketch:
        """Describe a column whose first row has the number `start`; NaN is left out."""
        rows = np.flatnonzero(np.isfinite(values))
        values, rows = values[rows], rows + start
        if not len(values):
            return cls(scale=scale)
        middle, half = scale
        moved = values - middle
        bins = _bins(moved / half)
        first = int(bins.min())
        with np.errstate(over="ignore"):
            total, squares = float(moved.sum()), float(np.square(moved).sum())
        smallest = _least(values, rows, keep)
        largest = [[-value, row] for value, row in _least(-values, rows, keep)]
        counts = np.bincount(bins - first)
        return cls(len(values), total, squares, smallest, largest, first, counts, scale)

    def merged(self, more: Sketch, keep: int) -> Sketch:
        """Return the description of both columns; the scale is that of `more`."""
        first = min(self.first, more.first)
        last = max(self.first + len(self.counts), more.first + len(more.counts))
        counts = np.zeros(last - first, np.int64)
        for part in (self, more):
            counts[part.first - first :][: len(part.counts)] += part.counts
        return Sketch(
            self.count + more.count,
            self.total + more.total,
            self.squares + more.squares,
            sorted(self.smallest + more.smallest)[:keep],
            sorted(self.largest + more.largest, key=lambda pair: (-pair[0], pair[1]))[:keep],
            first,
            counts,
            more.scale,
        )

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value; NaN of none."""
        return (self.smallest[0][0], self.largest[0][0]) if self.count else (math.nan, math.nan)

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation; NaN of none."""
        if not self.count:
            return math.nan, math.nan
        mean = self.total / self.count
        return mean + self.scale[0], math.sqrt(max(self.squares / self.count - mean**2, 0.0))

    def quantile(self, part: float) -> float:
        """Return the value that a part of all values lies below, within its bin; NaN of none."""
        if not self.count:
            return math.nan
        target = part * self.count
        below = np.concatenate([[0], np.cumsum(self.counts)])
        number = max(int(np.searchsorted(below, target)) - 1, 0)
        inside = (target - below[number]) / max(int(self.counts[number]), 1)
        return float(np.clip(self._values(number + inside), *self.ends))

    def histogram(self, bins: int) -> tuple[list[float], list[int]]:
        """Return edges and counts of equal bins; a fine bin counts where its middle lies."""
        if not self.count or not bins:
            return [], []
        edges = np.linspace(*self.ends, bins + 1)
        middles = self._values(0.5 + np.arange(len(self.counts)))
        numbers = np.clip(np.searchsorted(edges, middles, side="right") - 1, 0, bins - 1)
        return edges.tolist(), np.bincount(numbers, self.counts, bins).astype(int).tolist()

    def _values(self, number: Any) -> Any:
        """Return values by numbers of bins from the first; between whole numbers those between."""
        (middle, half), position = self.scale, (self.first + number) / _HALF
        size = np.abs(position)
        with np.errstate(over="ignore"):
            far = np.copysign(np.exp(size - 1.0), position)
        return middle + half * np.where(size > 1.0, far, position)


def _bins(position: Numbers) -> Integers:
    """Return the bins of values less the middle, in halves of the range."""
    bins = np.floor(position * _HALF)
    beyond = np.abs(position) > 1.0
    if beyond.any():
        far = position[beyond]
        bins[beyond] = np.floor(np.copysign(_HALF * (1.0 + np.log(np.abs(far))), far))
    return np.clip(bins, -_MAX_BIN, _MAX_BIN).astype(np.int64)


def _least(values: Numbers, rows: Integers, keep: int) -> list[list[Any]]:
    """Return the smallest values with their rows; of equal ones those of the first rows."""
    if keep < len(values):  # never are all values put in order
        near = values <= np.partition(values, keep)[keep]
        values, rows = values[near], rows[near]
    order = np.argsort(values, kind="stable")[:keep]
    return list(map(list, zip(values[order].tolist(), rows[order].tolist(), strict=True)))


def summed_up(
    columns: Mapping[str, Numbers],
    codes: Integers,
    start: int,
    scales: Mapping[str, Scale],
    keep: int,
    **more: Any,
) -> dict[str, Any]:
    """Return what the head of a piece says of its rows, in plain values.

    Args:
        columns: Numbers of its rows by name.
        codes: What became of them, indices of `CODES`.
        start: The first row.
        scales: Scales of the statistics.
        keep: So many rows with the smallest and the largest values are told.
        more: Further entries.
    """
    documents: dict[str, dict[str, Any]] = {}
    for name, values in columns.items():
        sketch = Sketch.of(values, start, scales[name], keep)
        documents[name] = vars(sketch) | {"counts": sketch.counts.tolist()}
        del documents[name]["scale"]
    counts = np.bincount(codes, minlength=len(CODES)).tolist()
    return {"codes": counts, **more, "scales": scales, "columns": documents}


def add_to(sketches: dict[str, Sketch], head: Mapping[str, Any], keep: int) -> None:
    """Merge the columns of a head, made by `summed_up`, with those of the pieces before."""
    for name, document in head["columns"].items():
        counts = np.array(document["counts"], np.int64)
        more = replace(Sketch(**document), counts=counts, scale=head["scales"][name])
        sketches[name] = sketches.get(name, Sketch()).merged(more, keep)


_BITS_30 = 2**30
"""SciPy's sequence has so many points, or 2^64 if it is asked for them beforehand."""

_FORWARD = 2**31
"""SciPy counts the steps forward with 32 bits."""

_reached = threading.local()
"""The sequence that a thread drew from last: going on is quick, and going back is not."""


def sobol_points(
    dimension: int, seed: int, start: int, stop: int, total: int, *stream: int
) -> Float[np.ndarray, "k d"]:
    """Return the points from `start` to `stop` (not included) of a scrambled Sobol sequence.

    Args:
        dimension: Numbers of a point.
        seed: Seed of the scrambling.
        start: First point, from 0.
        stop: The point behind the last one.
        total: Points of the sequence.
        stream: Which of the independent sequences of this seed; none for the first.
    """
    key = dimension, seed, total > _BITS_30, stream
    if getattr(_reached, "key", None) != key or _reached.engine.num_generated > start:
        random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=stream))
        _reached.key, _reached.engine = (
            key,
            qmc.Sobol(  # pyright: ignore[reportCallIssue]
                dimension, scramble=True, bits=64 if total > _BITS_30 else 30, rng=random
            ),
        )
    engine = _reached.engine
    while start > engine.num_generated:
        engine.fast_forward(min(start - engine.num_generated, _FORWARD))
    with warnings.catch_warnings():  # that the first draw is not a power of two
        warnings.simplefilter("ignore", UserWarning)
        return engine.random(stop - start)
