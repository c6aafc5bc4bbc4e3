"""One piece: it is worked out, and written to one Parquet file with a head."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from notchflex._replacing import replacing
from notchflex.pieces import checksum
from notchflex.pieces.codes import FAILED
from notchflex.pieces.manifest import Manifest

if TYPE_CHECKING:
    from polars import DataFrame

KEY = "notchflex-sweep"


class Piece(NamedTuple):
    """Computed content of a piece.

    Attributes:
        frame: Its rows.
        head: What is summed up of them, of plain values; `codes` counts rows by `CODES`.
    """

    frame: DataFrame
    head: dict[str, Any]


class Done(NamedTuple):
    """Outcome of a piece.

    Attributes:
        piece: Its number, from 0.
        rows: Its rows.
        unsolved: Rows without a result.
        size: Bytes of its file.
    """

    piece: int
    rows: int
    unsolved: int
    size: int


class Recipe(NamedTuple):
    """Recipe by which another process makes a task.

    Attributes:
        make: A function of a module.
        content: What it takes: text, or pickled objects.
    """

    make: Callable[[Any], PieceTask]
    content: str | bytes


class PieceTask(Protocol):
    """Work that is cut into pieces, each of which depends on the task and its number alone."""

    @property
    def manifest(self) -> Manifest:
        """All that the bytes of pieces depend on."""
        ...

    @property
    def recipe(self) -> Recipe:
        """Recipe by which another process makes the same task."""
        ...

    def prepare(self) -> None:
        """Do once what all pieces need."""
        ...

    def piece(self, number: int) -> Piece:
        """Work out one piece; several threads may do so at once."""
        ...


@lru_cache(maxsize=2)
def task_of(recipe: Recipe, text: str) -> PieceTask:
    """Return the task of a recipe, prepared; one for a process.

    Args:
        recipe: The recipe.
        text: Text of the manifest.

    Raises:
        InputError: This process would compute other bytes.
    """
    Manifest(json.loads(text)).check_versions("the folder")
    task = recipe.make(recipe.content)
    task.prepare()
    return task


def piece_file(folder: str | os.PathLike[str], piece: int) -> Path:
    """Return the file of a piece."""
    return Path(folder) / "pieces" / f"piece-{piece:09d}.parquet"


def encoded(task: PieceTask, piece: int) -> tuple[memoryview, dict[str, Any]]:
    """Return the bytes of a piece, and its head."""
    frame, content = task.piece(piece)
    head = {"sweep": task.manifest.digest, "piece": piece, **content}
    buffer = io.BytesIO()
    metadata = {KEY: json.dumps(head), checksum.KEY: checksum.BLANK}
    frame.write_parquet(buffer, compression="lz4", statistics=True, metadata=metadata)
    data = buffer.getbuffer()
    checksum.seal(data)
    return data, head


def make_piece(task: PieceTask, folder: str | os.PathLike[str], piece: int) -> Done:
    """Work out a piece and write its file, beside and then renamed.

    Raises:
        InputError: The file cannot be written.
    """
    data, head = encoded(task, piece)
    with replacing(piece_file(folder, piece)) as temporary:
        # polars writes into memory: what the disk refuses is an error of this call alone.
        temporary.write_bytes(data)
    return done_of(task.manifest, head, len(data))


def done_of(manifest: Manifest, head: dict[str, Any], size: int) -> Done:
    """Return what became of a piece, by its head and the bytes of its file."""
    start, stop = manifest.between(head["piece"])
    return Done(head["piece"], stop - start, sum(head["codes"][FAILED:]), size)
