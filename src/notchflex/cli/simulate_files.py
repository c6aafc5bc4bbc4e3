"""The files of `notchflex simulate` beside JSON: what is special to each, and writing them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notchflex._extras import need
from notchflex.cli import terminal
from notchflex.cli.outputs import Outputs
from notchflex.errors import InputError
from notchflex.results.files.writing import BROWSER, MOVING, PAPER, STANDARD_OUTPUT, replacing

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath


def pictures(*, several: bool) -> tuple[str, ...]:
    """Return the suffixes of pictures; several robots beside each other are not animated."""
    return PAPER + BROWSER + (() if several else MOVING)


def check(outputs: Outputs, *, steps: int) -> None:
    """Check what a kind of file needs."""
    targets = outputs.targets
    if steps < 2 and _is_animation(targets.get("plot", "")):
        raise InputError.FILE_FORMAT(
            f"--plot {targets['plot']}: one step cannot be animated; write a .png, .svg or .pdf."
        )
    for name in ("nc", "parquet"):
        if targets.get(name) == STANDARD_OUTPUT:
            raise InputError.FILE_FORMAT(
                f"--{name} - : a binary file cannot go to standard output; name a file."
            )
    if "nc" in targets:
        from notchflex.results.files.io import need_netcdf

        need_netcdf("--nc")
    if "parquet" in targets:
        need("polars", "data", "--parquet")


def write(paths: Mapping[str, EquilibriumPath], outputs: Outputs, title: str) -> None:
    """Write what was asked for: JSON and picture of all paths, other files of the first.

    Args:
        paths: Label to path.
        outputs: What was asked for.
        title: The heading of the picture.
    """
    path = next(iter(paths.values()))
    outputs.write_json(lambda: _document(paths))
    if target := outputs.targets.get("csv"):
        from notchflex.results.files.csv import write_path_csv

        write_path_csv(target, path)
    if target := outputs.targets.get("nc"):
        from notchflex.results.files.io import write_netcdf

        write_netcdf(target, path)
    if target := outputs.targets.get("parquet"):
        from notchflex.results.files.parquet import write_parquet

        write_parquet(target, path)
    target = outputs.targets.get("plot", "")
    if _is_animation(target):
        with terminal.counting(f"drawing {target}") as counted:
            from notchflex.plotting import save_animation

            save_animation(path, target, title=title, progress=counted)
    else:
        outputs.save_picture(lambda: _picture(paths, title))
    if target := outputs.targets.get("save_state"):
        with replacing(target) as temporary:
            path.state.save(temporary)


def _document(paths: Mapping[str, EquilibriumPath]) -> dict[str, Any]:
    from notchflex.results.files.io import whole_document

    (_, first), *others = paths.items()
    beside = {label: whole_document(other) for label, other in others}
    return whole_document(first) | ({"beside": beside} if beside else {})


def _picture(paths: Mapping[str, EquilibriumPath], title: str) -> Any:
    from notchflex.plotting import beside_picture, path_picture

    first, *others = paths.values()
    if not others:
        return path_picture(first, title=title)
    names = [title, *(other.robot.name for other in others)]
    return beside_picture(paths, title="; ".join(dict.fromkeys(names)))


def _is_animation(target: str) -> bool:
    return Path(target).suffix.lower() in MOVING
