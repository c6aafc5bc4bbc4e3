"""Worst case and root sum of squares of small tolerances, by exact gradients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex.analysis.draws import ToleranceSource, deviation, moments
from notchflex.support import Tolerance
from notchflex.tolerancing.study import Study

WORST_SD = 3.0
"""Number of standard deviations in the worst case of an untruncated normal distribution."""


_Deviation = Callable[[Tolerance, float], float]


class LinearEffects(NamedTuple):
    """Effect of small tolerances on the numbers that have limits, for each source.

    Attributes:
        nominal: The numbers of the drawing, (k,).
        shift: Change of each number by the mean of each source, (k, d).
        spread: Change by one standard deviation of each source, with its sign, (k, d).
        low: Change by the worse end of each source toward smaller values, (k, d), not positive.
        high: The same toward larger values, not negative.
    """

    nominal: Float[np.ndarray, " k"]
    shift: Float[np.ndarray, "k d"]
    spread: Float[np.ndarray, "k d"]
    low: Float[np.ndarray, "k d"]
    high: Float[np.ndarray, "k d"]

    @property
    def worst_case(self) -> Float[np.ndarray, "k 2"]:
        """Smallest and largest value: all sources at their worse ends at once."""
        both = [self.nominal + one.sum(axis=1) for one in (self.low, self.high)]
        return np.stack(both, axis=-1)

    @property
    def mean(self) -> Float[np.ndarray, " k"]:
        """Mean of the robots."""
        return self.nominal + self.shift.sum(axis=1)

    @property
    def sd(self) -> Float[np.ndarray, " k"]:
        """Standard deviation of the robots: the root of the sum of squares."""
        return np.sqrt((self.spread**2).sum(axis=1))

    @property
    def share(self) -> Float[np.ndarray, "k d"]:
        """Part of each source in the variance of each number; 0 where nothing varies."""
        total = (self.spread**2).sum(axis=1, keepdims=True)
        return np.divide(self.spread**2, total, out=np.zeros_like(self.spread), where=total > 0.0)


def linear_effects(study: Study) -> LinearEffects:
    """Differentiate the numbers that have limits by all that deviates.

    Derivatives are those of the solved path, through the memory of the contacts; where a notch is
    about to close or a contact to slip they are of one side.
    """
    names = list(dict.fromkeys(name for one in study.sources for name in one.nominal))
    slopes = np.empty((len(study.criteria), len(names)))
    for load, path in study.loads.items():
        own = [index for index, one in enumerate(study.criteria) if one.load == load]
        outputs = tuple(dict.fromkeys(study.criteria[index].quantity.name for index in own))
        effects = study.paths[load][: len(path)].jacobian(names, outputs)
        for index in own:
            criterion = study.criteria[index]
            by_name = np.moveaxis(effects[criterion.quantity.name], -1, 0)
            slopes[index] = criterion.of(by_name)
    columns_of = {name: index for index, name in enumerate(names)}
    own_slopes = [slopes[:, [columns_of[name] for name in one.nominal]] for one in study.sources]
    shift, spread, one_end, other = (
        _moved(study.sources, own_slopes, which)
        for which in (
            lambda *one: moments(*one)[0],
            lambda *one: moments(*one)[1],
            partial(_end, -1.0),
            partial(_end, 1.0),
        )
    )
    nominal = [
        np.asarray(study.paths[one.load].quantity(one.quantity.name))[(one.step, *one.index)]
        for one in study.criteria
    ]
    low, high = np.minimum(one_end, other), np.maximum(one_end, other)
    return LinearEffects(
        np.array(nominal), shift, spread, np.minimum(low, 0.0), np.maximum(high, 0.0)
    )


def _moved(
    sources: Sequence[ToleranceSource],
    slopes: Sequence[Float[np.ndarray, "k names"]],
    which: _Deviation,
) -> Float[np.ndarray, "k d"]:
    """Change of every number where each source deviates: all values of a source move at once."""
    columns = [
        own @ np.array([which(source.tolerance, value) for value in source.nominal.values()])
        for source, own in zip(sources, slopes, strict=True)
    ]
    return np.stack(columns, axis=-1)


def _end(side: float, tolerance: Tolerance, value: float) -> float:
    """Return the least (side -1) or the greatest (1) deviation."""
    end = float(deviation(tolerance, value, 0.5 * (1.0 + side)))
    return end if np.isfinite(end) else side * WORST_SD * moments(tolerance, value)[1]
