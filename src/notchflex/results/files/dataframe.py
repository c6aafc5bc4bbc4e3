"""A path as a data frame and as a Parquet table: the columns of the CSV, one row per step.

The head of a Parquet table also holds the record that reads the path back.
"""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Generator, Mapping, Sequence
from importlib import import_module
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._extras import need
from notchflex._replacing import replacing
from notchflex.errors import InputError
from notchflex.results.files.csv import path_columns
from notchflex.results.files.record import Record, decoded, encoded, record_of

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

LIBRARIES = ("polars", "pandas")
_KEY = "notchflex"


def dataframe_of(path: EquilibriumPath, library: str = "polars") -> Any:
    """Return a path as a data frame; see `EquilibriumPath.to_dataframe`."""
    return frame(path_columns(path), library)


def frame(columns: Mapping[str, Any], library: str) -> Any:
    """Return columns as a data frame of "polars" or "pandas"."""
    if library not in LIBRARIES:
        raise InputError.UNKNOWN_NAME(
            f"to_dataframe makes a table of polars or pandas; got {library!r}"
        )
    need(library, "data", f"to_dataframe({library!r})")  # xarray, of the same extra, needs pandas
    columns = {name: np.asarray(values) for name, values in columns.items()}
    if library == "polars":
        import polars

        return polars.DataFrame(columns, nan_to_null=True)
    return import_module("pandas").DataFrame(columns)


def write_parquet(target: str | FilePath, path: EquilibriumPath) -> None:
    """Write a path as a Parquet table, one row a step, units in the names of the columns.

    Raises:
        InputError: polars is not installed, or the file cannot be written.
    """
    need("polars", "data", "Parquet")
    table = dataframe_of(path)
    head = {_KEY: json.dumps(encoded(record_of(path)))}
    buffer = io.BytesIO()  # polars has errors of its own where a disk is full
    table.write_parquet(buffer, metadata=head)
    with replacing(target) as temporary:
        temporary.write_bytes(buffer.getbuffer())


def read_columns(file: str | FilePath) -> Mapping[str, Sequence[Any]]:
    """Return the columns of a Parquet table.

    Raises:
        InputError: polars is not installed, or the file is not a Parquet table.
    """
    with _reading(file) as polars:
        return polars.read_parquet(FilePath(file)).to_dict(as_series=False)


def read_head(file: str | FilePath) -> Record:
    """Return the record in the head of a Parquet table.

    Raises:
        InputError: polars is not installed, the file is not a Parquet table or has no record.
    """
    with _reading(file) as polars:
        head = polars.read_parquet_metadata(FilePath(file))
    if _KEY not in head:
        raise InputError.FILE_FORMAT(
            f"{file} has no path of notchflex in its head; give a file that --parquet or "
            "save_path wrote, or read its columns with notchflex.read_table."
        )
    try:
        document = json.loads(head[_KEY])
    except ValueError:
        raise InputError.FILE_DAMAGED(
            f"{file} is damaged: its head is not JSON; write it again."
        ) from None
    return decoded(document, str(file))


@contextlib.contextmanager
def _reading(file: str | FilePath) -> Generator[Any]:
    """Yield polars; what it raises for a file that it cannot read becomes an `InputError`."""
    need("polars", "data", "Parquet")
    import polars
    from polars.exceptions import PolarsError

    try:
        yield polars
    except FileNotFoundError:
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.") from None
    except (OSError, PolarsError) as problem:
        words = " ".join(str(problem).split())
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read as Parquet: {words}.") from None
