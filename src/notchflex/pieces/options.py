"""Folder and workers of a computation in pieces."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Self

from notchflex.errors import InputError
from notchflex.loads.validation import short_repr
from notchflex.pieces.piece import PieceTask
from notchflex.pieces.run import Progress, check_workers, open_folder, run_pieces


@dataclass(frozen=True)
class PieceFolder:
    """A folder that keeps the finished pieces of a long computation, and who works on them.

    The same call resumes an interrupted computation.

    Args:
        directory: The folder; it is made if it is missing.
        workers: Number of processes of dask on this machine; this process alone if None.
        scheduler: Address of a scheduler of dask, whose workers see the same folder.

    Raises:
        InputError: Workers or scheduler cannot be used, or an extra is missing.
    """

    directory: str | os.PathLike[str]
    workers: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        """Check workers and scheduler."""
        if not isinstance(self.directory, str | os.PathLike):  # pyright: ignore
            raise InputError.WRONG_TYPE(
                f"folder must be the path of a folder; got {short_repr(self.directory)}"
            )
        check_workers(self.workers, self.scheduler)

    @classmethod
    def of(cls, folder: PieceFolder | str | os.PathLike[str]) -> Self:
        """Return a folder, given as one or as its path."""
        return folder if isinstance(folder, cls) else cls(folder)  # pyright: ignore

    def run(
        self,
        task: PieceTask,
        *,
        pieces: range | None = None,
        cores: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Work on those pieces of a task that are not there.

        Args:
            task: The task.
            pieces: The pieces; all where not given.
            cores: Number of threads; one per core where not given.
            progress: As for `run_pieces`.
        """
        open_folder(task, self.directory, "--folder")
        run_pieces(
            task,
            self.directory,
            pieces=pieces,
            workers=self.workers,
            scheduler=self.scheduler,
            cores=cores,
            progress=progress,
        )
