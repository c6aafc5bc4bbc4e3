"""Error of the law of an arc notch with elastic ends, by the wrists of finite elements near it.

A wrist of finite elements has its angles at some factor on the stiffness of the law. Less 1, its
root mean square over the loads is the error of a notch there (benchmarks/fe/law_errors.py). That of
any notch is the mean of the squares around it, weighted by Gaussian functions of the distance.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex._arrays import cached


class Place(NamedTuple):
    """Where a notch stands among the wrists: lengths over the outer diameter, and 0 or 1."""

    wall: float
    depth: float
    height: float
    ring: float  # the shorter one beside it
    on_axis: bool
    yields: bool  # whether the material is one of fibres
    last: bool


# Widths of the Gaussian functions, rounded: what makes the residuals of wrists likeliest, each by
# the others. Height and ring count by their logarithms.
_WIDTHS = np.array([0.04, 0.08, 0.8, 0.3, 1.0, 1.0, 0.7])


@cache
def table() -> Float[np.ndarray, "rows 9"]:
    """Read the places of notches of wrists, their error and their largest residual."""
    text = (files("notchflex.mechanics") / "law_errors.csv").read_text(encoding="utf-8")
    return np.loadtxt(text.splitlines(), delimiter=",", skiprows=1)


def _coordinates(places: np.ndarray) -> np.ndarray:
    """Return places with logarithms of height and ring."""
    return np.concatenate([places[..., :2], np.log(places[..., 2:4]), places[..., 4:]], axis=-1)


def error_at(place: np.ndarray, rows: Float[np.ndarray, "rows 9"]) -> float:
    """Return the root mean square of the errors of rows around a place."""
    away = (_coordinates(rows[:, :7]) - _coordinates(place)) / _WIDTHS
    weights = np.exp(-0.5 * np.sum(away**2, axis=1))
    return float(np.sqrt(weights @ rows[:, 7] ** 2 / weights.sum()))


@cached(1024)
def law_error_at(place: Place) -> float:
    """Return the relative error (SD) of the stiffness of a notch, outside the table its border."""
    rows = table()
    return error_at(np.clip(place, rows[:, :7].min(axis=0), rows[:, :7].max(axis=0)), rows)


def covered(dimension: int, last: bool) -> tuple[float, float, float, float]:
    """Return the range of a dimension of last or of other notches; the largest residual near it.

    The residuals are those of all notches, near the lower and near the upper bound.
    """
    values, of_last = table()[:, dimension], table()[:, 6] == last
    low, high = float(values[of_last].min()), float(values[of_last].max())
    margin = 0.1 * (high - low)
    ends = (values < low + margin, values > high - margin)
    near_low, near_high = (float(table()[end, 8].max()) for end in ends)
    return low, high, near_low, near_high
