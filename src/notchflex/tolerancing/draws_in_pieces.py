"""Draws within tolerances in pieces: more than fits into memory, by many processes, resumable.

A piece is a part of one replicate of scrambled Sobol points.
"""

from __future__ import annotations

import pickle
import threading
from functools import cached_property
from typing import Any

import numpy as np

from notchflex.pieces.codes import ACCEPTED, CODES
from notchflex.pieces.folder import finished_head
from notchflex.pieces.manifest import Manifest
from notchflex.pieces.options import PieceFolder
from notchflex.pieces.piece import Piece, Recipe
from notchflex.pieces.plain import plain
from notchflex.pieces.run import Progress
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.pieces.sobol import SobolPart
from notchflex.robot.robot import to_table
from notchflex.tolerancing.drawn import DrawnPieces, beyond
from notchflex.tolerancing.piece_study import SAMPLE, PieceStudy, piece_rows
from notchflex.tolerancing.spec import ToleranceSpec
from notchflex.tolerancing.study import Study, study_of
from notchflex.tolerancing.yields import REPLICATES, points_of_each, replicate

KIND = "tolerance"
_SCALED = 1024
"""Robots of the sample that find the scales of statistics."""
_EXTREMES = 10
"""Smallest and largest values that are kept of each number."""


class ToleranceTask:
    """Robots at levels of their tolerances, in pieces.

    Args:
        study: What deviates, and the numbers that have limits.
        spec: What it was made from.
        draws: About how many robots are drawn.
        seed: Of the draws.
    """

    def __init__(self, study: Study, spec: ToleranceSpec, draws: int, seed: int) -> None:
        self._content = (study.robot, spec, study.tolerances, study.settings, study.refinement)
        self._draws, self.seed, self.each = draws, seed, points_of_each(draws)
        self._own = threading.local()
        sources = len(study.sources)
        levels = np.concatenate(
            [
                replicate(sources, self.each, seed, number).between(0, SAMPLE // REPLICATES)
                for number in range(REPLICATES)
            ]
            if self.each >= SAMPLE // REPLICATES
            else [np.random.default_rng(seed).random((SAMPLE, sources))]
        )
        self.study = PieceStudy(
            study.robot, study.tolerances, study.paths, study.criteria, study.settings,
            study.refinement, 1, sample=study.drawn(levels),
        )  # fmt: skip
        self.manifest = self._manifest()

    def _manifest(self) -> Manifest:
        """Return all that the bytes of pieces depend on."""
        rows = REPLICATES * self.each
        study = self.study
        return Manifest.made(
            KIND,
            rows,
            min(piece_rows(rows, study), self.each),
            robot=to_table(study.exact),
            tolerances=plain(study.tolerances),
            loads=plain(study.loads),
            limits=[
                [one.name, one.load, one.step, plain(one.lower), plain(one.upper)]
                for one in study.criteria
            ],
            settings=plain(study.settings),
            refinement=study.refinement,
            seed=self.seed,
        )

    @property
    def recipe(self) -> Recipe:
        """Recipe by which another process makes the same task."""
        return Recipe(tolerance_task, pickle.dumps((self._content, self._draws, self.seed)))

    def prepare(self) -> None:
        """Find scales and polynomials, which all threads need."""
        assert self.scales
        assert self.study.chains

    @cached_property
    def scales(self) -> list[Scale]:
        """Scales of the statistics of every number."""
        sample = {name: one[:: SAMPLE // _SCALED] for name, one in self.study.sample.items()}
        outcomes = self.study.solved(sample, len(next(iter(sample.values()))))
        return [Scale.of(column) for column in outcomes.values.T]

    def _sequence(self, number: int) -> SobolPart:
        """Return a replicate, for the calling thread."""
        if getattr(self._own, "number", None) != number:
            self._own.number = number
            self._own.part = replicate(len(self.study.sources), self.each, self.seed, number)
        return self._own.part

    def piece(self, number: int) -> Piece:
        """Draw and solve the robots of one piece."""
        import polars

        start, stop = self.manifest.between(number)
        which, first = divmod(start, self.each)
        levels = self._sequence(which).between(first, first + stop - start)
        outcomes = self.study.at_levels(levels)
        below, above = beyond(outcomes.values, self.study.criteria)
        solved = np.asarray(np.isfinite(outcomes.values).all(axis=1))
        complete = np.where(solved[:, None], outcomes.values, np.nan)
        columns = zip(np.ascontiguousarray(complete.T), self.scales, strict=True)
        head = {
            "codes": np.bincount(outcomes.codes, minlength=len(CODES)).tolist(),
            "replicate": which,
            "below": below.tolist(),
            "above": above.tolist(),
            "scales": [[one.middle, one.half] for one in self.scales],
            "columns": [
                Sketch.of(values, start, scale, _EXTREMES).document() for values, scale in columns
            ],
        }
        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(outcomes.codes)
        frame: dict[str, Any] = {"code": code}
        for one, values in zip(self.study.criteria, outcomes.values.T, strict=True):
            unit = f" [{one.quantity.unit}]" if one.quantity.unit else ""
            frame[f"{one.name}{unit}"] = np.ascontiguousarray(values) * one.quantity.scale
        return Piece(polars.DataFrame(frame, nan_to_null=True), head)


def tolerance_task(content: bytes) -> ToleranceTask:
    """Make the task of another process again, from objects that it pickled."""
    (robot, spec, tolerances, settings, refinement), draws, seed = pickle.loads(content)
    study = study_of(robot, spec, tolerances, settings, refinement)
    return ToleranceTask(study, spec, draws, seed)


def draw_in_pieces(
    study: Study,
    spec: ToleranceSpec,
    draws: int,
    seed: int,
    folder: PieceFolder,
    progress: Progress | None = None,
) -> DrawnPieces:
    """Draw robots in pieces, and sum up what became of them.

    Args:
        study: What deviates, and the numbers that have limits.
        spec: What it was made from.
        draws: About how many robots are drawn.
        seed: Of the draws.
        folder: Where pieces are kept.
        progress: Called with robots done, robots in all, those without a result, and those done by
            earlier calls.

    Raises:
        InputError: The folder holds something else, or cannot be written.
    """
    task = ToleranceTask(study, spec, draws, seed)
    folder.run(task, cores=study.cores, progress=progress)
    size, manifest = len(study.criteria), task.manifest
    codes, accepted = np.zeros(len(CODES), int), np.zeros(REPLICATES, int)
    below, above = np.zeros(size, int), np.zeros(size, int)
    sketches, scales = [Sketch() for _ in range(size)], [Scale(0.0, 1.0)] * size
    for piece in range(manifest.pieces):
        head = finished_head(folder.directory, manifest, piece)
        codes += np.array(head["codes"])
        accepted[head["replicate"]] += head["codes"][ACCEPTED]
        below += np.array(head["below"], int)
        above += np.array(head["above"], int)
        scales = [Scale(*pair) for pair in head["scales"]]
        sketches = [
            one.merged(Sketch.read(document), _EXTREMES)
            for one, document in zip(sketches, head["columns"], strict=True)
        ]
    return DrawnPieces(folder.directory, codes, accepted, below, above, sketches, scales)
