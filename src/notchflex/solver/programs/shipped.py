"""Programs that a wheel carries as text, so that the first call on a machine need not trace them.

The text is the same for every processor and every LLVM that is allowed; machine code is made of it
when it is first needed. `packaging/hatch_build.py` records the programs of typical calls when a
wheel is built. They are found by a digest of the code that they were made from: after a change of
the code they are not used.
"""

from __future__ import annotations

import hashlib
import lzma
import os
from pathlib import Path

from notchflex.solver.programs import store as _store

RECORD = "NOTCHFLEX_RECORD_PROGRAMS"
"""Environment variable: the folder to which the text of every program is written."""

FOLDER = Path(__file__).parent / "shipped_programs"


def read(key: str) -> bytes | None:
    """Return what was recorded under a key; None where there is nothing, or it is not whole."""
    try:
        return lzma.decompress((FOLDER / _name(key)).read_bytes())
    except (OSError, EOFError, lzma.LZMAError):
        return None


def record(key: str, content: bytes) -> None:
    """Keep content under a key where a wheel is being built."""
    folder = os.environ.get(RECORD)
    if folder:
        (Path(folder) / _name(key)).write_bytes(lzma.compress(content, preset=2))


def count() -> int:
    """Return how many programs the package carries."""
    return sum(1 for _ in FOLDER.glob("*.xz"))


def _name(key: str) -> str:
    digest = hashlib.sha256(f"{_store.code_digest()} {key}".encode())
    return f"{digest.hexdigest()[:32]}.xz"


__all__ = ["FOLDER", "RECORD", "count", "read", "record"]
