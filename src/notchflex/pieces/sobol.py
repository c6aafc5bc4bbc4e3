"""Any part of a scrambled Sobol sequence; going on is quick."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

_BITS_30 = 2**30
"""SciPy's sequence has so many points, or 2^64 if it is asked for them beforehand."""

_FORWARD = 2**31
"""SciPy counts the steps forward with 32 bits."""


class SobolPart:
    """Points of one sequence; it keeps the place that it reached, for one thread.

    Args:
        dimension: Numbers of a point.
        random: Makes the generator that scrambles the sequence, always the same.
        points: Points that may be asked for.
    """

    def __init__(
        self, dimension: int, random: Callable[[], np.random.Generator], points: int
    ) -> None:
        self.dimension, self.random = dimension, random
        self.bits = 30 if points <= _BITS_30 else 64
        self._engine: Any = None

    def between(self, start: int, stop: int) -> Float[np.ndarray, "k d"]:
        """Return the points from `start` to `stop` (not included); going back starts anew."""
        engine = self._engine
        if engine is None or engine.num_generated > start:
            engine = qmc.Sobol(  # pyright: ignore[reportCallIssue]
                self.dimension, scramble=True, bits=self.bits, rng=self.random()
            )
        while start > engine.num_generated:
            engine.fast_forward(min(start - engine.num_generated, _FORWARD))
        self._engine = engine
        with warnings.catch_warnings():  # that the first draw is not a power of two
            warnings.simplefilter("ignore", UserWarning)
            return engine.random(stop - start)
