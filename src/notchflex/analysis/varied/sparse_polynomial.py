r"""Sparse polynomials in several variables, in Newton's form at Leja points.

`fit_polynomial` constructs them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

DEGREE = 40


@lru_cache(maxsize=1)
def leja_points() -> Float[np.ndarray, " points"]:
    """Return Leja points from -1 to 1: each maximises the product of distances; the first is 0."""
    grid, points = np.linspace(-1.0, 1.0, 4001), [0.0]
    while len(points) <= DEGREE + 1:
        distance = np.prod(np.abs(grid[:, None] - np.array(points)), axis=1)
        points.append(float(grid[np.argmax(distance)]))
    return np.array(points)


class Terms(NamedTuple):
    """Products of Newton's polynomials through Leja points, each 1 at its own point.

    A term is a term before it times one more factor.

    Attributes:
        powers: Number of factors of every term for every variable, (terms, d); the first has none.
        before: Which term it is made of, (terms,).
        variable: The variable of its last factor, (terms,).
    """

    powers: Int[np.ndarray, "terms d"]
    before: Int[np.ndarray, " terms"]
    variable: Int[np.ndarray, " terms"]

    @classmethod
    def of(cls, indices: Iterable[tuple[int, ...]]) -> Terms:
        """Sort a set of powers that holds every power that divides another one."""
        ordered = sorted(indices, key=lambda index: (sum(index), index))
        position = {index: number for number, index in enumerate(ordered)}
        variable = [max(np.flatnonzero(index), default=0) for index in ordered]
        before = [0]
        for index, last in zip(ordered[1:], variable[1:], strict=True):
            fewer = list(index)
            fewer[last] -= 1
            before.append(position[tuple(fewer)])
        return cls(np.array(ordered), np.array(before), np.array(variable))

    def at(self, points: Float[np.ndarray, "rows d"]) -> Float[np.ndarray, "terms rows"]:
        """Return every term at points between -1 and 1."""
        leja = leja_points()
        max_powers = self.powers.max(axis=0, initial=0)
        factors = [
            (points[:, variable] - leja[:degree, None])
            / np.array([span(leja, k) for k in range(degree)])[:, None]
            for variable, degree in enumerate(max_powers)
        ]
        terms = np.ones((len(self.powers), len(points)))
        for term in range(1, len(terms)):
            variable = self.variable[term]
            factor = factors[variable][self.powers[term, variable] - 1]
            np.multiply(terms[self.before[term]], factor, out=terms[term])
        return terms


def span(leja: np.ndarray, degree: int) -> float:
    """Return the divisor of the factor of a degree that makes the product 1 at the next point."""
    above = np.prod(leja[degree + 1] - leja[: degree + 1])
    below = np.prod(leja[degree] - leja[:degree]) if degree else 1.0
    return float(above / below)


class CoefficientBlock(NamedTuple):
    """Entries that depend on the same numbers.

    Attributes:
        terms: Indices of the terms that any of them has.
        coefficients: Of these terms for every entry, (entries, terms).
    """

    terms: Int[np.ndarray, " t"]
    coefficients: Float[np.ndarray, "u t"]


class SparsePolynomial(NamedTuple):
    """A polynomial from several numbers to some entries of a vector; the others are constant.

    Attributes:
        middle: Middle of the range of every number.
        half: Half its range.
        terms: The products of powers.
        blocks: Distinct entries, grouped by the numbers that they depend on.
        entries: Indices in the vector of the entries that vary.
        which: Index of each of these among the distinct entries, block after block.
        base: The vector in the middle.
        nodes: Exact vectors at all points that were evaluated, (points, m).
        error: Largest measured error, relative to the scale.
    """

    middle: Float[np.ndarray, " d"]
    half: Float[np.ndarray, " d"]
    terms: Terms
    blocks: Sequence[CoefficientBlock]
    entries: Int[np.ndarray, " v"]
    which: Int[np.ndarray, " v"]
    base: Float[np.ndarray, " m"]
    nodes: Float[np.ndarray, "points m"]
    error: float = np.inf

    def covers(self, numbers: Float[np.ndarray, "rows d"]) -> bool:
        """Return whether numbers lie in the range of the polynomial."""
        return bool((np.abs(numbers - self.middle) <= self.half * (1.0 + 1e-12)).all())

    def varied(self, numbers: Float[np.ndarray, "rows d"]) -> Float[np.ndarray, "v rows"]:
        """Return the entries that vary, at rows of numbers."""
        terms = self.terms.at((numbers - self.middle) / self.half)
        values = [one.coefficients @ terms[one.terms] for one in self.blocks]
        return np.concatenate([np.zeros((0, len(numbers))), *values])[self.which]
