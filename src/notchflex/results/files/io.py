"""Paths to files and back: `save_path` writes JSON, NetCDF, Parquet or CSV, `read_path` reads."""

from __future__ import annotations

import json
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import numpy as np

from notchflex.errors import InputError
from notchflex.results.files.csv import write_path_csv
from notchflex.results.files.dataframe import read_head, write_parquet
from notchflex.results.files.dataset import read_netcdf, write_netcdf
from notchflex.results.files.json import path_document, plain, write_json
from notchflex.results.files.record import decoded, encoded, path_of, record_of

if TYPE_CHECKING:
    from notchflex.results.path import EquilibriumPath

READ_BACK = "read_back"
"""Key of a JSON document under which the exact numbers stand."""


def save_path(path: EquilibriumPath, file: str | FilePath) -> None:
    """Write a path to a file; by its suffix as JSON, NetCDF, Parquet or CSV.

    JSON, NetCDF and Parquet hold the whole path, and `read_path` makes an equal one of them. CSV
    holds the numbers of every step only, and `read_table` reads those.

    Args:
        path: Solved path.
        file: Where to; ends in .json, .nc, .parquet or .csv. It is written whole or not at all.

    Raises:
        InputError: Another suffix, a library that is not installed, or it cannot be written.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import notchflex as nf
        >>> path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=3))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.save_path(path, Path(folder) / "loop.json")
        ...     again = nf.read_path(Path(folder) / "loop.json")
        >>> bool((again.notch_angle == path.notch_angle).all())
        True
    """
    match FilePath(file).suffix.lower():
        case ".json":
            write_json(file, whole_document(path))
        case ".nc":
            write_netcdf(file, path)
        case ".parquet":
            write_parquet(file, path)
        case ".csv":
            write_path_csv(file, path)
        case _:
            raise _unknown_suffix(file, "written")


def read_path(file: str | FilePath) -> EquilibriumPath:
    """Read a path back from a file; it equals the one that was written, its states too.

    Nothing is solved: every number is that of the file. A simulation continues from `.state` as
    from that of the path that was written.

    Args:
        file: A .json, .nc or .parquet that `notchflex simulate` or `save_path` wrote.

    Returns:
        The path.

    Raises:
        InputError: No such file, a table that holds no path, a file that was changed or damaged.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> import notchflex as nf
        >>> wrist = nf.load_robot("pacheco2021-a")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     nf.save_path(nf.simulate(wrist, nf.pull(0.0, 2.0, steps=3)), f"{folder}/pull.json")
        ...     pulled = nf.read_path(f"{folder}/pull.json")
        >>> round(float(nf.solve(wrist, nf.Load(1.0), from_state=pulled.state).total_angle), 3)
        1.412
    """
    suffix = FilePath(file).suffix.lower()
    if suffix == ".csv":
        raise InputError.FILE_FORMAT(
            f"{file}: a CSV holds the numbers of every step, but neither the robot nor the memory "
            "of its friction, so no path can be made of it. Read its numbers with "
            "notchflex.read_table, or write .json, .nc or .parquet."
        )
    if suffix not in (".json", ".nc", ".parquet"):
        raise _unknown_suffix(file, "read")
    if not FilePath(file).is_file():
        raise InputError.FILE_NOT_FOUND(f"there is no file {file}.")
    if suffix == ".json":
        return _from_json(file)
    return read_netcdf(file) if suffix == ".nc" else path_of(read_head(file), str(file))


def whole_document(path: EquilibriumPath) -> dict[str, Any]:
    """Return a path as the JSON document that can be read back: for people, and for `read_path`."""
    return {**path_document(path), READ_BACK: encoded(record_of(path))}


def _from_json(file: str | FilePath) -> EquilibriumPath:
    try:
        document = json.loads(FilePath(file).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as problem:
        reason = getattr(problem, "strerror", None) or f"it is not JSON ({problem})"
        raise InputError.FILE_UNREADABLE(f"{file} cannot be read: {reason}.") from None
    if not isinstance(document, dict) or READ_BACK not in document:
        raise InputError.FILE_FORMAT(
            f"{file} holds no path that can be read back; give a file that simulate --json or "
            "save_path wrote."
        )
    path = path_of(decoded(document[READ_BACK], str(file)), str(file))
    if not _same_steps(path, document.get("steps")):
        raise InputError.FILE_DAMAGED(
            f"{file}: its steps are not those that its part {READ_BACK!r} holds, so one of them "
            "was changed; write the file again."
        )
    return path


def _same_steps(path: EquilibriumPath, steps: Any) -> bool:
    """Whether the steps of a document are those of a path, but for steps that were not tried.

    Version 0.1.0 wrote zeros for the shape of those, and no `reason_code`.
    """
    expected = plain(path_document(path))["steps"]
    if not isinstance(steps, list) or len(steps) != len(expected):
        return False
    return all(
        isinstance(other, dict) and one == {"reason_code": one["reason_code"], **other}
        for one, other, tried in zip(expected, steps, np.asarray(path.run.tried), strict=True)
        if tried
    )


def _unknown_suffix(file: str | FilePath, done: str) -> InputError:
    suffix = FilePath(file).suffix.lower()
    got = f"the suffix {suffix}" if suffix else "no suffix"
    return InputError.FILE_FORMAT(
        f"{file}: got {got}; a path is {done} as .json, .nc, .parquet or .csv."
    )
