"""The searches of a fit as pieces: each from one starting point, stored and resumable."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np

from notchflex.fit.estimation.minimise import Minimum
from notchflex.fit.estimation.problem import FitProblem, Progress, search_from, starting_points
from notchflex.fit.model.samples import Samples
from notchflex.pieces.folder import finished_head
from notchflex.pieces.manifest import Manifest
from notchflex.pieces.options import PieceFolder
from notchflex.pieces.piece import Piece, Recipe
from notchflex.pieces.plain import plain
from notchflex.robot.robot import to_table

KIND = "calibration"


class SearchTask:
    """Searches from starting points, each of which is a piece.

    Args:
        problem: The objective.
        starts: Number of starting points that have a solution.
        seed: Seed of the starting points.
    """

    def __init__(self, problem: FitProblem, starts: int, seed: int) -> None:
        self.problem, self.starts, self.seed = problem, starts, seed
        self.points = starting_points(problem, starts, seed)
        samples = problem.samples
        self._robots = {one.label: one.robot for one in samples.every}
        self._settings = samples.every[0].settings
        self.manifest = Manifest.made(
            KIND,
            len(self.points),
            1,
            robots={label: to_table(robot) for label, robot in self._robots.items()},
            measurements=[[one.label, plain(one.measured)] for one in samples.every],
            constants=plain(samples.unknowns),
            objective=plain(problem.objective),
            settings=plain(self._settings),
            starts=starts,
            seed=seed,
        )

    @property
    def recipe(self) -> Recipe:
        """How another process makes the same task."""
        samples = self.problem.samples
        data = {label: tuple(samples.of_robot(label)) for label in self._robots}
        content = (self._robots, data, samples.unknowns, self._settings)
        return Recipe(
            search_task,
            pickle.dumps((content, self.problem.objective, self.starts, self.seed)),
        )

    def prepare(self) -> None:
        """Estimate the noise, as the first search does at the first point with a solution."""
        for point in self.points:
            if self.problem.noise is not None:
                break
            self.problem(point)

    def piece(self, number: int) -> Piece:
        """Search from one starting point."""
        import polars

        search = search_from(self.problem, self.points[number], number, self.starts, self.seed)
        names = [one.name for one in self.problem.unknowns]
        cost = np.nan if search.cost is None else search.cost.value
        columns: dict[str, Any] = dict(zip(names, search.values[:, None], strict=True))
        frame = {**columns, "objective": [cost], "converged": [search.converged]}
        head = {
            "codes": [1, 0, 0, 0] if search.cost is not None else [0, 0, 1, 0],
            "values": search.values.tolist(),
            **{name: getattr(search, name) for name in ("converged", "reason")},
            **{name: int(getattr(search, name)) for name in ("iterations", "calls")},
        }
        return Piece(polars.DataFrame(frame), head)

    def minimum(self, head: dict[str, Any]) -> Minimum:
        """Return what a search found, from the head of its piece."""
        values = np.array(head["values"])
        cost = self.problem(values) if head["codes"][0] else None
        rest = (head[name] for name in ("converged", "reason", "iterations", "calls"))
        return Minimum(values, cost, *rest)


def search_task(content: bytes) -> SearchTask:
    """Make the task of another process again, from objects that it pickled."""
    (robots, data, constants, settings), objective, starts, seed = pickle.loads(content)
    samples = Samples.of(robots, data, constants, settings)
    return SearchTask(FitProblem(samples, objective), starts, seed)


def search_in_pieces(
    problem: FitProblem, starts: int, seed: int, folder: PieceFolder, progress: Progress | None
) -> tuple[Minimum, ...]:
    """Search from several starts; another one replaces a start without a solution.

    Args:
        problem: The objective.
        starts: Number of starting points.
        seed: Their seed.
        folder: Where searches are kept.
        progress: As for `search`, which finds the same.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    task = SearchTask(problem, starts, seed)
    task.prepare()
    minima: list[Minimum] = []
    done, last = 0, 0
    while len(minima) < starts and last < task.manifest.pieces:
        last = min(last + starts - len(minima), task.manifest.pieces)

        def report(rows: int, *_: int, before: int = done) -> None:
            if progress is not None:
                progress("searching", min(before + rows, starts), starts)

        folder.run(task, pieces=range(done, last), cores=1, progress=report)
        for piece in range(done, last):
            head = finished_head(folder.directory, task.manifest, piece)
            if head["codes"][0] or not piece:
                minima.append(task.minimum(head))
        done = last
    if all(one.cost is None for one in minima):
        problem(task.points[0])  # tells where there is no solution
    return tuple(minima)
