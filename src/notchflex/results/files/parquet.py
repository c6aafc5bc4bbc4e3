"""A path as a Parquet table: the columns of the CSV, and in its head all that reads it back."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.results.files.dataframe import dataframe_of
from notchflex.results.files.record import Record, decoded, encoded, record_of
from notchflex.results.files.writing import replacing

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

_KEY = "notchflex"


def write_parquet(target: str | FilePath, path: EquilibriumPath) -> None:
    """Write a path as a Parquet table, one row a step, units in the names of the columns.

    Raises:
        InputError: polars is not installed, or the file cannot be written.
    """
    need("polars", "data", "Parquet")
    table = dataframe_of(path)
    head = {_KEY: json.dumps(encoded(record_of(path)))}
    with replacing(target) as temporary:
        table.write_parquet(temporary, metadata=head)


def read_columns(file: str | FilePath) -> Mapping[str, Sequence[Any]]:
    """Return the columns of a Parquet table.

    Raises:
        InputError: polars is not installed, or the file is no such table.
    """
    need("polars", "data", "Parquet")
    import polars

    with _told(file):
        return polars.read_parquet(FilePath(file)).to_dict(as_series=False)


def read_head(file: str | FilePath) -> Record:
    """Return the record in the head of a Parquet table.

    Raises:
        InputError: polars is not installed, the file is no such table or has no record.
    """
    need("polars", "data", "Parquet")
    import polars

    with _told(file):
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
            f"{file} is damaged: its head is no JSON; write it again."
        ) from None
    return decoded(document, str(file))


@contextlib.contextmanager
def _told(file: str | FilePath) -> Generator[None]:
    """Turn what polars raises for a file that is no table into a sentence."""
    from polars.exceptions import PolarsError

    try:
        yield
    except FileNotFoundError:
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.") from None
    except (OSError, PolarsError) as problem:
        words = " ".join(str(problem).split())
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read as Parquet: {words}.") from None
