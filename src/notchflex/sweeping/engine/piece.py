"""One piece of a sweep: its rows are worked out, solved and written to one Parquet file."""

from __future__ import annotations

import io
import json
import os
import threading
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from notchflex.results.files.writing import replacing
from notchflex.sweeping.engine.manifest import Manifest
from notchflex.sweeping.engine.sketch import Scale, Sketch
from notchflex.sweeping.model import CODES, SweepModel, model_of
from notchflex.sweeping.points import Points
from notchflex.tolerancing.study import FAILED, Outcomes

KEY = "notchflex-sweep"
_SCALED = 1024
"""Rows of the sample that find the scales of statistics."""


class Done(NamedTuple):
    """What became of a piece.

    Attributes:
        piece: Its number, from 0.
        rows: Its rows.
        unsolved: Rows without a result.
        size: Bytes of its file.
    """

    piece: int
    rows: int
    unsolved: int
    size: int


class Worker:
    """Works on pieces of one sweep.

    Args:
        manifest: The manifest.
        model: Its model, if there is one already.
    """

    def __init__(self, manifest: Manifest, model: SweepModel | None = None) -> None:
        self.manifest, self.plan = manifest, manifest.plan
        self.model = model_of(self.plan, manifest.robot) if model is None else model
        self._own = threading.local()

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
        found = self.model.at({name: one[::step] for name, one in sample.items()})
        return [Scale.of(column) for column in found.values.T]

    def piece(self, piece: int) -> tuple[Any, dict[str, Any]]:
        """Work out one piece.

        Returns:
            Its rows as a data frame of polars, and its head: what is summed up of all its rows.
        """
        start, stop = self.manifest.between(piece)
        numbers = self.points.rows(start, stop)
        found = self.model.at(numbers)
        head = self._head(piece, start, found)
        frame = self._frame(numbers, found)
        if not self.plan.output.rows:
            frame = _chosen(frame, head, start)
        return frame, head

    def _head(self, piece: int, start: int, found: Outcomes) -> dict[str, Any]:
        output = self.plan.output
        failed = np.flatnonzero(found.codes >= FAILED)[: output.failures] + start
        names = list(self.model.columns)
        columns = zip(names, found.values.T, self.scales, strict=True)
        return {
            "sweep": self.manifest.digest,
            "piece": piece,
            "codes": np.bincount(found.codes, minlength=len(CODES)).tolist(),
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

    def _frame(self, numbers: dict[str, np.ndarray], found: Outcomes) -> Any:
        import polars

        code = polars.Series("code", CODES, polars.Enum(CODES)).gather(found.codes)
        values = np.ascontiguousarray(found.values.T)
        columns = dict(zip(self.model.columns, values, strict=True))
        some = bool((found.codes >= FAILED).any())
        return polars.DataFrame({**numbers, "code": code, **columns}, nan_to_null=some)


def _chosen(frame: Any, head: dict[str, Any], start: int) -> Any:
    """Return the rows of extremes and failures alone, with their numbers."""
    import polars

    rows = set(head["failures"])
    for column in head["columns"].values():
        rows |= {row for key in ("smallest", "largest") for _, row in column[key]}
    chosen = np.array(sorted(rows), np.int64)
    return frame[(chosen - start).tolist()].insert_column(0, polars.Series("row", chosen))


@lru_cache(maxsize=2)
def worker_of(text: str) -> Worker:
    """Return the worker of a manifest, prepared; one for a process."""
    manifest = Manifest.read(text, "the manifest")
    manifest.check_versions("this sweep")
    worker = Worker(manifest)
    assert worker.scales
    return worker


def piece_file(folder: str | os.PathLike[str], piece: int) -> Path:
    """Return the file of a piece."""
    return Path(folder) / "pieces" / f"piece-{piece:09d}.parquet"


def encoded(frame: Any, head: dict[str, Any]) -> memoryview:
    """Return the bytes of a piece."""
    buffer = io.BytesIO()
    metadata = {KEY: json.dumps(head)}
    frame.write_parquet(buffer, compression="lz4", statistics=True, metadata=metadata)
    return buffer.getbuffer()


def make_piece(worker: Worker, folder: str | os.PathLike[str], piece: int) -> Done:
    """Work out a piece and write its file, beside and then renamed.

    Raises:
        InputError: The file cannot be written.
    """
    frame, head = worker.piece(piece)
    data = encoded(frame, head)
    with replacing(piece_file(folder, piece)) as temporary:
        # polars writes into memory: what the disk refuses is an error of this call alone.
        temporary.write_bytes(data)
    start, stop = worker.manifest.between(piece)
    return Done(piece, stop - start, sum(head["codes"][FAILED:]), len(data))
