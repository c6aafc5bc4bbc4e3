"""The files of `notchflex simulate`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notchflex.cli import terminal
from notchflex.cli.outputs import Outputs
from notchflex.support import MOVING, replacing

if TYPE_CHECKING:
    from notchflex import Bands, EquilibriumPath


def write(
    paths: Mapping[str, EquilibriumPath], outputs: Outputs, title: str, bands: Bands | None = None
) -> None:
    """Write what was asked for: JSON and picture of all paths, other files of the first.

    Bands of tolerances go to JSON, CSV and the picture.
    """
    from notchflex.support import write_netcdf, write_parquet, write_path_csv

    path = next(iter(paths.values()))
    outputs.write_json(lambda: _document(paths, bands))
    writers = {"csv": write_path_csv, "nc": write_netcdf, "parquet": write_parquet}
    if bands:
        from notchflex.analysis.bands import band_columns

        writers["csv"] = partial(write_path_csv, more=band_columns(bands))
    for name, writer in writers.items():
        if target := outputs.targets.get(name):
            writer(target, path)
    target = outputs.targets.get("plot", "")
    if is_animation(target):
        with terminal.counting(f"drawing {target}") as counted:
            from notchflex.plotting import save_animation

            save_animation(path, target, title=title, progress=counted)
    else:
        outputs.save_picture(lambda: _picture(paths, title, bands))
    if target := outputs.targets.get("save_state"):
        with replacing(target) as temporary:
            path.state.save(temporary)


def is_animation(target: str) -> bool:
    """Return whether a picture moves."""
    return Path(target).suffix.lower() in MOVING


def _document(paths: Mapping[str, EquilibriumPath], bands: Bands | None) -> dict[str, Any]:
    from notchflex.support import whole_document

    (_, first), *others = paths.items()
    beside = {label: whole_document(other) for label, other in others}
    document = whole_document(first) | ({"beside": beside} if beside else {})
    if bands:
        from notchflex.analysis.bands import band_document

        document["bands"] = band_document(bands)
    return document


def _picture(paths: Mapping[str, EquilibriumPath], title: str, bands: Bands | None) -> Any:
    from notchflex.plotting import beside_picture, path_picture

    first, *others = paths.values()
    if not others:
        return path_picture(first, title=title, bands=bands)
    names = [title, *(other.robot.name for other in others)]
    return beside_picture(paths, title="; ".join(dict.fromkeys(names)))
