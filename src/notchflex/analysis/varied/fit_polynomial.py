"""Fit of a sparse polynomial to exact values of a vector, with a measured error.

Along each variable Leja points are added until they change nothing; the decay of these changes
selects the products of powers (Gerstner and Griebel 2003, with the changes along
one variable in place of a search). Terms whose variables never act together are left out. The
error is measured at points that are not among the nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from notchflex.analysis.varied.sparse_polynomial import (
    DEGREE,
    CoefficientBlock,
    SparsePolynomial,
    Terms,
    leja_points,
)

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
    return SparsePolynomial(
        middle, half, terms, blocks, entries, position[which.ravel()], base, nodes
    )


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
