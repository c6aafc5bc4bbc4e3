"""A sweep as it lies in its folder: what it is, its rows, and what is summed up of them."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from jaxtyping import Int

from notchflex import InputError, Robot
from notchflex.pieces.folder import CODES, Manifest, check_own, head_of, manifest_in, piece_file
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.support import (
    Displayed,
    Summary,
    from_table,
    nearest,
    need,
    short,
    to_table,
    write_json,
)
from notchflex.sweeping.plan import SweepPlan, plan_from_table, plan_table
from notchflex.sweeping.rows import SweepModel, axis_values
from notchflex.tolerancing.study import piece_rows

if TYPE_CHECKING:
    from polars import DataFrame, LazyFrame
    from xarray import Dataset


KIND = "sweep"


class SweepManifest(Manifest):
    """Manifest of a sweep."""

    @classmethod
    def of(cls, plan: SweepPlan, robot: Robot, model: SweepModel) -> SweepManifest:
        """Make the manifest of a plan.

        Args:
            plan: The plan.
            robot: The robot that it names.
            model: The model of both.
        """
        table = plan_table(plan)
        return cls.made(
            KIND,
            plan.rows,
            plan.piece or piece_rows(plan.rows, model),
            plan={key: value for key, value in table.items() if key != "robot"},
            robot=to_table(robot),
            columns=list(model.columns),
        )

    @property
    def plan(self) -> SweepPlan:
        """The plan; its robot is only a name."""
        return plan_from_table({**self.document["plan"], "robot": self.document["robot"]["name"]})

    @property
    def robot(self) -> Robot:
        """The robot that is varied."""
        return from_table(self.document["robot"])


SUMMARY = "summary.json"
_MAX_XARRAY = 100_000_000


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Displayed):
    """A sweep in its folder, finished or not.

    Attributes:
        directory: The folder.
        manifest: What the sweep is.
        pieces: Numbers of the pieces that are there.
        counts: How many rows have each code.
        failures: Numbers of the first rows without a result, as many as the plan asks for.
        sketches: Statistics of every kept quantity.
        scales: Scales of the statistics.
    """

    directory: Path
    manifest: SweepManifest
    pieces: tuple[int, ...]
    counts: dict[str, int]
    failures: list[int]
    sketches: dict[str, Sketch]
    scales: dict[str, Scale]

    @property
    def plan(self) -> SweepPlan:
        """The plan."""
        return self.manifest.plan

    @property
    def robot(self) -> Robot:
        """The robot that is varied."""
        return self.manifest.robot

    @property
    def rows(self) -> int:
        """Rows that are there."""
        return sum(b - a for a, b in map(self.manifest.between, self.pieces))

    @property
    def finished(self) -> bool:
        """Whether all pieces are there."""
        return len(self.pieces) == self.manifest.pieces

    @property
    def columns(self) -> list[str]:
        """Names of the kept quantities, with their units."""
        return self.manifest.document["columns"]

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
        files = [piece_file(self.directory, piece) for piece in self.pieces]
        if not self.plan.output.rows:
            return polars.scan_parquet(files)
        if self.finished and self.manifest.rows < 2**32:  # an index of polars has 32 bits
            row = polars.col("row").cast(polars.Int64)
            return polars.scan_parquet(files).with_row_index("row").with_columns(row)
        return polars.concat([self._numbered(piece) for piece in self.pieces])

    def _numbered(self, piece: int) -> LazyFrame:
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

        if not self.finished or not self.plan.output.rows or self.manifest.rows > _MAX_XARRAY:
            raise InputError.UNSUPPORTED(
                "to_xarray needs all rows of a finished sweep, at most 1e8; use lazy()."
            )
        plan, frame = self.plan, self.lazy().collect()
        axes = {one.value: axis_values(one) for one in plan.grid}
        sizes = [len(one) for one in axes.values()]
        dimensions = list(axes)
        if plan.sampled:
            dimensions.append("point")
            sizes.append(cast("Any", plan.sampling).points)
        values: dict[str, Any] = {
            name: (dimensions, frame[name].to_numpy().reshape(sizes)) for name in self.columns
        }
        values["code"] = (dimensions, frame["code"].cast(str).to_numpy().reshape(sizes).astype(str))
        for one in plan.sampled:
            column = frame[one.value].to_numpy().reshape(sizes)
            values[one.value] = (["point"], column[(0,) * len(axes)])
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
        import polars

        sketch = self.sketches[self._column(column)]
        pairs = (sketch.largest if largest else sketch.smallest)[: self.plan.output.extremes]
        return self._rows([row for _, row in pairs]).sort(
            polars.col(column), descending=largest, maintain_order=True
        )

    def first_failures(self) -> DataFrame:
        """Return the first rows without a result."""
        return self._rows(self.failures)

    def quantiles(self, column: str, parts: Sequence[float] | None = None) -> list[float]:
        """Return quantiles of a kept quantity, exact to 1/1000 of half the range of most values.

        Args:
            column: Name of the quantity, as in `columns`.
            parts: Numbers between 0 and 1; those of the plan if None.
        """
        sketch = self.sketches[self._column(column)]
        levels = self.plan.output.quantiles if parts is None else parts
        return [sketch.quantile(part, self.scales[column]) for part in levels]

    def histogram(self, column: str, bins: int | None = None) -> tuple[list[float], list[int]]:
        """Return edges and counts of a histogram of a kept quantity.

        Args:
            column: Name of the quantity, as in `columns`.
            bins: Number of bins; that of the plan if None.
        """
        sketch = self.sketches[self._column(column)]
        return sketch.histogram(
            self.plan.output.bins if bins is None else bins, self.scales[column]
        )

    def _column(self, name: str) -> str:
        if name not in self.columns:
            raise InputError.UNKNOWN_NAME(
                f'no quantity "{name}" is kept{nearest(name, self.columns)}; there are '
                f"{', '.join(self.columns)}."
            )
        return name

    def _rows(self, rows: Sequence[int]) -> DataFrame:
        """Read rows by their numbers, from the pieces that hold them."""
        import polars

        selected: Int[np.ndarray, " k"] = np.array(sorted(rows), np.int64)
        frames: list[DataFrame] = []
        size = self.manifest.document["piece"]
        for piece in np.unique(selected // size).tolist():
            inside = polars.col("row").is_in(selected[selected // size == piece].tolist())
            frames.append(self._numbered(piece).filter(inside).collect())
        return polars.concat(frames) if frames else self.lazy().head(0).collect()

    def document(self) -> dict[str, Any]:
        """Return what is summed up of all rows, as plain values."""
        columns: dict[str, Any] = {}
        for name, one in self.sketches.items():
            edges, counts = self.histogram(name)
            mean = one.total / one.count if one.count else math.nan
            variance = max(one.squares / one.count - mean**2, 0.0) if one.count else math.nan
            scale = self.scales.get(name, Scale(0.0, 1.0))
            columns[name] = {
                "count": one.count,
                "mean": mean + scale.middle,
                "sd": math.sqrt(variance) if one.count else math.nan,
                "smallest": one.smallest[0][0] if one.count else math.nan,
                "largest": one.largest[0][0] if one.count else math.nan,
                "quantiles": {
                    f"{part:g}": value
                    for part, value in zip(
                        self.plan.output.quantiles, self.quantiles(name), strict=True
                    )
                },
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
        for name, one in self.sketches.items():
            if one.count:
                rows.append((name, f"{short(one.smallest[0][0])} to {short(one.largest[0][0])}"))
        return Summary(title, rows, ".lazy() is a frame of polars, .to_xarray() a data set")


def write_summary(sweep: Sweep) -> None:
    """Write what is summed up of all rows into the folder, as `summary.json`.

    Raises:
        InputError: It cannot be written.
    """
    write_json(str(sweep.directory / SUMMARY), sweep.document())


def check_content(manifest: SweepManifest, directory: str | os.PathLike[str]) -> None:
    """Raise unless plan, robot and columns can be read from a manifest.

    Raises:
        InputError: Its file was changed.
    """
    try:
        _ = manifest.plan, manifest.robot
        columns = manifest.document["columns"]
        if not isinstance(columns, list) or not all(isinstance(one, str) for one in columns):
            raise TypeError
    except (InputError, LookupError, TypeError, AttributeError):
        raise InputError.FILE_DAMAGED(
            f"{directory} cannot be read: its sweep.json was changed; give the plan again with "
            "another folder."
        ) from None


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
    manifest = SweepManifest(manifest_in(directory, KIND).document)
    check_content(manifest, directory)
    output = manifest.plan.output
    pieces: list[int] = []
    codes = np.zeros(len(CODES), int)
    failures: list[int] = []
    sketches = {name: Sketch() for name in manifest.document["columns"]}
    scales: dict[str, Scale] = {}
    for piece in range(manifest.pieces):
        file = piece_file(directory, piece)
        head = head_of(file, manifest, piece)
        if head is None:
            continue
        pieces.append(piece)
        codes += np.array(head["codes"])
        failures += head["failures"][: output.failures - len(failures)]
        scales = {name: Scale(*pair) for name, pair in head["scales"].items()}
        for name, document in head["columns"].items():
            sketches[name] = sketches[name].merged(Sketch.read(document), output.extremes)
    if not pieces:
        check_own(directory, manifest)
    counts: dict[str, int] = dict(zip(CODES, codes.tolist(), strict=True))
    return Sweep(Path(directory), manifest, tuple(pieces), counts, failures, sketches, scales)
