"""Programs that a wheel carries as LLVM text, so that the first call need not trace them.

The text serves every processor and every allowed LLVM; machine code is made when it is first
needed. `packaging/hatch_build.py` records the programs of typical calls when a wheel is built. They
are found by a digest of the code that they were made from.
"""

from __future__ import annotations

import hashlib
import lzma
import os
from pathlib import Path

from notchflex.solver.programs import store

RECORD = "NOTCHFLEX_RECORD_PROGRAMS"
"""Environment variable: the folder to which the text of every program is written."""

FOLDER = store.PACKAGE / "shipped_programs"


def read(key: str) -> bytes | None:
    """Return the content recorded under a key; None where it is missing or damaged."""
    try:
        return lzma.decompress((FOLDER / _name(key)).read_bytes())
    except (OSError, EOFError, lzma.LZMAError):
        return None


def recording() -> bool:
    """Return whether a wheel is being built."""
    return bool(os.environ.get(RECORD))


def record(key: str, content: bytes) -> None:
    """Record content under a key while a wheel is built."""
    if recording():
        folder = os.environ[RECORD]
        (Path(folder) / _name(key)).write_bytes(lzma.compress(content, preset=2))


def count() -> int:
    """Return the number of programs in the package."""
    return sum(1 for _ in FOLDER.glob("*.xz"))


def _name(key: str) -> str:
    digest = hashlib.sha256(f"{store.code_digest()} {key}".encode())
    return f"{digest.hexdigest()[:32]}.xz"
