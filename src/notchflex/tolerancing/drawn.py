"""Robots drawn within tolerances: all in memory, or what is summed up of many more in pieces."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from notchflex.pieces.codes import CODES
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.tolerancing.criteria import Criterion
from notchflex.tolerancing.study import Outcomes
from notchflex.tolerancing.yields import REPLICATES

Histogram = tuple[Float[np.ndarray, " edges"], Int[np.ndarray, " bins"]]


@dataclass(frozen=True, eq=False)
class DrawnRobots:
    """The robots that were drawn within the tolerances.

    Attributes:
        numbers: Their numbers by name, (draws,).
        outcomes: What became of them.
    """

    numbers: Mapping[str, Float[np.ndarray, " draws"]]
    outcomes: Outcomes

    @property
    def codes(self) -> Int[np.ndarray, " codes"]:
        """Number of robots by each of `CODES`."""
        return np.bincount(self.outcomes.codes, minlength=len(CODES))

    @property
    def accepted(self) -> Int[np.ndarray, " replicates"]:
        """Number of accepted robots in each replicate."""
        return self.outcomes.accepted.reshape(REPLICATES, -1).sum(axis=1)

    def beyond(self, criteria: Sequence[Criterion]) -> tuple[np.ndarray, np.ndarray]:
        """Return how many robots are below and above the limits of each number, (k,) each."""
        return beyond(self.outcomes.values, criteria)

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the robots stays below."""
        values = self.outcomes.values
        values = values[np.isfinite(values).all(axis=1)]
        size = values.shape[1]
        return np.quantile(values, part, axis=0) if len(values) else np.full(size, np.nan)

    def histogram(self, index: int, bins: int) -> Histogram:
        """Return edges and counts of the values of a number; both empty without a result."""
        values = self.outcomes.values[:, index]
        values = values[np.isfinite(values)]
        if not len(values):
            return np.zeros(0), np.zeros(0, int)
        counts, edges = np.histogram(values, bins)
        return edges, counts


@dataclass(frozen=True, eq=False)
class DrawnPieces:
    """Summary of robots that were drawn in pieces.

    Attributes:
        directory: The folder of the pieces.
        codes: How many robots have each of `CODES`.
        accepted: How many robots of each replicate are accepted.
        below: How many robots are below the lower limit of each number, (k,).
        above: The same above the upper limit.
        sketches: Statistics of each number.
        scales: Scales of the statistics.
    """

    directory: str | os.PathLike[str]
    codes: Int[np.ndarray, " codes"]
    accepted: Int[np.ndarray, " replicates"]
    below: Int[np.ndarray, " k"]
    above: Int[np.ndarray, " k"]
    sketches: Sequence[Sketch]
    scales: Sequence[Scale]

    def beyond(self, criteria: Sequence[Criterion]) -> tuple[np.ndarray, np.ndarray]:
        """Return how many robots are below and above the limits of each number, (k,) each."""
        del criteria
        return self.below, self.above

    def percentile(self, part: float) -> Float[np.ndarray, " k"]:
        """Return the value of each number that a part of the robots stays below.

        It is exact to 1/1000 of half the range of most values.
        """
        both = zip(self.sketches, self.scales, strict=True)
        return np.array([sketch.quantile(part, scale) for sketch, scale in both])

    def histogram(self, index: int, bins: int) -> Histogram:
        """Return edges and counts of the values of a number; both empty without a result."""
        edges, counts = self.sketches[index].histogram(bins, self.scales[index])
        return np.array(edges), np.array(counts, int)


def beyond(
    values: Float[np.ndarray, "robots k"], criteria: Sequence[Criterion]
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return how many robots are below and above the limits of each number."""
    lower, upper = (np.array([getattr(one, end) for one in criteria]) for end in ("lower", "upper"))
    return (values < lower).sum(axis=0), (values > upper).sum(axis=0)
