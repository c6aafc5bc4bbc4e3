"""A sweep as it lies in its folder: what it is, its rows, and what is summed up of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex import InputError, Robot
from notchflex.pieces import CODES, Manifest, Sketch, add_to, damaged, heads, piece_file
from notchflex.support import Displayed, Summary, from_table, nearest, need, short
from notchflex.sweeping.plan import SweepPlan, plan_from_table

if TYPE_CHECKING:
    from polars import DataFrame, LazyFrame
    from xarray import Dataset

KIND = "sweep"
_MAX_XARRAY = 100_000_000
"""Rows of a data set at most, which is in memory."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Displayed):
    """A sweep in its folder, finished or not.

    Attributes:
        directory: The folder.
        manifest: What the sweep is.
        plan: The plan; its robot is only a name.
        robot: The robot that is varied.
        pieces: Numbers of the pieces that are there.
        counts: How many rows have each code.
        failures: Numbers of the first rows without a result, as many as the plan asks for.
        sketches: Statistics of every kept quantity.
    """

    directory: Path
    manifest: Manifest
    plan: SweepPlan
    robot: Robot
    pieces: tuple[int, ...]
    counts: dict[str, int]
    failures: list[int]
    sketches: dict[str, Sketch]

    @property
    def rows(self) -> int:
        """Rows that are there."""
        return sum(self.counts.values())

    @property
    def finished(self) -> bool:
        """Whether all pieces are there."""
        return len(self.pieces) == self.manifest.pieces

    @property
    def columns(self) -> list[str]:
        """Names of the kept quantities, with their units."""
        return list(self.sketches)

    def lazy(self) -> LazyFrame:
        """Return the rows as a lazy frame of polars, in their order.

        Columns are `row`, the variables, `code` and the kept quantities, in the units of files.
        `code` is "accepted", "rejected" (outside of a limit), "NOT_CONVERGED" or "INVALID_ROBOT";
        the last two have no quantities.

        Raises:
            InputError: No piece is there.
        """
        import polars

        if not self.pieces:
            raise InputError.NO_DATA(f"{self.directory} has no finished piece yet.")
        return polars.concat([self._piece(piece) for piece in self.pieces])

    def _piece(self, piece: int) -> LazyFrame:
        """Return the rows of a piece with their numbers."""
        import polars

        frame = polars.scan_parquet(piece_file(self.directory, piece))
        if not self.plan.output.rows:
            return frame
        row = polars.int_range(polars.len(), dtype=polars.Int64) + self.manifest.between(piece)[0]
        return frame.select(row.alias("row"), polars.all())

    def to_xarray(self) -> Dataset:
        """Return the rows as a data set: a dimension for each variable of a grid, and `point`.

        Raises:
            InputError: The sweep is not finished, keeps not all rows, has more than 1e8, or xarray
                is not installed.
        """
        need("xarray", "data", "to_xarray")
        import xarray

        if not self.finished or not self.plan.output.rows or self.rows > _MAX_XARRAY:
            raise InputError.UNSUPPORTED(
                "to_xarray needs all rows of a finished sweep, at most 1e8; use lazy()."
            )
        plan, frame = self.plan, self.lazy().collect()
        axes: dict[str, Any] = {
            variable.value: frame[variable.value].unique(maintain_order=True).to_numpy()
            for variable in plan.grid
        }
        dimensions, sizes = list(axes), [len(values) for values in axes.values()]
        if plan.sampled:
            dimensions, sizes = [*dimensions, "point"], [*sizes, -1]

        def column(name: str) -> np.ndarray:
            return frame[name].to_numpy().reshape(sizes)

        code = frame["code"].cast(str).to_numpy().reshape(sizes).astype(str)
        values: dict[str, Any] = {name: (dimensions, column(name)) for name in self.columns}
        values["code"] = dimensions, code
        for variable in plan.sampled:
            values[variable.value] = ["point"], column(variable.value)[(0,) * len(axes)]
        attributes = {"sweep": plan.name, "robot": self.robot.name}
        return xarray.Dataset(values, coords=axes, attrs=attributes)

    def worst(self, column: str, *, largest: bool = True) -> DataFrame:
        """Return the rows with the largest values of a kept quantity, or with the smallest.

        Args:
            column: Name of the quantity, as in `columns`.
            largest: Whether the largest are meant.

        Raises:
            InputError: There is no such quantity.
        """
        sketch = self._sketch(column)
        pairs = (sketch.largest if largest else sketch.smallest)[: self.plan.output.extremes]
        rows = self._rows([row for _, row in pairs])
        return rows.sort(column, descending=largest, maintain_order=True)

    def first_failures(self) -> DataFrame:
        """Return the first rows without a result."""
        return self._rows(self.failures)

    def quantiles(self, column: str, parts: Sequence[float] | None = None) -> list[float]:
        """Return quantiles of a kept quantity, exact to 1/1000 of half the range of most values.

        Args:
            column: Name of the quantity, as in `columns`.
            parts: Numbers between 0 and 1; those of the plan if None.
        """
        levels = self.plan.output.quantiles if parts is None else parts
        return [self._sketch(column).quantile(part) for part in levels]

    def histogram(self, column: str, bins: int | None = None) -> tuple[list[float], list[int]]:
        """Return edges and counts of a histogram of a kept quantity.

        Args:
            column: Name of the quantity, as in `columns`.
            bins: Number of bins; that of the plan if None.
        """
        return self._sketch(column).histogram(self.plan.output.bins if bins is None else bins)

    def _sketch(self, name: str) -> Sketch:
        if name not in self.sketches:
            raise InputError.UNKNOWN_NAME(
                f'no quantity "{name}" is kept{nearest(name, self.columns)}; there are '
                f"{', '.join(self.columns)}."
            )
        return self.sketches[name]

    def _rows(self, rows: Sequence[int]) -> DataFrame:
        """Read rows by their numbers, from the pieces that hold them."""
        import polars

        size = self.manifest.document["piece"]
        pieces = sorted({row // size for row in rows}) or self.pieces[:1]
        frame = polars.concat([self._piece(piece) for piece in pieces])
        return frame.filter(polars.col("row").is_in(list(rows))).collect()

    def document(self) -> dict[str, Any]:
        """Return what is summed up of all rows, as plain values."""
        columns: dict[str, Any] = {}
        for name, sketch in self.sketches.items():
            mean, sd = sketch.moments
            smallest, largest = sketch.ends
            edges, counts = self.histogram(name)
            levels = [f"{part:g}" for part in self.plan.output.quantiles]
            columns[name] = {
                "count": sketch.count,
                "mean": mean,
                "sd": sd,
                "smallest": smallest,
                "largest": largest,
                "quantiles": dict(zip(levels, self.quantiles(name), strict=True)),
                "histogram": {"edges": edges, "counts": counts},
            }
        return {
            "name": self.plan.name,
            "program": "notchflex",
            "version": self.manifest.document["versions"]["notchflex"],
            "robot": self.robot.name,
            "rows": self.rows,
            "pieces": len(self.pieces),
            "finished": self.finished,
            "codes": self.counts,
            "first_failures": self.failures,
            "columns": columns,
        }

    def _summary(self) -> Summary:
        done = "" if self.finished else f" of {self.manifest.rows}"
        title = f"Sweep {self.plan.name}: {self.rows}{done} rows"
        rows = [(code, str(count)) for code, count in self.counts.items() if count]
        for name, sketch in self.sketches.items():
            if sketch.count:
                rows.append((name, " to ".join(map(short, sketch.ends))))
        return Summary(title, rows, ".lazy() is a frame of polars, .to_xarray() a data set")


def read_sweep(directory: str | os.PathLike[str]) -> Sweep:
    """Read a sweep, which may be unfinished.

    Args:
        directory: Its folder.

    Returns:
        The sweep: `lazy` and `to_xarray` are its rows.

    Raises:
        InputError: It is not a folder of a sweep, its `sweep.json` was changed, or polars is not
            installed.
    """
    need("polars", "data", "read_sweep")
    manifest = Manifest.read(directory, KIND)
    content = manifest.document
    try:
        robot = from_table(content["robot"])
        plan = plan_from_table({**content["plan"], "robot": robot.name})
        sketches = {str(name): Sketch() for name in content["columns"]}
    except (InputError, LookupError, TypeError, AttributeError):
        raise damaged(Path(directory, "sweep.json")) from None
    pieces: list[int] = []
    codes = np.zeros(len(CODES), int)
    failures: list[int] = []
    keep = max(plan.output.extremes, 1)
    for head in heads(directory, manifest):
        pieces.append(head["piece"])
        codes += head["codes"]
        failures += head["failures"][: plan.output.failures - len(failures)]
        add_to(sketches, head, keep)
    counts: dict[str, int] = dict(zip(CODES, codes.tolist(), strict=True))
    return Sweep(Path(directory), manifest, plan, robot, tuple(pieces), counts, failures, sketches)
