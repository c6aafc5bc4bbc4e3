"""Slopes of all arrays of a robot by several of its numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from notchflex._jax import jax
from notchflex.analysis.derivatives.flexure_table import FlexureTable
from notchflex.analysis.derivatives.sparse_slopes import SparseSlopes
from notchflex.analysis.derivatives.tangent import Change
from notchflex.loads import LoadPath
from notchflex.mechanics.chain import Chain, FlexureOf, chain_averages
from notchflex.robot import Robot
from notchflex.robot.value_names import number_at
from notchflex.solver.programs.prepare import PreparedChain


@dataclass(frozen=True, eq=False)
class GeometrySlopes:
    """Slopes by k numbers; numbers that change different parts of the chain are varied together.

    Attributes:
        ready: Any robot of the form.
        names: Names of the numbers.
    """

    ready: PreparedChain
    names: tuple[str, ...]

    def at(
        self,
        packed: Callable[[Robot, LoadPath, FlexureOf], np.ndarray],
        robot: Robot,
        load: LoadPath,
    ) -> list[Change]:
        """Differentiate the arrays of a robot, and its loads.

        Args:
            packed: The long chain of a robot, and its loads, as one vector; takes what makes its
                flexures.
            robot: The robot, with the values where.
            load: The loads.

        Raises:
            InputError: A number cannot be varied.
        """
        at = np.array([number_at(robot, name) for name in self.names])

        def vector_of(values: np.ndarray) -> np.ndarray:
            moved = np.flatnonzero(values != at)
            changed = {self.names[one]: float(values[one]) for one in moved}
            return packed(robot.with_values(changed), load, self._flexures)

        self._flexures.forget()
        vector = packed(robot, load, self._flexures)
        # Integers of the chain identify the notches that a tendon passes at once.
        slopes = self._slopes_of(len(vector)).at(vector_of, at, vector[self._whole].tobytes())
        size = self.ready.long.chain_layout.size
        changes: list[Change] = []
        for by_number in slopes:
            by_number[self._averaged] = self._of_averages(vector, by_number)
            changes.append(Change(by_number[size:].reshape(len(load), -1), by_number[:size]))
        return changes

    @cached_property
    def _flexures(self) -> FlexureTable:
        return FlexureTable()

    @cached_property
    def _slopes(self) -> dict[int, SparseSlopes]:
        return {}

    def _slopes_of(self, numbers: int) -> SparseSlopes:
        """Return the slopes for vectors of a size: the chain, then the loads of some steps."""
        if numbers not in self._slopes:
            form = self.ready.long.chain_layout
            parts = [*form.indices, np.arange(form.size, numbers)]
            self._slopes[numbers] = SparseSlopes(6, parts, self._averaged)
        return self._slopes[numbers]

    @cached_property
    def _indices(self) -> Chain:
        """Indices of all fields in the vector of the long chain."""
        form = self.ready.long.chain_layout
        return jax.tree.unflatten(form.structure, form.indices)

    @cached_property
    def _whole(self) -> Int[np.ndarray, " m"]:
        form = self.ready.long.chain_layout
        whole = zip(form.indices, form.kinds, strict=True)
        return np.concatenate([indices.ravel() for indices, kind in whole if kind != "f"])

    @cached_property
    def _averaged(self) -> Int[np.ndarray, " a"]:
        """Indices of the averages over the notches in the vector."""
        one = np.ones(1)
        return np.ravel([getattr(self._indices, name) for name in chain_averages(one, one)])

    def _of_averages(
        self, vector: Float[np.ndarray, " packed"], change: Float[np.ndarray, " packed"]
    ) -> Float[np.ndarray, " a"]:
        """Compute the change of the averages; differences are exact for bilinear functions."""
        count, every = self.ready.chain.flexures, self._indices
        indices = every.contact_stiffness[:count], every.rods.length[:count]

        def at(side: float) -> np.ndarray:
            stiffness, length = (vector[one] + side * change[one] for one in indices)
            return np.ravel(list(chain_averages(stiffness, length.sum(axis=-1)).values()))

        return 0.5 * (at(1.0) - at(-1.0))
