"""The manifest of a folder of pieces: all that their bytes depend on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any, Self

from notchflex import __version__
from notchflex.errors import InputError
from notchflex.solver.programs.backend import backend, optimisation_level

FORMAT = 1


def versions() -> dict[str, str]:
    """Return versions of what the bytes of pieces depend on."""
    libraries = ("numpy", "scipy", "jax", "llvmlite", "polars")
    return {
        "notchflex": __version__,
        **{name: version(name) for name in libraries},
        "backend": backend(),
        "optimisation": str(optimisation_level()),
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
