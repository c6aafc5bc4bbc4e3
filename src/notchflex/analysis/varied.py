"""Chains of robots that differ by a few numbers, without assembling each robot.

`fit_polynomial` constructs them.

Along each variable Leja points are added until they change nothing; the decay of these changes
selects the products of powers (Gerstner and Griebel 2003, with the changes along
one variable in place of a search). Terms whose variables never act together are left out. The
error is measured at points that are not among the nodes.

Assembling a chain in Python takes a hundred times as long as solving it. The arrays of a chain are
smooth functions of the numbers of the robot file, so they are assembled exactly at some nodes and
interpolated by a polynomial, whose error is measured (`TOLERANCES`). The solution itself has no
further error. Where no polynomial is accurate enough, every robot is assembled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import jax
from notchflex.analysis.solve import prepare_for
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.command import Command, make_commands
from notchflex.mechanics.chain import Chain, stiffened
from notchflex.robot import Robot
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.static_structure import PytreeLayout, StaticStructure

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


TOLERANCES = (1e-5, 1e-9)
"""Allowed errors of an entry, relative to its size or, if larger, 1 % of that of its array.

The second is required where it takes no more robots than a batch has, or other batches follow.
"""

_FLOOR = 1e-2
_FIBRES = 1e2
"""Factor on the allowed errors of single fibres, the nodes of a quadrature. Results stay accurate:
7e-6 where the fibres of a wrist had an error of 5e-4."""

_CHECKS = 8
_MAX_NODES = 4000
_MIN_ROBOTS = 256


class _Form(NamedTuple):
    """Layout of a chain and its commands in one vector."""

    chain: PytreeLayout
    command: PytreeLayout
    steps: int

    @property
    def parts(self) -> list[np.ndarray]:
        """Indices of the arrays of the chain, and last of the commands."""
        own = [part.ravel() for part in self.chain.indices if part.size]
        return [*own, self.chain.size + np.arange(self.steps * self.command.size)]


class _AnotherFormError(Exception):
    """A robot with other numbers has a chain of another form, or is none."""


@dataclass(frozen=True, eq=False)
class VariedChains:
    """Chains and commands of varied robots, as the rows of a batch.

    Attributes:
        numbers: The numbers of every robot that the polynomial is of.
        stiffness_factor: Factor on the stiffness of each notch of every robot.
        ready: The chain of the robot that is varied.
        polynomial: Chain and commands from the numbers, where no notch has a factor.
        structure: Layout of chains for programs.
        command: Layout of one load.
        steps: Loads of each robot.
        turn: Rotation from the base to the world; None for the identity.
    """

    numbers: Float[np.ndarray, "robots d"]
    stiffness_factor: Float[np.ndarray, "robots n"]
    ready: PreparedChain
    polynomial: SparsePolynomial
    structure: StaticStructure
    command: PytreeLayout
    steps: int
    turn: Float[np.ndarray, "3 3"] | None

    def of(self, robots: VariedRobots) -> VariedChains | None:
        """Return the chains of other robots by the same names; None beyond the polynomial."""
        factor, robots = _without_factors(robots)
        if not self.polynomial.covers(robots.table):
            return None
        return replace(self, numbers=robots.table, stiffness_factor=factor)

    def rows(
        self, index: slice
    ) -> tuple[Float[np.ndarray, "k chain"], Float[np.ndarray, "k s command"]]:
        """Return chains and commands of some of the robots, packed for programs."""
        values = self.polynomial.varied(self.numbers[index])
        size = self.ready.chain_layout.size
        in_chain = self.polynomial.entries < size
        chain, load = np.split(self.polynomial.base, [size])
        chains, commands = (np.tile(one, (values.shape[1], 1)) for one in (chain, load))
        chains[:, self.polynomial.entries[in_chain]] = values[in_chain].T
        layout = self.ready.chain_layout
        stiff = stiffened(layout.unpack(chains), self.stiffness_factor[index])
        chains = self.structure.pack(layout.pack(stiff, leading=1))
        commands[:, self.polynomial.entries[~in_chain] - size] = values[~in_chain].T
        return chains, commands.reshape(len(chains), self.steps, self.command.size)


def varied_chains(robots: VariedRobots, load: LoadPath, refinement: int) -> VariedChains | None:
    """Find polynomials for the chains of varied robots under one path of loads.

    Args:
        robots: The robots, all of them valid.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The chains; None where each robot must be assembled by itself.
    """
    # A factor multiplies all that the other numbers make of a notch: in a polynomial it would
    # multiply the number of terms.
    factor, robots = _without_factors(robots)
    ready = prepare_for(robots.robot, load, None, refinement)
    commands = make_commands(load, robots.robot, ready.chain)
    form = _Form(ready.chain_layout, ready.command_layout(commands), len(load))
    ends = (tuple(one.tolist()) for one in robots.box)
    polynomial = _fitted(robots.robot, robots.names, *ends, load, refinement, _accuracies(robots))
    if polynomial is None:
        return None
    structure, varies = ready.static_structure, polynomial.base.copy()
    varies[polynomial.entries] = np.nan
    if not structure.fits(varies[None, : form.chain.size]):
        return None
    of_form = structure, form.command, form.steps
    return VariedChains(robots.table, factor, ready, polynomial, *of_form, load.base_to_world)


_FACTOR = "stiffness_factor"


def _without_factors(robots: VariedRobots) -> tuple[Float[np.ndarray, "k n"], VariedRobots]:
    """Return the factor on the stiffness of each notch, and the robots without these factors."""
    own, others = [one.stiffness_factor for one in robots.robot.notches], dict(robots.values)
    factor = np.tile(own, (len(robots), 1))
    for notch, name in zip(robots.notch_of, robots.names, strict=True):
        if name.endswith(_FACTOR):
            notches = slice(None) if notch is None else slice(notch - 1, notch)
            factor[:, notches] = others.pop(name)[:, None]
    if not others:
        return np.ones_like(factor), robots
    robot = robots.robot.with_value(f"notch.{_FACTOR}", 1.0)
    return factor, VariedRobots(robot, others, robots.ranges)


@lru_cache(maxsize=8)
def _fitted(
    robot: Robot,
    names: tuple[str, ...],
    low: Sequence[float],
    high: Sequence[float],
    load: LoadPath,
    refinement: int,
    accuracies: tuple[PolynomialAccuracy, ...],
) -> SparsePolynomial | None:
    """Fit chain and commands between the ends of numbers; of the arguments alone, and cached.

    A tolerance analysis asks for the same polynomial ten times.
    """
    box = VariedRobots(robot, dict(zip(names, zip(low, high, strict=True), strict=True)))

    def vector_of(numbers: Float[np.ndarray, " d"]) -> Float[np.ndarray, " m"]:
        try:
            robot = box.at(dict(zip(names, numbers, strict=True)))
            ready = prepare_for(robot, load, None, refinement)
            commands = make_commands(load, robot, ready.chain)
        except InputError:
            raise _AnotherFormError from None
        if ready.chain_layout is not form.chain:
            raise _AnotherFormError
        vector = packed(ready, commands)
        if not np.array_equal(vector[infinite], reference[infinite]):
            raise _AnotherFormError
        return np.where(infinite | weightless, 0.0, vector)

    def packed(ready: PreparedChain, commands: Command) -> Float[np.ndarray, " m"]:
        loads = form.command.pack(commands, leading=1).ravel()
        return np.concatenate([ready.vector, loads])

    # An inextensible tendon, for example, has infinite stiffness, whatever else varies.
    own = prepare_for(robot, load, None, refinement)
    commands = make_commands(load, robot, own.chain)
    form = _Form(own.chain_layout, own.command_layout(commands), len(load))
    reference = packed(own, commands)
    infinite = ~np.isfinite(reference)
    weightless = np.zeros(len(reference), bool)
    if not any(one.gravity is not None for one in load.different):  # masses are of no effect
        positions: Chain = jax.tree.unflatten(form.chain.structure, form.chain.indices)
        weightless[np.append(positions.body_mass, positions.body_centre)] = True
    middle, half = 0.5 * np.add(high, low), 0.5 * np.subtract(high, low)
    half = np.maximum(half, 1e-9 * np.maximum(np.abs(middle), 1e-3))
    checks = np.random.default_rng(0).uniform(middle - half, middle + half, (_CHECKS, len(names)))
    try:
        result = fit_polynomial(
            vector_of,
            middle - half,
            middle + half,
            list(box.cliques()),
            lambda sizes: _scale(sizes, form),
            form.parts,
            accuracies=accuracies,
            checks=checks,
        )
    except _AnotherFormError:
        return None
    if result is None:
        return None
    return result._replace(base=np.where(infinite | weightless, reference, result.base))


def _accuracies(robots: VariedRobots) -> tuple[PolynomialAccuracy, ...]:
    """Return the accuracies, with at most as many nodes as robots unless other batches follow."""
    count = len(robots)
    follows = robots.ranges is not None and count >= _MIN_ROBOTS
    usual, fine = TOLERANCES
    return (
        PolynomialAccuracy(usual, _MAX_NODES if follows else min(_MAX_NODES, count // 2)),
        PolynomialAccuracy(fine, _MAX_NODES if follows else min(_MAX_NODES, count)),
    )


def _scale(sizes: Float[np.ndarray, " m"], form: _Form) -> Float[np.ndarray, " m"]:
    """Return the size of every entry, and at least a small part of the largest of its array."""
    scale = np.array(sizes)
    for part in form.parts:
        own = sizes[part]
        finite = own[np.isfinite(own)]
        scale[part] = np.maximum(own, _FLOOR * max(finite.max(initial=0.0), 1e-12))
    positions: Chain = jax.tree.unflatten(form.chain.structure, form.chain.indices)
    for part in jax.tree.leaves(positions.rods.section.fibres):
        scale[part] *= _FIBRES
    return np.where(np.isfinite(scale), scale, 1.0)
