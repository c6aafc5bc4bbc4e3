"""Wishes as the rows of an optimisation: terms of the objective, constraints with their limits."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from notchflex.designing.model.reading import Reading, pairs, taken
from notchflex.designing.model.wishes import Source, Wish
from notchflex.designing.specification.asked import DesignConstraint, DesignObjective

# A number is at its limit, or within it, up to this part of its size.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Row:
    """One constraint on one number.

    Attributes:
        wish: The wish that it comes from.
        label: Which number of it, "" for the only one.
        lower: Least value, -inf for none.
        upper: Greatest value, inf for none.
    """

    wish: Wish
    label: str
    lower: float
    upper: float

    @property
    def title(self) -> str:
        """Name in messages."""
        return f"{self.wish.title}, {self.label}" if self.label else self.wish.title

    @property
    def is_equality(self) -> bool:
        """Whether it must have one value."""
        return self.lower == self.upper


def limits(asked: DesignConstraint) -> tuple[float, float]:
    """Return least and greatest value of a constraint, for steps from notch to notch if ordered."""
    if asked.order is not None:
        return (-np.inf, -asked.margin) if asked.order == "tip-first" else (asked.margin, np.inf)
    if asked.equal is not None:
        return asked.equal, asked.equal
    return (
        -np.inf if asked.lower is None else asked.lower,
        np.inf if asked.upper is None else asked.upper,
    )


def searched(wish: Wish) -> str:
    """Return how the search takes a constraint: of each number, where that asks for the same."""
    asked = wish.asked
    assert isinstance(asked, DesignConstraint)
    low, high = limits(asked)
    if (wish.take == "largest" and low == -np.inf) or (wish.take == "smallest" and high == np.inf):
        return "each"
    if wish.take == "range" and low <= 0.0 and high > 0.0:
        return "pairs"
    return "steps" if wish.take == "range" and low <= 0.0 else wish.take


def rows_of(wish: Wish) -> list[Row]:
    """Return the rows of a constraint as the search takes it, in the order of `row_reading`."""
    asked = wish.asked
    assert isinstance(asked, DesignConstraint)
    low, high = limits(asked)
    take, parts = searched(wish), wish.parts
    if take == "pairs":
        labels = [f"{a} less {b}" for a in parts for b in parts if a != b]
        return [Row(wish, label, -np.inf, high) for label in labels]
    if take == "each":
        return [Row(wish, part if len(parts) > 1 else "", low, high) for part in parts]
    if take == "steps":
        names = itertools.pairwise(parts)
        low = 0.0 if wish.take == "range" else low
        return [Row(wish, f"{a} to {b.split()[-1]}", low, high) for a, b in names]
    return [Row(wish, "", low, high)]


def row_reading(wish: Wish, source: Source) -> Reading:
    """Return the numbers of the rows of a constraint."""
    every, take = wish.every(source), searched(wish)
    return every.map(pairs(len(every.values))) if take == "pairs" else taken(every, take)


def squared(wish: Wish, source: Source) -> Reading:
    """Return the numbers whose squares an objective adds up: distances from a target or curve."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is None:  # the mean square, which is smooth where it is 0
        every = wish.every(source) if wish.curve is None else source.offsets(wish.curve)
        return every.scaled(float(np.sqrt(asked.weight / len(wish.rows))))
    reading = taken(wish.every(source), wish.take)
    return Reading(reading.values - asked.target, reading.slopes).scaled(
        float(np.sqrt(asked.weight))
    )


def objective_reading(wish: Wish, source: Source) -> Reading:
    """Return what an objective adds to the sum that is minimised, in the units of the user."""
    asked = wish.asked
    assert isinstance(asked, DesignObjective)
    if asked.target is not None or (wish.take == "rms" and asked.goal == "minimise"):
        off = squared(wish, source)
        by = None if off.slopes is None else 2.0 * off.values[None] @ off.slopes
        return Reading(np.array([float(off.values @ off.values)]), by)
    sign = asked.weight * (1.0 if asked.goal == "minimise" else -1.0)
    # Several numbers that each count are added up.
    take = "sum" if wish.take == "each" else wish.take
    return taken(wish.every(source), take).scaled(sign)


def violations(
    rows: Sequence[Row], values: Float[np.ndarray, " k"], sizes: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Return by how much numbers are beyond their limits, signed, in their sizes."""
    low = np.array([one.lower for one in rows])
    high = np.array([one.upper for one in rows])
    return (np.maximum(values - high, 0.0) - np.maximum(low - values, 0.0)) / sizes


def row_sizes(
    rows: Sequence[Row], reached: Float[np.ndarray, " k"] | None = None
) -> Float[np.ndarray, " k"]:
    """Return the sizes by which violations count: those of the limits, or of what is reached."""
    sizes = [_size(one) for one in rows]
    scales = np.array(sizes, float)
    other = np.abs(reached) if reached is not None else np.zeros(len(rows))
    return np.where(scales > 0.0, scales, np.where(other > 1e-9, other, 1.0))


def _size(row: Row) -> float:
    finite = [abs(one) for one in (row.lower, row.upper) if np.isfinite(one)]
    return max(finite, default=0.0)


def epigraphs(wish: Wish) -> Iterator[tuple[str, float]]:
    """Yield epigraph bounds for the largest or smallest of several numbers in an objective.

    Each is "above" or "below" all numbers, with its factor in the sum that is minimised.
    """
    asked = wish.asked
    if not isinstance(asked, DesignObjective) or asked.target is not None or len(wish.rows) < 2:
        return
    least = asked.goal == "minimise"
    if wish.take == "largest" and least:
        yield "above", asked.weight
    if wish.take == "smallest" and not least:
        yield "below", -asked.weight
    if wish.take == "range" and least:
        yield "above", asked.weight
        yield "below", -asked.weight
