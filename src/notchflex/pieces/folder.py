"""A folder of pieces: its manifest, and one Parquet file for each piece."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import io
import json
import os
import sys
import zlib
from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic_core import to_jsonable_python

from notchflex import InputError, __version__
from notchflex.support import (
    AnyPath,
    backend,
    check_folder,
    check_is_path,
    read_text,
    replacing,
    unwritable,
    write_text,
)

if TYPE_CHECKING:
    from polars import DataFrame


CODES = ("accepted", "rejected", "NOT_CONVERGED", "INVALID_ROBOT")
"""Outcome of a row; the last two have no result and count as rejected."""

ACCEPTED, REJECTED, FAILED, INVALID = range(len(CODES))

FORMAT = 1
_PIECES, _LOCK = "pieces", ".lock"
_HEAD, _CHECKSUM = "notchflex-sweep", "notchflex-crc32"
"""Metadata of the file of a piece."""


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
    """All that the bytes of pieces depend on.

    Attributes:
        document: Plain values: `kind` (as in "sweep.json"), `versions`, `rows`, `piece` (rows of a
            piece), `pieces`, and what is computed.
    """

    document: Mapping[str, Any]

    @classmethod
    def of(cls, kind: str, rows: int, piece: int, **content: Any) -> Manifest:
        """Return the manifest of so many rows, and of so many in a piece."""
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
        return cls(to_jsonable_python(document, inf_nan_mode="strings", fallback=_plain))

    @classmethod
    def read(cls, folder: AnyPath, kind: str) -> Manifest:
        """Read the manifest of a folder.

        Raises:
            InputError: There is none of this kind and format.
        """
        check_is_path(folder, f"a folder of a {kind}")
        file = Path(folder) / f"{kind}.json"
        if not file.exists():
            raise InputError.FILE_NOT_FOUND(
                f"{folder} is not a folder of a {kind}: there is no {file}."
            )
        text = read_text(file, "manifest")
        try:
            document = json.loads(text)
            needed = [kind, FORMAT, -(-document["rows"] // document["piece"])]
            there = [document[key] for key in ("kind", "format", "pieces")]
            if there != needed or not dict(document["versions"]):
                raise ValueError
        except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError):
            raise damaged(file) from None
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


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else repr(value)


def damaged(file: Path) -> InputError:
    """Return the error of a manifest that cannot be used."""
    return InputError.FILE_DAMAGED(
        f"{file} is not a manifest of a {file.stem}, or was changed; remove its folder, or take "
        "another one."
    )


class PieceTask:
    """A computation that is cut into pieces, each of which depends on the task and its number.

    It is a data class; its pickle holds its fields, and nothing that was derived from them.
    """

    @cached_property
    def manifest(self) -> Manifest:
        """All that the bytes of pieces depend on."""
        raise NotImplementedError

    def piece(self, number: int) -> tuple[DataFrame, dict[str, Any]]:
        """Return the rows of a piece, and what is summed up of them in plain values.

        `codes` of the latter counts rows by `CODES`. Several threads may compute pieces at once.
        """
        raise NotImplementedError

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields by name."""
        names = [field.name for field in dataclasses.fields(self)]  # pyright: ignore
        return {name: getattr(self, name) for name in names}


def check_target(
    folder: AnyPath, kind: str, option: str, inputs: Iterable[str | Path] = ()
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
    manifest, path = f"{kind}.json", Path(folder)
    check_folder(os.fspath(folder), (manifest, _LOCK), option, inputs=inputs)
    if path.is_dir() and not (path / manifest).exists():
        strange = sorted({file.name for file in path.iterdir()} - {_PIECES, _LOCK})
        if strange:
            raise InputError.FILE_UNWRITABLE(
                f"{option} {folder} holds other files, such as {strange[0]}; give an empty "
                "folder, or one that is not there."
            )


def open_folder(folder: AnyPath, manifest: Manifest) -> None:
    """Make the folder of pieces, or check that it belongs to a manifest.

    Raises:
        InputError: It belongs to another one, or cannot be made.
    """
    file = Path(folder) / f"{manifest.kind}.json"
    with unwritable(f"{folder} cannot be made"):
        (file.parent / _PIECES).mkdir(parents=True, exist_ok=True)
    if not file.exists():
        write_text(file, manifest.text)
    stored = Manifest.read(folder, manifest.kind)
    if stored.digest != manifest.digest:
        there, here = _values(stored.document), _values(manifest.document)
        differing = (name for name in here | there if here.get(name) != there.get(name))
        name = next(differing, "format")
        words = [of.get(name, "not given") for of in (there, here)]
        raise InputError.CONFLICT(
            f"{folder} holds another {manifest.kind}: `{name}` is {words[0]} there and {words[1]} "
            "here; give what it was begun with, or take another folder."
        )


def _values(document: Any, path: str = "") -> dict[str, str]:
    """Return the values of a document by their paths, as JSON: NaN is equal to NaN there."""
    if isinstance(document, list):
        parts = {f"{path}[{place}]": part for place, part in enumerate(document, start=1)}
    elif isinstance(document, Mapping):
        parts = {f"{path}.{key}".lstrip("."): part for key, part in document.items()}
    else:
        return {path: json.dumps(document)}
    return {
        name: value for key, part in parts.items() for name, value in _values(part, key).items()
    }


@contextlib.contextmanager
def locked(folder: AnyPath, pieces: range) -> Generator[None]:
    """Keep other processes from some pieces; the system ends it with this process.

    Raises:
        InputError: Another process works on some of them.
    """
    with unwritable(f"{folder} cannot be locked"):
        file = open(Path(folder) / _LOCK, "ab")  # noqa: SIM115 - closed below
    with file:
        if sys.platform != "win32":  # there both do the same work, with the same files
            import fcntl

            try:
                how = fcntl.LOCK_EX | fcntl.LOCK_NB
                fcntl.lockf(file, how, len(pieces), pieces.start)
            except OSError:
                raise InputError.CONFLICT(
                    f"{folder} is being written by another process; wait for its end, or take "
                    "another folder."
                ) from None
        yield


def piece_file(folder: AnyPath, piece: int) -> Path:
    """Return the file of a piece."""
    return Path(folder) / _PIECES / f"piece-{piece:09d}.parquet"


def encoded(task: PieceTask, piece: int) -> tuple[memoryview, dict[str, Any]]:
    """Return the bytes of the file of a piece, and its head."""
    frame, content = task.piece(piece)
    head = {"sweep": task.manifest.digest, "piece": piece, **content}
    buffer = io.BytesIO()
    metadata = {_HEAD: json.dumps(head), _CHECKSUM: "0" * 8}
    frame.write_parquet(buffer, compression="lz4", statistics=True, metadata=metadata)
    data = buffer.getbuffer()
    place, _, checksum = _checksum(data)
    data[place] = checksum
    return data, head


def _checksum(data: memoryview) -> tuple[slice, bytes, bytes]:
    """Return the place of the checksum in a file, what is there, and what must be there.

    It is a text of eight characters in the footer, written in Thrift's encoding of texts.
    """
    key = _CHECKSUM.encode() + b"\x18\x08"
    footer = len(data) - 8 - int.from_bytes(data[-8:-4], "little")
    start = footer + bytes(data[footer:]).find(key) + len(key)
    place = slice(start, start + 8)
    there = bytes(data[place])
    data[place] = b"0" * len(there)
    return place, there, b"%08x" % zlib.crc32(data)


def write_piece(task: PieceTask, folder: AnyPath, piece: int) -> tuple[int, int]:
    """Work out a piece and write its file; return its number and its rows without a result.

    Raises:
        InputError: The file cannot be written.
    """
    data, head = encoded(task, piece)
    with replacing(piece_file(folder, piece)) as temporary:
        temporary.write_bytes(data)
    return piece, sum(head["codes"][FAILED:])


def stored_piece(folder: AnyPath, manifest: Manifest, piece: int) -> int | None:
    """Return the rows without a result of a piece, None where its file is missing or damaged."""
    if (head := _head(folder, manifest, piece)) is None:
        return None
    data = bytearray(piece_file(folder, piece).read_bytes())
    _, there, needed = _checksum(memoryview(data))
    return sum(head["codes"][FAILED:]) if there == needed else None


def heads(
    folder: AnyPath, manifest: Manifest, needed: range | None = None
) -> Iterator[dict[str, Any]]:
    """Yield the heads of pieces in their order: of those that are there, or of all that are needed.

    Raises:
        InputError: A piece was written for another manifest, or a needed one is not there.
    """
    for piece in range(manifest.pieces) if needed is None else needed:
        if (head := _head(folder, manifest, piece)) is not None:
            yield head
        elif needed is not None:
            raise InputError.FILE_DAMAGED(
                f"{folder} lost its piece {piece} while it was read; call again."
            )


def _head(folder: AnyPath, manifest: Manifest, piece: int) -> dict[str, Any] | None:
    """Return the head of a piece, None where its file is missing or damaged."""
    import polars
    from polars.exceptions import PolarsError

    file = piece_file(folder, piece)
    if not file.exists():
        return None
    try:
        head = json.loads(polars.read_parquet_metadata(file)[_HEAD])
    except (OSError, PolarsError, KeyError, ValueError):
        return None
    if head["sweep"] != manifest.digest:
        raise InputError.FILE_DAMAGED(
            f"{folder} cannot be read: its {manifest.kind}.json was changed after {file.name} "
            "was written; put the former file back, or take another folder."
        )
    return head if head["piece"] == piece else None
