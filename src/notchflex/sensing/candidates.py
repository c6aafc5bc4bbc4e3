"""Forces that are tried for one reading, each solved once from the state before."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex.results.path import EquilibriumPath
from notchflex.sensing.model import SensingModel, Step
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.solver_state import SolverState

# Part of the range over which differences approximate slopes.
_NARROW = 1e-5


@dataclass(frozen=True, eq=False)
class Solved:
    """One force of a reading, solved.

    Attributes:
        model: The robot.
        path: The solved state in a path of forces from the same state.
        row: Which of them it is.
        values: What the sensors would read, (outputs,).
        converged: Whether there is such a state.
    """

    model: SensingModel
    path: EquilibriumPath
    row: int
    values: Float[np.ndarray, " outputs"]
    converged: bool

    @property
    def run(self) -> SolverRun:
        """Counts of the solves for the forces."""
        run = self.path.run
        assert isinstance(run, SolverRun)
        return run

    @property
    def alone(self) -> EquilibriumPath:
        """The path of this force alone, for its derivatives."""
        if len(self.path) == 1:
            return self.path
        return replace(
            self.path, load=self.path.load.part(self.row, 1), run=self.run.only(self.row)
        )

    @cached_property
    def slopes(self) -> Float[np.ndarray, "outputs d"]:
        """Change of what is read by the force; NaN where it is not known."""
        return self.model.slopes(self.alone)[0]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A force for one reading and how it fits.

    Attributes:
        force: Components, N, (d,).
        misfit: Sum of squares of the whitened deviations.
        deviations: Measured minus computed, whitened, (m,).
        solved: The solved state.
    """

    force: Float[np.ndarray, " d"]
    misfit: float
    deviations: Float[np.ndarray, " m"]
    solved: Solved

    @property
    def state(self) -> SolverState:
        """The solved state, to go on from."""
        run = self.solved.run
        return self.solved.path.prepared.state.unpack(run.states[self.solved.row])


Known = dict[bytes, Solved]
"""Forces that were solved from one state in one reading, by their bytes."""


@dataclass(frozen=True, eq=False)
class ReadingProblem:
    """Problem of one reading: the force from the state after the reading before.

    Attributes:
        model: The robot.
        step: The reading.
        start: The state before; None for rest.
        whitening: Matrix that makes the deviations independent of unit variance, (m, m).
        known: What was solved from this state before: problems may share it that differ in what
            was measured or in the noise.
    """

    model: SensingModel
    step: Step
    start: SolverState | None
    whitening: Float[np.ndarray, "m m"]
    known: Known = field(default_factory=dict[bytes, Solved])

    def candidates(self, forces: Float[np.ndarray, "k d"]) -> list[Candidate]:
        """Solve some forces; the misfit is infinite where it does not converge."""
        every = self._solved(forces)
        computed = np.array([one.values for one in every])[:, self.step.entries]
        deviations = (self.step.measured - computed) @ self.whitening.T
        misfit = np.where([one.converged for one in every], (deviations**2).sum(1), np.inf)
        misfit = np.where(np.isnan(misfit), np.inf, misfit)
        rows = zip(forces, misfit.tolist(), deviations, every, strict=True)
        return [Candidate(*row) for row in rows]

    def _solved(self, forces: Float[np.ndarray, "k d"]) -> list[Solved]:
        keys = [force.tobytes() for force in forces]
        new = {key: force for key, force in zip(keys, forces, strict=True) if key not in self.known}
        if new:
            path = self.model.solve(self.start, self.step.number, np.array(list(new.values())))
            rows = zip(new, self.model.values(path), path.converged.tolist(), strict=True)
            for row, (key, values, converged) in enumerate(rows):
                self.known[key] = Solved(self.model, path, row, values, converged)
        return [self.known[key] for key in keys]

    def slopes(self, at: Candidate) -> Float[np.ndarray, "m d"]:
        """Return the change of what is read by the force, whitened.

        Where a state was so hard to reach that its derivatives are not known, by differences.
        """
        change = at.solved.slopes[self.step.entries]
        if not np.isfinite(change).all():
            return self.differences(at, _NARROW)
        return self.whitening @ change

    def differences(self, at: Candidate, part: float) -> Float[np.ndarray, "m d"]:
        """Return the same by differences over twice this part of the range."""
        width = part * self.model.largest
        moves = width * np.eye(self.model.size)
        every = self._solved(np.concatenate([at.force + moves, at.force - moves]))
        values = np.array([one.values for one in every])[:, self.step.entries]
        half = len(moves)
        return self.whitening @ np.nan_to_num((values[:half] - values[half:]).T / (2.0 * width))

    def clipped(self, forces: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "k d"]:
        """Return forces within the range of the search."""
        return np.clip(forces, -self.model.largest, self.model.largest)


__all__ = ["Candidate", "Known", "ReadingProblem", "Solved"]
