"""Options of long computations that keep finished pieces in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli.arguments.conversion import converted
from notchflex.support import parse_whole

if TYPE_CHECKING:
    from notchflex.pieces import PieceFolder

PIECES = Group("In pieces", sort_key=7)

Workers = Annotated[
    int | None,
    converted(parse_whole(1, 1024), "N"),
    Parameter(help="Work in this number of processes of this machine; by default in one process."),
]
Scheduler = Annotated[
    str | None,
    Parameter(
        metavar="ADDRESS",
        help="Work with the workers of a dask scheduler, such as tcp://10.0.0.1:8786; all see "
        "the same folder (extra `cluster`).",
    ),
]


@Parameter(name="*", group=PIECES)
@dataclass(frozen=True)
class InPieces:
    """Folder and workers of a computation in pieces."""

    folder: Annotated[
        str | None,
        Parameter(
            metavar="DIR",
            help="Work in pieces, and keep those that are finished in this folder (extra `data`): "
            "the same call resumes where it was stopped.",
        ),
    ] = None
    workers: Workers = None
    scheduler: Scheduler = None

    def chosen(self, kind: str, inputs: Iterable[str | os.PathLike[str]]) -> PieceFolder | None:
        """Return the folder, None if none is given; nothing is written.

        Args:
            kind: What is computed, as in the manifest.
            inputs: Files that are read.

        Raises:
            InputError: Options that exclude each other or need the folder, or a folder that cannot
                be used.
        """
        if self.folder is None:
            for name in ("workers", "scheduler"):
                if getattr(self, name) is not None:
                    raise InputError.MISSING_VALUE(
                        f"--{name} needs --folder DIR, where all workers put their pieces."
                    )
            return None
        if self.workers is not None and self.scheduler is not None:
            raise InputError.CONFLICT(
                "--workers and --scheduler exclude each other; give one of them."
            )
        from notchflex.pieces import PieceFolder, check_target

        check_target(self.folder, kind, "--folder", [os.fspath(one) for one in inputs])
        return PieceFolder(self.folder, self.workers, self.scheduler)
