"""The files that `notchflex simulate` writes: checked before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

from notchflex._extras import need
from notchflex.cli import terminal
from notchflex.errors import InputError
from notchflex.results.files.writing import (
    BROWSER,
    MOVING,
    PAPER,
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
    replacing,
)

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath

Outputs = Mapping[str, str | None]
"""Option, such as `--json`, to the file that it names; None where it was not given."""


def check_files(outputs: Outputs, inputs: Sequence[FilePath], *, steps: int, several: bool) -> None:
    """Check that every file can be written.

    Args:
        outputs: What is to be written.
        inputs: Files that are read, and must not be replaced.
        steps: How many steps the path has.
        several: Whether there are other robots beside the first.

    Raises:
        InputError: One of them cannot be written, or two are the same.
    """
    check_distinct(dict(outputs))
    for option, target in outputs.items():
        if target is None:
            continue
        if option == "--plot":
            kinds = PAPER + BROWSER + (() if several else MOVING)
            check_picture(target, option, inputs=inputs, kinds=kinds)
            if steps < 2 and _moves(target):
                raise InputError.FILE_FORMAT(
                    f"--plot {target}: one step does not move; write a .png, .svg or .pdf."
                )
            continue
        if option in ("--nc", "--parquet") and target == STANDARD_OUTPUT:
            raise InputError.FILE_FORMAT(f"{option} - : this is no text; name a file.")
        check_output(target, option, inputs=inputs)
        if option == "--nc":
            from notchflex.results.files.io import need_netcdf

            need_netcdf(option)
        if option == "--parquet":
            need("polars", "data", option)


def write_files(paths: Mapping[str, EquilibriumPath], outputs: Outputs, title: str) -> None:
    """Write what was asked for: table, JSON and picture of all paths, other files of the first.

    Args:
        paths: Label to path.
        outputs: What is to be written.
        title: The heading of the picture.

    Raises:
        InputError: A file cannot be written.
    """
    path, *others = paths.values()
    if target := outputs["--json"]:
        from notchflex.results.files.io import whole_document
        from notchflex.results.files.json import write_json

        document = whole_document(path)
        if others:
            rest = list(paths.items())[1:]
            document["beside"] = {label: whole_document(other) for label, other in rest}
        write_json(target, document)
    if target := outputs["--csv"]:
        from notchflex.results.files.csv import write_path_csv

        write_path_csv(target, path)
    if target := outputs["--nc"]:
        from notchflex.results.files.io import write_netcdf

        write_netcdf(target, path)
    if target := outputs["--parquet"]:
        from notchflex.results.files.parquet import write_parquet

        write_parquet(target, path)
    if target := outputs["--plot"]:
        _draw(paths, target, title)
    if target := outputs["--save-state"]:
        with replacing(target) as temporary:
            path.state.save(temporary)


def _moves(target: str) -> bool:
    return FilePath(target).suffix.lower() in MOVING


def _draw(paths: Mapping[str, EquilibriumPath], target: str, title: str) -> None:
    path, *others = paths.values()
    if _moves(target):
        with terminal.counting(f"drawing {target}") as counted:
            from notchflex.plotting import save_animation

            save_animation(path, target, title=title, progress=counted)
        return
    with terminal.working(f"drawing {target}"):
        from notchflex.plotting import beside_picture, path_picture

        if others:
            names = [title, *(other.robot.name for other in others)]
            picture = beside_picture(paths, title="; ".join(dict.fromkeys(names)))
        else:
            picture = path_picture(path, title=title)
        picture.save(target)
