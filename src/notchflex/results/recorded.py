"""A run read back from a file: its numbers are reported without solving."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from notchflex._jax import jax
from notchflex.loads.command import Command
from notchflex.solver.derived.quantities import Shape, reported
from notchflex.solver.solver_state import SolverState

REPORTED = (*Shape._fields, *reported("state"))
"""Everything that a run reports of each state, by name."""

BEFORE = ("tension", "stroke", "span_tension", "contact_slid")
"""What is needed of the state before the first one: work is integrated from there."""

FLATTENING = "flattening"
"""What the loss of flattening is counted from, of every state; for materials that remember."""

MATERIAL = "material"
"""Memory of the material in that state, where it has any."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """States of many loads, loads as leading axis, as `SolverRun` has them.

    Attributes:
        solved: The last solved state at each load.
        reported: What is reported of each state, by the names of `REPORTED`.
        first: What is reported of the state before the first load, by the names of `BEFORE`;
            the memory of the material, as `MATERIAL`, and `FLATTENING`.
        held: Smallest eigenvalue of every stiffness, and the sign of its determinant.
        residual: Largest scaled imbalance of the last attempt.
        iterations: Newton iterations.
        converged: Whether the load was reached.
        tried: Whether it was tried at all.
        reached: Part of the way from the load before that was reached.
        snapped: Notches that snapped shut (1) or open (-1).
    """

    solved: SolverState
    reported: Mapping[str, np.ndarray]
    first: Mapping[str, np.ndarray]
    held: tuple[np.ndarray, np.ndarray]
    residual: Float[np.ndarray, " s"]
    iterations: Int[np.ndarray, " s"]
    converged: Bool[np.ndarray, " s"]
    tried: Bool[np.ndarray, " s"]
    reached: Float[np.ndarray, " s"]
    snapped: Float[np.ndarray, "s n"]

    def quantity(self, name: str) -> np.ndarray:
        """Return a quantity of each state by its name in the registry."""
        return self.reported[name]

    def rows(self, some: slice) -> Recorded:
        """Return some of the loads."""
        start = np.arange(len(self.converged))[some][0]
        first = dict(self.first)
        if start:
            every = {**self.reported, MATERIAL: self.solved.memory.material}
            first = {name: np.asarray(every[name])[start - 1] for name in first}
        cut = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "first"}
        return Recorded(first=first, **jax.tree.map(lambda values: np.asarray(values)[some], cut))

    def before(self, name: str) -> np.ndarray:
        """Return a quantity of the state before the first load, by name."""
        return self.first[name]

    def stability(self, commands: Command) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest real part of the eigenvalues, and the determinant's sign."""
        del commands  # they were counted when it was computed
        return self.held

    def stable(self, commands: Command) -> Bool[np.ndarray, " s"]:
        """Return whether each state is stable."""
        eigenvalue, sign = self.stability(commands)
        return (eigenvalue > 0.0) & (sign > 0.0)
