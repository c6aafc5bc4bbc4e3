"""A folder of pieces: its manifest, its lock, and which pieces are there."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import Any

from notchflex.errors import InputError
from notchflex.pieces.checksum import is_whole
from notchflex.pieces.manifest import Manifest
from notchflex.pieces.piece import KEY, Done, done_of, piece_file
from notchflex.results.files.writing import check_folder, read_text, write_text

PIECES, LOCK = "pieces", ".lock"

_OF_MANIFEST = 2**40
"""The byte of the lock that locks the manifest, behind those of all pieces."""


class _Held:
    """Ranges of pieces that this process works on: the system's locks do not tell its threads."""

    ranges: list[tuple[Path, int, int]] = []  # noqa: RUF012 - one for the process


def manifest_file(folder: str | os.PathLike[str], kind: str) -> Path:
    """Return the file of the manifest, such as "sweep.json"."""
    return Path(folder) / f"{kind}.json"


def manifest_in(folder: str | os.PathLike[str], kind: str) -> Manifest:
    """Read the manifest of a folder.

    Raises:
        InputError: There is none, or it cannot be read.
    """
    file, what = manifest_file(folder, kind), f"{folder} is not a folder of a {kind}"
    if not Path(folder).is_dir():
        raise InputError.FILE_NOT_FOUND(f"{what}: there is no such folder.")
    if not file.exists():
        raise InputError.FILE_NOT_FOUND(f"{what}: it has no {file.name}.")
    return Manifest.read(read_text(file, "manifest"), str(file), kind)


def check_target(
    folder: str | os.PathLike[str], kind: str, option: str, inputs: Iterable[str | Path] = ()
) -> None:
    """Raise if pieces cannot be written into a folder; nothing is changed.

    Args:
        folder: The folder; it may be missing, empty, or hold pieces.
        kind: What is computed, as in the manifest.
        option: What messages call the folder.
        inputs: Files that are read.

    Raises:
        InputError: It cannot be written, or it holds other files.
    """
    file = manifest_file(folder, kind)
    check_folder(os.fspath(folder), (file.name, LOCK), option, inputs=inputs)
    path = Path(folder)
    if path.is_dir() and not file.exists():
        others = sorted(one.name for one in path.iterdir() if one.name not in (PIECES, LOCK))
        if others:
            raise InputError.FILE_UNWRITABLE(
                f"{option} {folder} holds other files, such as {others[0]}; give an empty "
                "folder, or one that is not there."
            )


def prepare_folder(folder: str | os.PathLike[str], manifest: Manifest) -> None:
    """Make the folder of pieces, or check that it is that of these.

    Raises:
        InputError: It holds others, or cannot be made.
    """
    path, kind = Path(folder), manifest.kind
    file = manifest_file(folder, kind)
    if file.exists():
        manifest.check_same(manifest_in(path, kind), str(folder))
    try:
        (path / PIECES).mkdir(parents=True, exist_ok=True)
        lock = open(path / LOCK, "ab")  # noqa: SIM115 - held below
    except OSError as problem:
        words = problem.strerror or problem
        raise InputError.FILE_UNWRITABLE(f"{folder} cannot be made: {words}.") from None
    with lock:  # of two clients that begin at once the second finds the manifest of the first
        _lock(lock, _OF_MANIFEST, 1, wait=True)
        if file.exists():
            manifest.check_same(manifest_in(path, kind), str(folder))
        else:
            write_text(file, manifest.text)


@contextlib.contextmanager
def locked(folder: str | os.PathLike[str], first: int, last: int) -> Generator[None]:
    """Hold the pieces from `first` to `last` (not included) of a folder for this process.

    The system gives the lock back when the process ends, however it ends.

    Raises:
        InputError: Another process holds some of them.
    """
    path = Path(os.path.realpath(folder))
    taken = InputError.CONFLICT(
        f"{folder} is being written by another process; wait for its end, or take another folder."
    )
    if any(p == path and first < b and a < last for p, a, b in _Held.ranges):
        raise taken
    try:
        file = open(path / LOCK, "ab")  # noqa: SIM115 - held below
    except OSError as problem:
        words = problem.strerror or problem
        raise InputError.FILE_UNWRITABLE(f"{folder} cannot be locked: {words}.") from None
    mine = (path, first, last)
    try:
        try:
            _lock(file, first, last - first)
        except OSError:
            raise taken from None
        _Held.ranges.append(mine)
        try:
            yield
        finally:
            _Held.ranges.remove(mine)
    finally:
        file.close()


def _lock(file: Any, first: int, count: int, *, wait: bool = False) -> None:
    """Lock so many bytes of a file, one for each piece, until it is closed."""
    if sys.platform == "win32":
        import msvcrt

        file.seek(first)
        msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, count)
        return
    import fcntl

    how = fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB
    fcntl.lockf(file.fileno(), how, count, first)


def tidy(folder: str | os.PathLike[str], kind: str, first: int, last: int) -> None:
    """Remove what killed processes left of pieces half written."""
    for file in (Path(folder) / PIECES).glob(".piece-*"):
        number = file.name.split("-")[1]
        if number.isdecimal() and first <= int(number) < last:
            file.unlink(missing_ok=True)
    for pattern in (f".{kind}-*.json", ".summary-*.json"):
        for file in Path(folder).glob(pattern):
            file.unlink(missing_ok=True)


def head_of(file: Path, manifest: Manifest, piece: int) -> dict[str, Any] | None:
    """Return the head of a piece, None where its file is missing, damaged or of another sweep."""
    head = _any_head(file)
    if head is None or (head["sweep"], head["piece"]) != (manifest.digest, piece):
        return None
    return head


def _any_head(file: Path) -> dict[str, Any] | None:
    """Return the head of a piece of any sweep, None where its file is missing or damaged."""
    import polars
    from polars.exceptions import PolarsError

    if not file.exists():
        return None
    try:
        return json.loads(polars.read_parquet_metadata(file)[KEY])
    except (OSError, PolarsError, KeyError, ValueError):
        return None


def check_own(folder: str | os.PathLike[str], manifest: Manifest) -> None:
    """Raise if finished pieces belong to another manifest: that in the folder was changed.

    Raises:
        InputError: There is such a piece.
    """
    for file in sorted((Path(folder) / PIECES).glob("piece-*.parquet")):
        head = _any_head(file)
        if head is not None and head["sweep"] != manifest.digest:
            raise InputError.FILE_DAMAGED(
                f"{folder} cannot be read: its {manifest.kind}.json was changed after "
                f"{file.name} was written; put the former file back, or take another folder."
            )


def finished_head(folder: str | os.PathLike[str], manifest: Manifest, piece: int) -> dict[str, Any]:
    """Return the head of a piece that was finished.

    Raises:
        InputError: Its file is gone, or damaged.
    """
    head = head_of(piece_file(folder, piece), manifest, piece)
    if head is None:
        raise InputError.FILE_DAMAGED(
            f"{folder} lost its piece {piece} while it was read; call again."
        )
    return head


def done_piece(folder: str | os.PathLike[str], manifest: Manifest, piece: int) -> Done | None:
    """Return what became of a piece that is there already, None if it is not or is damaged."""
    file = piece_file(folder, piece)
    head = head_of(file, manifest, piece)
    if head is None:
        return None
    try:
        data = bytearray(file.read_bytes())
    except OSError:
        return None
    return done_of(manifest, head, len(data)) if is_whole(memoryview(data)) else None
