"""A folder of pieces: its manifest, its lock, its pieces, each worked out to one Parquet file."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import io
import json
import os
import sys
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

import numpy as np

from notchflex import InputError, __version__
from notchflex.pieces import checksum
from notchflex.pieces.checksum import is_whole
from notchflex.solver.programs.compiled import backend
from notchflex.support import check_folder, read_text, replacing, unwritable, write_text

if TYPE_CHECKING:
    from polars import DataFrame


FORMAT = 1


def versions() -> dict[str, str]:
    """Return versions of what the bytes of pieces depend on."""
    libraries = ("numpy", "scipy", "jax", "llvmlite", "polars")
    return {
        "notchflex": __version__,
        **{name: version(name) for name in libraries},
        "backend": backend(),
    }


@dataclass(frozen=True, eq=False)
class Manifest:
    """Manifest of a folder of pieces.

    Attributes:
        document: As it is in its file, of plain values: `kind` (as in "sweep.json"), `versions`,
            `rows`, `piece` (rows of a piece), `pieces`, and what is computed.
    """

    document: Mapping[str, Any]

    @classmethod
    def made(cls, kind: str, rows: int, piece: int, **content: Any) -> Self:
        """Make a manifest.

        Args:
            kind: What is computed, such as "sweep".
            rows: Rows of all pieces.
            piece: Rows of a piece.
            content: All else that the bytes depend on, of plain values.
        """
        document = {
            "program": "notchflex",
            "kind": kind,
            "format": FORMAT,
            "versions": versions(),
            **content,
            "rows": rows,
            "piece": piece,
            "pieces": -(-rows // piece),
        }
        return cls(json.loads(json.dumps(document)))

    @classmethod
    def read(cls, text: str, where: str, expected: str) -> Self:
        """Read the text of a manifest.

        Args:
            text: The text.
            where: What messages call it.
            expected: The kind that it must be of.

        Raises:
            InputError: It is not a manifest of this kind, or one of another format.
        """
        damaged = InputError.FILE_DAMAGED(
            f"{where} is not a manifest of a {expected}, or was changed; remove its "
            "folder, or take another one."
        )
        try:
            document = json.loads(text)
            kind, form = document["kind"], document["format"]
        except (ValueError, TypeError, KeyError, RecursionError):
            raise damaged from None
        if kind != expected or form != FORMAT:
            raise InputError.FILE_FORMAT(
                f"{where} is of kind {kind} and format {form}; needed are {expected} and {FORMAT}."
            )
        numbers = [document.get(key) for key in ("rows", "piece", "pieces")]
        if not isinstance(document.get("versions"), dict) or not all(
            isinstance(one, int) and one > 0 for one in numbers
        ):
            raise damaged
        if -(-numbers[0] // numbers[1]) != numbers[2]:
            raise damaged
        return cls(document)

    @cached_property
    def text(self) -> str:
        """The text of its file."""
        return json.dumps(self.document, indent=1, ensure_ascii=False) + "\n"

    @cached_property
    def digest(self) -> str:
        """Mark of every piece."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def kind(self) -> str:
        """Kind of computation, such as "sweep"."""
        return self.document["kind"]

    @property
    def rows(self) -> int:
        """Rows of all pieces."""
        return self.document["rows"]

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return self.document["pieces"]

    def between(self, piece: int) -> tuple[int, int]:
        """Return the first row of a piece and the row behind its last one."""
        size = self.document["piece"]
        return piece * size, min((piece + 1) * size, self.rows)

    def check_versions(self, where: str) -> None:
        """Raise if this process would compute other bytes.

        Raises:
            InputError: The folder was begun with another version of a library.
        """
        begun = self.document["versions"]
        for name, current in versions().items():
            if begun.get(name) != current:
                raise InputError.CONFLICT(
                    f"{where} was begun with {name} {begun.get(name)}, and here is {name} "
                    f"{current}, which may give other digits; go on with the former, or take "
                    "another folder."
                )

    def check_same(self, other: Manifest, where: str) -> None:
        """Raise if other pieces were begun in a folder.

        Args:
            other: The manifest in the folder.
            where: The folder.

        Raises:
            InputError: Anything differs; the message names the first difference.
        """
        other.check_versions(where)
        for key in dict.fromkeys([*self.document, *other.document]):
            difference = _difference(key, self.document.get(key), other.document.get(key))
            if difference:
                raise InputError.CONFLICT(
                    f"{where} holds another {self.kind}: {difference}; take another folder, or "
                    "remove it."
                )


def _difference(path: str, mine: Any, theirs: Any) -> str:
    """Return the first difference in words, "" if there is none."""
    if mine == theirs:
        return ""
    if isinstance(mine, dict) and isinstance(theirs, dict):
        keys = dict.fromkeys([*mine, *theirs])
        differences = (_difference(f"{path}.{key}", mine.get(key), theirs.get(key)) for key in keys)
        return next(one for one in differences if one)
    if isinstance(mine, list) and isinstance(theirs, list) and len(mine) == len(theirs):
        pairs = zip(mine, theirs, strict=True)
        differences = (_difference(f"{path}[{n}]", *pair) for n, pair in enumerate(pairs, start=1))
        return next(one for one in differences if one)
    return f"`{path}` is {_shown(theirs)} there and {_shown(mine)} here"


def _shown(value: Any) -> str:
    text = "not given" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) < 60 else f"{text[:57]}..."


def plain(value: Any) -> Any:
    """Return a value as JSON holds it: fields of objects by name, None for NaN.

    Args:
        value: Numbers, text, arrays, data classes, and mappings and sequences of them.
    """
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if np.isfinite(value) else None if np.isnan(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [one.name for one in dataclasses.fields(value)]
        return {"type": type(value).__name__} | {n: plain(getattr(value, n)) for n in names}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(one) for one in value]
    return repr(value)


CODES = ("accepted", "rejected", "NOT_CONVERGED", "INVALID_ROBOT")
"""Outcome of a robot; the last two meet no limit and count as rejected."""

ACCEPTED, REJECTED, FAILED, INVALID = range(len(CODES))


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
    with unwritable(f"{folder} cannot be made"):
        (path / PIECES).mkdir(parents=True, exist_ok=True)
        lock = open(path / LOCK, "ab")  # noqa: SIM115 - held below
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
    with unwritable(f"{folder} cannot be locked"):
        file = open(path / LOCK, "ab")  # noqa: SIM115 - held below
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
