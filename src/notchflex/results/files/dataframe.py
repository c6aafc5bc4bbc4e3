"""A path as a data frame of polars or pandas: the columns of the CSV, one row per step."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.results.files.csv import path_columns

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

LIBRARIES = ("polars", "pandas")


def dataframe_of(path: EquilibriumPath, library: str = "polars") -> Any:
    """Return a path as a data frame; see `EquilibriumPath.to_dataframe`.

    Args:
        path: Solved path.
        library: "polars" or "pandas".

    Raises:
        InputError: There is no such library, or it is not installed.
    """
    if library not in LIBRARIES:
        raise InputError.UNKNOWN_NAME(
            f"to_dataframe makes a table of polars or pandas; got {library!r}"
        )
    need(library, "data", f"to_dataframe({library!r})")  # xarray, of the same extra, needs pandas
    columns = {name: np.asarray(values) for name, values in path_columns(path).items()}
    if library == "polars":
        import polars

        return polars.DataFrame(columns, nan_to_null=True)
    return import_module("pandas").DataFrame(columns)
