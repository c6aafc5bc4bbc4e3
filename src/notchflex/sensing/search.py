"""Searches among the forces of one reading: the best one, and the extreme ones that still fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from notchflex.results.path import EquilibriumPath
from notchflex.sensing.model import SensingModel, Step
from notchflex.solver.programs.run import SolverRun
from notchflex.solver.solver_state import SolverState

# Lengths that are tried of a step: of what slopes promise, and where that fails of any.
_WHOLE = np.array([1.0])
_FULL = np.array([1.0, 0.5, 0.2, 0.05, 0.01])
_NEAR = np.array([1.02, 1.0, 0.98, 0.9])
_REACH = np.array([2.0, 1.4, 1.0, 0.8, 0.6, 0.4, 0.25, 0.1, 0.03, 0.01, 0.003, 0.001])
_BETWEEN = np.array([0.03, 0.1, 0.25, 0.5, 0.75, 1.0])
_MOST_STEPS, _MOST_REACHES, _MOST_HALVINGS = 20, 16, 6
# A fit that misses the readings by more than this, in squares of the noise for each number that
# was read, is tried again from all over the range.
_BAD_FIT, _STARTS = 12.0, 9
# A whole step is taken where it brings this part of what slopes promise.
_GOOD_GAIN = 0.5
# The search ends where the misfit falls, or an extreme moves, by less than these parts.
_SMALL_GAIN, _SMALL_MOVE = 1e-9, 1e-3
# Ends of an interval are found to this part of the range.
_NARROW = 1e-7
# A force far outside the range, by which nothing is measured, weighs this little against readings.
_WEAK = 1e-3


@dataclass(frozen=True, eq=False)
class Candidate:
    """A force for one reading and how it fits.

    Attributes:
        force: Components, N, (d,).
        misfit: Sum of squares of the whitened deviations.
        deviations: Measured minus computed, whitened, (m,).
        path: The solved state in a path of candidates.
        row: Which of them it is.
    """

    force: Float[np.ndarray, " d"]
    misfit: float
    deviations: Float[np.ndarray, " m"]
    path: EquilibriumPath
    row: int

    @property
    def state(self) -> SolverState:
        """The solved state, to go on from."""
        return self.path.prepared.state.unpack(self.run.states[self.row])

    @property
    def alone(self) -> EquilibriumPath:
        """The path of this candidate alone, for its derivatives."""
        if len(self.path) == 1:
            return self.path
        return replace(
            self.path, load=self.path.load.part(self.row, 1), run=self.run.only(self.row)
        )

    @property
    def run(self) -> SolverRun:
        """How the candidates were solved."""
        run = self.path.run
        assert isinstance(run, SolverRun)
        return run


@dataclass(frozen=True, eq=False)
class ReadingProblem:
    """What a force must meet in one reading, from the state after the reading before.

    Attributes:
        model: The robot.
        step: The reading.
        start: The state before; None for rest.
        whitening: Matrix that makes the deviations independent of unit variance, (m, m).
    """

    model: SensingModel
    step: Step
    start: SolverState | None
    whitening: Float[np.ndarray, "m m"]

    def candidates(self, forces: Float[np.ndarray, "k d"]) -> list[Candidate]:
        """Solve some forces; the misfit is infinite where it does not converge."""
        path = self.model.solve(self.start, self.step.number, forces)
        computed = self.model.values(path)[:, self.step.entries]
        deviations = (self.step.measured - computed) @ self.whitening.T
        misfit = np.where(path.converged, (deviations**2).sum(1), np.inf)
        misfit = np.where(np.isnan(misfit), np.inf, misfit)
        rows = zip(forces, misfit.tolist(), deviations, strict=True)
        return [Candidate(*row, path, number) for number, row in enumerate(rows)]

    def slopes(self, at: Candidate) -> Float[np.ndarray, "m d"]:
        """Return the change of what is read by the force, whitened.

        Where a state was so hard to reach that its derivatives are not known, by differences.
        """
        change = self.model.slopes(at.alone)[0][self.step.entries]
        if not np.isfinite(change).all():
            change = self._differences(at)
        return self.whitening @ change

    def _differences(self, at: Candidate) -> Float[np.ndarray, "m d"]:
        width = 1e-5 * self.model.largest
        moves = width * np.eye(self.model.size)
        path = self.model.solve(
            self.start, self.step.number, np.concatenate([at.force + moves, at.force - moves])
        )
        values = self.model.values(path)[:, self.step.entries]
        half = len(moves)
        return np.nan_to_num((values[:half] - values[half:]).T / (2.0 * width))

    def clipped(self, forces: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "k d"]:
        """Return forces within the range of the search."""
        return np.clip(forces, -self.model.largest, self.model.largest)


def best(problem: ReadingProblem, forces: Float[np.ndarray, "k d"]) -> Candidate:
    """Find the force that fits best, by Gauss-Newton steps from the best of some.

    Where several fit equally well, it stays near the one it began at.
    """
    at = min(problem.candidates(forces), key=lambda one: one.misfit)
    if not len(problem.step.entries):
        return at
    weak = _WEAK / problem.model.largest
    for _ in range(_MOST_STEPS):
        if not np.isfinite(at.misfit) or at.misfit < _SMALL_GAIN:
            break
        slopes = problem.slopes(at)
        normal = slopes.T @ slopes + weak**2 * np.eye(problem.model.size)
        step = np.linalg.solve(normal, slopes.T @ at.deviations)
        size = np.abs(step).max()
        step *= min(1.0, 0.5 * problem.model.largest / max(size, 1e-300))
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
    return not at.misfit <= _BAD_FIT * max(len(at.deviations), 1)


def best_of_all(problem: ReadingProblem, forces: Float[np.ndarray, "k d"]) -> Candidate:
    """Find the force that fits best near some, and, if none fits, from all over the range."""
    at = best(problem, forces)
    if not bad_fit(at):
        return at
    model = problem.model
    steps = np.linspace(-model.largest, model.largest, _STARTS)
    every = np.concatenate([np.multiply.outer(steps, row) for row in np.eye(model.size)])
    return min(at, best(problem, every), key=lambda one: one.misfit)


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
    for _ in range(_MOST_REACHES):
        move = _step_along(problem, at, direction, most)
        ahead, gain = at, 0.0
        for lengths in (_NEAR, _REACH):
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
    for _ in range(_MOST_HALVINGS):
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
    """Return the farthest of some forces that fits, and the next beyond it, which does not."""
    candidates = problem.candidates(problem.clipped(forces))
    fitting = [one for one in candidates if one.misfit <= most]
    ahead = max([at, *fitting], key=lambda one: float(direction @ one.force))
    past = [one.force for one in candidates if direction @ one.force > direction @ ahead.force]
    return ahead, min(past, key=lambda one: float(direction @ one), default=None)


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


__all__ = ["Candidate", "Extreme", "ReadingProblem", "bad_fit", "best", "best_of_all", "extreme"]
