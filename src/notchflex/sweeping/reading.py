"""Reading a sweep from its folder."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from notchflex._extras import need
from notchflex.errors import InputError
from notchflex.pieces.codes import CODES
from notchflex.pieces.folder import check_own, head_of, manifest_in
from notchflex.pieces.piece import piece_file
from notchflex.pieces.sketch import Scale, Sketch
from notchflex.sweeping.manifest import KIND, SweepManifest
from notchflex.sweeping.result import Sweep


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
