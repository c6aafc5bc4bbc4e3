"""Which part of a force the readings determine, in numbers and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import chi2

from notchflex.sensing.bounds import Bounds
from notchflex.sensing.history import LINEAR
from notchflex.sensing.model import SensingModel
from notchflex.sensing.own_reading import OwnReading

# An interval this much wider than that of the noise alone is one that stuck friction leaves.
_STUCK = 1.5
# Components of a unit direction below this are not counted as part of it.
_PART = 0.05


@dataclass(frozen=True, eq=False)
class LeftOpen:
    """Unobservable directions of one reading.

    Attributes:
        covariance: Of the force by noise, to first order, N². Along a direction that hardly changes
            what is read, the interval bounds it; where nothing does, it is the range of the search.
        stuck: Components that friction hides within the interval, (d,).
        hidden: Directions that are not observable, unit rows, (k, d).
    """

    covariance: Float[np.ndarray, "d d"]
    stuck: Bool[np.ndarray, " d"]
    hidden: Float[np.ndarray, "k d"]

    @classmethod
    def of(cls, model: SensingModel, reading: OwnReading, ends: Bounds, level: float) -> LeftOpen:
        """Return what a reading leaves open.

        Around the best force a direction may change nothing for two reasons: the readings do not
        depend on it, or the tendons stick. Only the first leaves the interval without an end.
        """
        number, factor = reading.number, float(np.sqrt(chi2.ppf(level, 1)))
        half = 0.5 * (ends.high[number] - ends.low[number])
        directions, spreads = _spreads(reading.information)
        far = spreads > LINEAR * model.largest
        keeps = np.eye(model.size) - directions[far].T @ directions[far]
        of_mean, more = keeps @ reading.gain, keeps @ reading.more
        noise, beyond = of_mean @ of_mean.T, more @ more.T
        stuck, hidden, open_ = np.zeros(model.size, bool), [], np.zeros_like(noise)
        for row, spread in zip(directions[far], spreads[far], strict=True):
            part = np.abs(row) > _PART
            interval = float(np.abs(row) @ half) / factor
            if spread > model.largest and (ends.limited[number] & part).any():
                width = model.largest
                hidden.append(row)
            elif spread > min(model.largest, _STUCK * interval):
                width = interval
                stuck |= part
            else:  # far, but by noise alone
                width = spread
            open_ += width**2 * np.outer(row, row)
        own = noise + beyond + open_
        wide = half > _STUCK * factor * np.sqrt(np.diagonal(own))
        rows = np.array(hidden).reshape(-1, model.size)
        # Where noise explains the distance from the mean, the estimate is the mean.
        covariance = noise + reading.part * beyond + open_
        return cls(covariance, stuck | (wide & ~ends.limited[number]), rows)


def _spreads(
    slopes: Float[np.ndarray, "m d"],
) -> tuple[Float[np.ndarray, "d d"], Float[np.ndarray, " d"]]:
    """Return directions as unit rows, and the standard deviation of the force by noise along each.

    It is infinite where nothing that is read depends on the force.
    """
    _, values, rows = np.linalg.svd(slopes.reshape(-1, slopes.shape[1]))
    values = np.concatenate([values, np.zeros(len(rows) - len(values))])
    spreads = np.full(len(rows), np.inf)
    np.divide(1.0, values, out=spreads, where=values > 0.0)
    # One sign of each: the largest entry is positive.
    signs = np.sign(rows[np.arange(len(rows)), np.abs(rows).argmax(axis=1)])
    return rows * signs[:, None], spreads


def direction_in_words(names: Sequence[str], direction: Float[np.ndarray, " d"]) -> str:
    """Describe a direction by its components.

    Example:
        >>> direction_in_words(("x", "z"), np.array([0.0, 1.0]))
        'z'
        >>> direction_in_words(("x", "z"), np.array([-0.6, 0.8]))
        '-0.60 x + 0.80 z'
    """
    parts = [(part, name) for part, name in zip(direction, names, strict=True) if abs(part) > _PART]
    if len(parts) == 1:
        return parts[0][1]
    text = " + ".join(f"{part:.2f} {name}" for part, name in parts)
    return text.replace("+ -", "- ")
