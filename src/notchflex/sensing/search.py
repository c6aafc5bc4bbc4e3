"""The search for the forces of one reading: what is tried, the best, and what still fits."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex import EquilibriumPath
from notchflex.sensing.model import SensingModel, SensingStep
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.residual import SolverState

# Part of the range over which differences approximate slopes.
_NARROW_STEP = 1e-5


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
        return self.path[self.row : self.row + 1]

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
    step: SensingStep
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
            return self.differences(at, _NARROW_STEP)
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


# Trial lengths of a step, relative to the predicted step or to any step.
_WHOLE = np.array([1.0])
_FULL = np.array([1.0, 0.5, 0.2, 0.05, 0.01])
_FIRST_LENGTHS = np.array([1.02, 1.0, 0.98, 0.9])
_REACH = np.array([2.0, 1.4, 1.0, 0.8, 0.6, 0.4, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001])
_BETWEEN = np.array([0.03, 0.1, 0.25, 0.5, 0.75, 1.0])
_MAX_STEPS, _MAX_REACHES, _MAX_HALVINGS = 20, 16, 6
# Number of forces solved in one batch.
_TOGETHER = 3
BAD_FIT = 12.0
"""Largest accepted misfit, in squares of the noise for each number read."""
# A bad fit is repeated from this number of starts, with differences over these parts of the range.
_STARTS, _WIDTHS = 9, (1e-2, 1e-3, 1e-4, 1e-5)
# Gain ratio above which a full step is accepted.
_GOOD_GAIN = 0.5
# The search ends if the misfit falls, or an extreme moves, by less than these parts.
_SMALL_GAIN, _SMALL_MOVE = 1e-9, 1e-3
# Accuracy of the ends of an interval, and smallest step, relative to the range.
_NARROW, _NO_MOVE = 1e-7, 1e-9
# Weight of a prior that keeps an unobservable force near the range.
_WEAK = 1e-3


def best(
    problem: ReadingProblem, forces: Float[np.ndarray, "k d"], part: float | None = None
) -> Candidate:
    """Find the force that fits best, by Gauss-Newton steps from the best of some.

    Where several fit equally well, it stays near the one it began at.

    Args:
        problem: The reading.
        forces: Where to begin.
        part: Part of the range over which differences are taken in the place of slopes.
    """
    at = min(problem.candidates(forces), key=lambda one: one.misfit)
    if not len(problem.step.entries):
        return at
    weak = _WEAK / problem.model.largest
    for _ in range(_MAX_STEPS):
        if not np.isfinite(at.misfit) or at.misfit < _SMALL_GAIN:
            break
        slopes = problem.slopes(at) if part is None else problem.differences(at, part)
        normal = slopes.T @ slopes + weak**2 * np.eye(problem.model.size)
        step = np.linalg.solve(normal, slopes.T @ at.deviations)
        size = np.abs(step).max()
        step *= min(1.0, 0.5 * problem.model.largest / max(size, 1e-300))
        if size <= _NO_MOVE * problem.model.largest:
            break
        promised = at.misfit - ((at.deviations - slopes @ step) ** 2).sum()
        new = at
        for lengths in (_WHOLE, _FULL):
            tried = problem.candidates(problem.clipped(at.force + np.outer(lengths, step)))
            new = min(tried, key=lambda one: one.misfit)
            if at.misfit - new.misfit >= _GOOD_GAIN * promised > 0.0:
                break
        gain = at.misfit - new.misfit
        if gain <= 0.0:
            break
        at = new
        if gain < _SMALL_GAIN * (1.0 + at.misfit):
            break
    return at


def bad_fit(at: Candidate) -> bool:
    """Return whether a force misses the readings by far more than their noise."""
    return not at.misfit <= BAD_FIT * max(len(at.deviations), 1)


def best_of_all(problem: ReadingProblem, forces: Float[np.ndarray, "k d"]) -> Candidate:
    """Find the force that fits best near some, and, if none fits, from all over the range."""
    at = best(problem, forces)
    if not bad_fit(at):
        return at
    model = problem.model
    steps = np.linspace(-model.largest, model.largest, _STARTS)
    every = np.concatenate([np.multiply.outer(steps, row) for row in np.eye(model.size)])
    at = min(at, best(problem, every), key=lambda one: one.misfit)
    # Where a contact begins to slide the slopes of one side lead nowhere: over both sides they do.
    for part in _WIDTHS:
        if not bad_fit(at):
            break
        at = best(problem, at.force[None], part)
        at = best(problem, at.force[None])
    return at


@dataclass(frozen=True, eq=False)
class Extreme:
    """The end of what fits along a direction.

    Attributes:
        inside: The last force found that fits.
        force: The first beyond it that does not, N, (d,); at the range of the search the last one.
        limited: Whether the range of the search ends it.
    """

    inside: Candidate
    force: Float[np.ndarray, " d"]
    limited: bool


def extreme(
    problem: ReadingProblem, at: Candidate, direction: Float[np.ndarray, " d"], most: float
) -> Extreme:
    """Go as far along a direction as forces fit, while the other components follow.

    Args:
        problem: The reading.
        at: A force that fits.
        direction: Component to increase, with its sign, (d,).
        most: The largest misfit that fits.

    Returns:
        The end of the connected part around `at`.
    """
    largest, origin = problem.model.largest, at.force
    beyond = None
    for _ in range(_MAX_REACHES):
        move = _step_along(problem, at, direction, most)
        ahead, gain = at, 0.0
        for lengths in (_FIRST_LENGTHS, _REACH):
            forces = at.force + np.outer(lengths, move)
            ahead, beyond = _farthest(problem, at, forces, direction, most)
            gain = direction @ (ahead.force - at.force)
            if gain > 0.0:
                break
        at = ahead
        if gain <= _SMALL_MOVE * (direction @ (at.force - origin)):
            break
        if direction @ at.force >= largest * (1.0 - 1e-12):
            break
    for _ in range(_MAX_HALVINGS):
        if beyond is None:
            break
        gap = direction @ (beyond - at.force)
        if gap <= max(_SMALL_MOVE * (direction @ (at.force - origin)), _NARROW * largest):
            break
        between = at.force + np.outer(_BETWEEN, beyond - at.force)
        at, beyond = _farthest(problem, at, between, direction, most)
    limited = bool(direction @ at.force >= largest * (1.0 - 1e-9))
    return Extreme(at, at.force if limited or beyond is None else beyond, limited)


def _farthest(
    problem: ReadingProblem,
    at: Candidate,
    forces: Float[np.ndarray, "k d"],
    direction: Float[np.ndarray, " d"],
    most: float,
) -> tuple[Candidate, Float[np.ndarray, " d"] | None]:
    """Return the farthest of some forces that fits, and the next beyond it, which does not.

    The farthest are tried first, so that those nearer than one that fits need not be solved.
    """
    forces = problem.clipped(forces)
    order = np.argsort(-(forces @ direction), kind="stable")
    ahead, beyond = at, []
    for first in range(0, len(order), _TOGETHER):
        some = problem.candidates(forces[order[first : first + _TOGETHER]])
        fitting = [one for one in some if one.misfit <= most]
        ahead = max([ahead, *fitting], key=lambda one: float(direction @ one.force))
        beyond += [one.force for one in some if direction @ one.force > direction @ ahead.force]
        if ahead is not at:
            break
    return ahead, min(beyond, key=lambda one: float(direction @ one), default=None)


def _step_along(
    problem: ReadingProblem, at: Candidate, direction: Float[np.ndarray, " d"], most: float
) -> Float[np.ndarray, " d"]:
    """Step to the farthest point of what fits in the linearised problem."""
    slopes = problem.slopes(at)
    weak = _WEAK / problem.model.largest
    normal = slopes.T @ slopes + weak**2 * np.eye(len(direction))
    centre = np.linalg.solve(normal, slopes.T @ at.deviations)
    rest = max(most - ((at.deviations - slopes @ centre) ** 2).sum(), 0.0)
    lean = np.linalg.solve(normal, direction)
    move = centre + np.sqrt(rest / max(direction @ lean, 1e-300)) * lean
    if direction @ move <= 0.0:
        move = lean
    size = np.abs(move).max()
    return move * min(1.0, 2.0 * problem.model.largest / max(size, 1e-300))
