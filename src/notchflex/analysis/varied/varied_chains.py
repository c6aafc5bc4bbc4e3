"""Chains of robots that differ by a few numbers, without assembling each robot.

Assembling a chain in Python takes a hundred times as long as solving it. The arrays of a chain are
smooth functions of the numbers of the robot file, so they are assembled exactly at some nodes and
interpolated by a polynomial, whose error is measured (`TOLERANCES`). The solution itself has no
further error. Where no polynomial is accurate enough, every robot is assembled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from notchflex._jax import jax
from notchflex.analysis.solve import prepare_for
from notchflex.analysis.varied.fit_polynomial import PolynomialAccuracy, fit_polynomial
from notchflex.analysis.varied.sparse_polynomial import SparsePolynomial
from notchflex.errors import InputError
from notchflex.loads import LoadPath
from notchflex.loads.command import Command, make_commands
from notchflex.mechanics.chain import Chain
from notchflex.robot import Robot
from notchflex.robot.value_names.varied import VariedRobots
from notchflex.solver.programs.prepare import PreparedChain
from notchflex.solver.programs.pytree_layout import PytreeLayout
from notchflex.solver.programs.static_structure import StaticStructure

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
        numbers: The numbers of every robot.
        ready: The chain of the robot that is varied.
        polynomial: Chain and commands from the numbers.
        structure: Layout of chains for programs.
        command: Layout of one load.
        steps: Loads of each robot.
    """

    numbers: Float[np.ndarray, "robots d"]
    ready: PreparedChain
    polynomial: SparsePolynomial
    structure: StaticStructure
    command: PytreeLayout
    steps: int

    def rows(
        self, index: slice
    ) -> tuple[Float[np.ndarray, "k chain"], Float[np.ndarray, "k s command"]]:
        """Return chains and commands of some of the robots, packed for programs."""
        values = self.polynomial.varied(self.numbers[index])
        size = self.ready.chain_layout.size
        in_chain = self.polynomial.entries < size
        chain, load = np.split(self.polynomial.base, [size])
        chains = np.tile(self.structure.pack(chain), (values.shape[1], 1))
        positions = self.structure.indices_of(self.polynomial.entries[in_chain])
        moves = positions < self.structure.size - 1  # else compiled in, the same for all nodes
        chains[:, positions[moves]] = values[in_chain][moves].T
        commands = np.tile(load, (values.shape[1], 1))
        commands[:, self.polynomial.entries[~in_chain] - size] = values[~in_chain].T
        return chains, commands.reshape(len(chains), self.steps, self.command.size)


def varied_chains(
    robots: VariedRobots, load: LoadPath, refinement: int, *, reuse: bool = True
) -> VariedChains | None:
    """Find polynomials for the chains of varied robots under one path of loads.

    Args:
        robots: The robots, all of them valid.
        load: The loads of every robot.
        refinement: More strain modes, as for `simulate`.
        reuse: Whether polynomials of earlier calls may be reused; if not, the chains depend on the
            arguments alone.

    Returns:
        The chains; None where each robot must be assembled by itself.
    """
    table = robots.table
    ready = prepare_for(robots.robot, load, None, refinement)
    commands = make_commands(load, robots.robot, ready.chain)
    form = _Form(ready.chain_layout, ready.command_layout(commands), len(load))
    key = np.concatenate([form.command.pack(commands, leading=1).ravel(), [refinement]]).tobytes()
    earlier = _cached_polynomials(robots.robot, robots.names, form.chain, key) if reuse else []
    accuracies = _accuracies(robots)
    result = next((one for one in earlier if one.serves(table, accuracies[-1])), None)
    if result is None:
        polynomial = _fitted(robots, load, refinement, form, accuracies)
        if polynomial is None:
            return None
        result = _CachedPolynomial(polynomial, accuracies[-1].max_evaluations)
        earlier.append(result)
    polynomial = result.polynomial
    nodes = polynomial.nodes[:, : form.chain.size]
    structure = StaticStructure.of(form.chain, [ready.chain], nodes)
    return VariedChains(table, ready, polynomial, structure, form.command, form.steps)


class _CachedPolynomial(NamedTuple):
    """A polynomial of an earlier call.

    Attributes:
        polynomial: The polynomial.
        max_evaluations: Limit of robots assembled for it.
    """

    polynomial: SparsePolynomial
    max_evaluations: int

    def serves(self, table: Float[np.ndarray, "robots d"], accuracies: PolynomialAccuracy) -> bool:
        """Return whether it is accurate enough and covers the numbers of a table."""
        accurate = (
            self.polynomial.error <= accuracies.tolerance
            or self.max_evaluations >= accuracies.max_evaluations
        )
        return accurate and self.polynomial.covers(table)


@lru_cache(maxsize=8)
def _cached_polynomials(*key: Any) -> list[_CachedPolynomial]:
    """Return the cached polynomials for a robot, names and loads."""
    del key
    return []


def _fitted(
    robots: VariedRobots,
    load: LoadPath,
    refinement: int,
    form: _Form,
    accuracies: Sequence[PolynomialAccuracy],
) -> SparsePolynomial | None:
    names, table = robots.names, robots.table

    def vector_of(numbers: Float[np.ndarray, " d"]) -> Float[np.ndarray, " m"]:
        try:
            robot: Robot = robots.at(dict(zip(names, numbers, strict=True)))
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
    own = prepare_for(robots.robot, load, None, refinement)
    reference = packed(own, make_commands(load, robots.robot, own.chain))
    infinite = ~np.isfinite(reference)
    weightless = np.zeros(len(reference), bool)
    if not any(one.gravity is not None for one in load.different):  # masses are of no effect
        positions: Chain = jax.tree.unflatten(form.chain.structure, form.chain.indices)
        weightless[np.append(positions.body_mass, positions.body_centre)] = True
    low, high = robots.box
    middle = 0.5 * (low + high)
    half = np.maximum(0.5 * (high - low), 1e-9 * np.maximum(np.abs(middle), 1e-3))
    rows = np.linspace(0, len(table) - 1, _CHECKS).astype(int)
    try:
        result = fit_polynomial(
            vector_of,
            middle - half,
            middle + half,
            list(robots.cliques()),
            lambda sizes: _scale(sizes, form),
            form.parts,
            accuracies=accuracies,
            checks=table[rows],
        )
    except _AnotherFormError:
        return None
    if result is None:
        return None
    base, nodes = (
        np.where(infinite | weightless, reference, one) for one in (result.base, result.nodes)
    )
    return result._replace(base=base, nodes=nodes)


def _accuracies(robots: VariedRobots) -> list[PolynomialAccuracy]:
    """Return the accuracies, with at most as many nodes as robots unless other batches follow."""
    count = len(robots)
    follows = robots.ranges is not None and count >= _MIN_ROBOTS
    usual, fine = TOLERANCES
    return [
        PolynomialAccuracy(usual, _MAX_NODES if follows else min(_MAX_NODES, count // 2)),
        PolynomialAccuracy(fine, _MAX_NODES if follows else min(_MAX_NODES, count)),
    ]


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
