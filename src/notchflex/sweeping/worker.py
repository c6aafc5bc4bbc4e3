"""The pieces of a sweep: rows are worked out from the plan, solved, and summed up."""

from __future__ import annotations

import threading
from functools import cached_property
from typing import Any

import numpy as np

from notchflex.pieces.folder import CODES, FAILED, Piece, Recipe
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.sweeping.result import KIND, SweepManifest
from notchflex.sweeping.rows import Points, SweepModel, model_of
from notchflex.tolerancing.study import Outcomes

_SCALED = 1024
"""Rows of the sample that find the scales of statistics."""


class SweepWorker:
    """Works on pieces of one sweep.

    Args:
        manifest: The manifest.
        model: Its model, if there is one already.
    """

    def __init__(self, manifest: SweepManifest, model: SweepModel | None = None) -> None:
        self.manifest, self.plan = manifest, manifest.plan
        self.model = model_of(self.plan, manifest.robot) if model is None else model
        self._own = threading.local()

    @property
    def recipe(self) -> Recipe:
        """Recipe by which another process makes the same worker: the text of the manifest."""
        return Recipe(sweep_worker, self.manifest.text)

    def prepare(self) -> None:
        """Find scales, which all threads need."""
        assert self.scales

    @property
    def points(self) -> Points:
        """The points, for the calling thread."""
        if not hasattr(self._own, "points"):
            self._own.points = Points(self.plan)
        return self._own.points

    @cached_property
    def scales(self) -> list[Scale]:
        """Scales of the statistics of every column."""
        sample = self.model.sample
        step = max(len(next(iter(sample.values()))) // _SCALED, 1)
        outcomes = self.model.at({name: one[::step] for name, one in sample.items()})
        return [Scale.of(column) for column in outcomes.values.T]

    def piece(self, number: int) -> Piece:
        """Work out one piece."""
        start, stop = self.manifest.between(number)
        numbers = self.points.rows(start, stop)
        outcomes = self.model.at(numbers)
        head = self._head(start, outcomes)
        frame = self._frame(numbers, outcomes)
        if not self.plan.output.rows:
            frame = _chosen(frame, head, start)
        return Piece(frame, head)

    def _head(self, start: int, outcomes: Outcomes) -> dict[str, Any]:
        output = self.plan.output
        failed = np.flatnonzero(outcomes.codes >= FAILED)[: output.failures] + start
        names = list(self.model.columns)
        columns = zip(names, outcomes.values.T, self.scales, strict=True)
        return {
            "codes": np.bincount(outcomes.codes, minlength=len(CODES)).tolist(),
            "failures": failed.tolist(),
            "scales": {
                name: [one.middle, one.half] for name, one in zip(names, self.scales, strict=True)
            },
            "columns": {
                name: Sketch.of(np.ascontiguousarray(values), start, scale, output.extremes)
                .document()
                for name, values, scale in columns
            },
        }  # fmt: skip

    def _frame(self, numbers: dict[str, np.ndarray], outcomes: Outcomes) -> Any:
        import polars

        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(outcomes.codes)
        values = np.ascontiguousarray(outcomes.values.T)
        columns = dict(zip(self.model.columns, values, strict=True))
        some = bool((outcomes.codes >= FAILED).any())
        return polars.DataFrame({**numbers, "code": code, **columns}, nan_to_null=some)


def _chosen(frame: Any, head: dict[str, Any], start: int) -> Any:
    """Return the rows of extremes and failures alone, with their numbers."""
    import polars

    rows = set(head["failures"])
    for column in head["columns"].values():
        rows |= {row for key in ("smallest", "largest") for _, row in column[key]}
    chosen = np.array(sorted(rows), np.int64)
    return frame[(chosen - start).tolist()].insert_column(0, polars.Series("row", chosen))


def sweep_worker(text: str) -> SweepWorker:
    """Return the worker of the text of a manifest."""
    return SweepWorker(SweepManifest.read(text, "the manifest", KIND))
