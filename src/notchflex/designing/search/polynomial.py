"""Polynomials from several numbers to several values, found to a tolerance that is measured.

Along each variable Leja points are added until they change nothing; the decay of these changes
selects the products of powers (Gerstner and Griebel 2003, with the changes along
one variable in place of a search). Terms whose variables never act together are left out. The
error is measured at points that are not among the nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
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
        error: Largest measured error, relative to the scale.
    """

    middle: Float[np.ndarray, " d"]
    half: Float[np.ndarray, " d"]
    terms: Terms
    blocks: Sequence[CoefficientBlock]
    entries: Int[np.ndarray, " v"]
    which: Int[np.ndarray, " v"]
    base: Float[np.ndarray, " m"]
    error: float = np.inf

    def covers(self, numbers: Float[np.ndarray, "rows d"]) -> bool:
        """Return whether numbers lie in the range of the polynomial."""
        return bool((np.abs(numbers - self.middle) <= self.half * (1.0 + 1e-12)).all())

    def varied(self, numbers: Float[np.ndarray, "rows d"]) -> Float[np.ndarray, "v rows"]:
        """Return the entries that vary, at rows of numbers."""
        terms = self.terms.at((numbers - self.middle) / self.half)
        values = [one.coefficients @ terms[one.terms] for one in self.blocks]
        return np.concatenate([np.zeros((0, len(numbers))), *values])[self.which]


_CUT = 1e-3  # cutoff of coefficients, relative to the allowed error
_AIM = 0.3  # initial cutoff of terms, likewise
_ROUNDS = 6  # refinements of parts that are not accurate enough
VectorOf = Callable[[Float[np.ndarray, " d"]], Float[np.ndarray, " m"]]


class PolynomialAccuracy(NamedTuple):
    """Required accuracy of a polynomial, and the limit on its cost.

    Attributes:
        tolerance: Largest error, relative to the scale.
        max_evaluations: Largest number of exact vectors that may be evaluated.
    """

    tolerance: float
    max_evaluations: int


def fit_polynomial(
    vector_of: VectorOf,
    low: Float[np.ndarray, " d"],
    high: Float[np.ndarray, " d"],
    cliques: Iterable[Sequence[int]],
    scale_of: VectorOf,
    parts: Sequence[Int[np.ndarray, ...]],
    *,
    accuracies: Sequence[PolynomialAccuracy],
    checks: Float[np.ndarray, "k d"],
) -> SparsePolynomial | None:
    """Find a polynomial within a tolerance.

    Args:
        vector_of: The exact vector at numbers.
        low: Lower ends of the ranges.
        high: Upper ends, above the lower ones.
        cliques: Indices of variables that act together.
        scale_of: Scale of errors, from the largest size of every entry.
        parts: Groups of entries with similar dependence on the numbers; products of powers are
            selected for each.
        accuracies: Allowed errors, the largest first, which must be met. A smaller one is met
            within its limit of evaluations.
        checks: Numbers at which the error is measured.

    Returns:
        The polynomial; None where the first accuracy is not met within its limit of evaluations.
    """
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    exact_vectors: dict[tuple[int, ...], np.ndarray] = {}

    def at(index: tuple[int, ...]) -> np.ndarray:
        if index not in exact_vectors:
            exact_vectors[index] = vector_of(middle + half * leja_points()[list(index)])
        return exact_vectors[index]

    count = len(middle)
    scale = scale_of(np.abs(at((0,) * count)))

    cliques = list(cliques)

    def indices_for(
        aims: Float[np.ndarray, " parts"], max_evaluations: int
    ) -> list[tuple[int, ...]] | None:
        """Select products of powers; None if they are too many."""
        changes: list[np.ndarray] = []
        for variable in range(count):
            changes_of_variable = _changes(at, variable, count, scale, parts, aims)
            if changes_of_variable is None or len(exact_vectors) > max_evaluations:
                return None
            changes.append(changes_of_variable)
        return _indices(changes, cliques, aims, max_evaluations)

    exact = np.stack([vector_of(one) for one in checks])
    accepted: SparsePolynomial | None = None
    for tolerance, max_evaluations in accuracies:
        aims = np.full(len(parts), _AIM * tolerance)
        for _ in range(_ROUNDS):
            indices = indices_for(aims, max_evaluations)
            if indices is None:
                return accepted
            terms = Terms.of(indices)
            for index in sorted(indices):  # the last variables first: what is left stays the same
                at(index)
            values = np.stack([at(tuple(index)) for index in terms.powers.tolist()])
            nodes = np.stack(list(exact_vectors.values()))
            polynomial = _solved(middle, half, terms, values, nodes, _CUT * tolerance * scale)
            error = _errors(polynomial, exact, checks, scale)
            of_parts = np.array([np.max(error[part], initial=0.0) for part in parts])
            if of_parts.max() <= accuracies[0].tolerance:
                accepted = polynomial._replace(error=float(of_parts.max()))
            wrong = of_parts > tolerance
            if not wrong.any():
                break
            aims = np.where(wrong, 0.1 * aims, aims)
    return accepted


def _changes(
    at: Callable[[tuple[int, ...]], np.ndarray],
    variable: int,
    count: int,
    scale: np.ndarray,
    parts: Sequence[np.ndarray],
    aims: Float[np.ndarray, " parts"],
) -> Float[np.ndarray, "parts degrees"] | None:
    """Compute the change of each part by further points along a variable, over the scale."""
    points = leja_points()
    values: list[np.ndarray] = []
    sizes: list[np.ndarray] = []
    for degree in range(DEGREE + 1):
        index = [0] * count
        index[variable] = degree
        value = at(tuple(index))
        if degree:
            basis = Terms.of([(power,) for power in range(degree)]).at(points[: degree + 1, None])
            before = basis[:, degree] @ np.linalg.solve(basis[:, :degree].T, np.stack(values))
            change = np.abs(value - before) / scale
            sizes.append(np.array([np.max(change[part], initial=0.0) for part in parts]))
        values.append(value)
        if degree > 1 and (np.maximum(sizes[-1], sizes[-2]) < 0.1 * aims).all():
            kept = np.stack([np.ones(len(parts)), *sizes[:-2]], axis=-1)
            # None smaller than a later one, so that no term comes without those that divide it.
            return np.minimum(np.maximum.accumulate(kept[:, ::-1], axis=1)[:, ::-1], 1.0)
    return None


def _indices(
    changes: Sequence[Float[np.ndarray, "parts degrees"]],
    cliques: Iterable[Sequence[int]],
    aims: Float[np.ndarray, " parts"],
    max_evaluations: int,
) -> list[tuple[int, ...]] | None:
    """Select products of powers, each with all its divisors; None if too many."""
    indices: dict[tuple[int, ...], None] = {(0,) * len(changes): None}
    for clique in cliques:
        for part in range(len(changes[0])):
            partial = [(next(iter(indices)), 1.0)]
            for variable in clique:
                further = changes[variable][part, 1:]
                partial += [
                    ((*powers[:variable], degree, *powers[variable + 1 :]), size * float(own))
                    for powers, size in partial
                    for degree, own in enumerate(further, start=1)
                    if size * own >= aims[part]
                ]
                if len(partial) > max_evaluations:
                    return None
            indices |= dict.fromkeys(powers for powers, _ in partial)
    return list(indices) if len(indices) <= max_evaluations else None


def _solved(
    middle: np.ndarray,
    half: np.ndarray,
    terms: Terms,
    values: Float[np.ndarray, "terms m"],
    nodes: Float[np.ndarray, "points m"],
    cutoff: Float[np.ndarray, " m"],
) -> SparsePolynomial:
    base = values[0]
    entries = np.flatnonzero((nodes != base).any(axis=0))
    columns, first, which = np.unique(
        values[:, entries], axis=1, return_index=True, return_inverse=True
    )
    basis = terms.at(leja_points()[terms.powers])
    coefficients = np.linalg.solve(basis.T, columns).T
    coefficients[np.abs(coefficients) < cutoff[entries[first], None]] = 0.0
    # Variables on which each of the distinct entries depends.
    of_variables = (coefficients != 0.0) @ (terms.powers > 0) > 0
    _, block_of = np.unique(of_variables, axis=0, return_inverse=True)
    block_of = block_of.ravel()
    order = np.argsort(block_of, kind="stable")
    position = np.argsort(order)
    blocks: list[CoefficientBlock] = []
    for block in range(block_of.max(initial=-1) + 1):
        own = coefficients[block_of == block]
        used = np.flatnonzero((own != 0.0).any(axis=0))
        blocks.append(CoefficientBlock(used, np.ascontiguousarray(own[:, used])))
    return SparsePolynomial(middle, half, terms, blocks, entries, position[which.ravel()], base)


def _errors(
    polynomial: SparsePolynomial,
    exact: Float[np.ndarray, "k m"],
    checks: Float[np.ndarray, "k d"],
    scale: np.ndarray,
) -> Float[np.ndarray, " m"]:
    """Compute the largest error of each entry at points other than the nodes, over the scale."""
    approximate = np.tile(polynomial.base, (len(checks), 1))
    approximate[:, polynomial.entries] = polynomial.varied(checks).T
    return np.max(np.abs(approximate - exact) / scale, axis=0)
