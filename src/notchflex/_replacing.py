"""Files replaced whole.

A file is first written beside its destination under a temporary name and then renamed over it, so
that whoever reads it sees the old file or the new one and never half of either. What a killed
process left is removed when a file is next written in that folder: the temporary file of a process
that lives is locked.
"""

from __future__ import annotations

import contextlib
import os
import stat
import sys
import tempfile
from collections.abc import Generator
from pathlib import Path

from notchflex.errors import InputError

AnyPath = str | os.PathLike[str]
"""The path of a file, as text or as an object."""

_PREFIX = ".notchflex-"
_swept: set[Path] = set()
"""Folders in which this process has looked for what others left."""


@contextlib.contextmanager
def replacing(target: AnyPath) -> Generator[Path]:
    """Give a path to write to; on success the file there becomes `target`, whole.

    The temporary file lies in the folder of `target` and keeps its suffix. If the body of the
    `with` raises, the temporary file is removed and `target` is as it was.

    Args:
        target: Path of the file to make or replace. A link is followed; what is not an ordinary
            file (/dev/null, a pipe) is written directly.

    Yields:
        The path to write to.

    Raises:
        InputError: The file cannot be written.
    """
    if not is_replaceable(Path(target)):  # not its real path: /dev/stdout may be a link to no name
        with unwritable(f"{target} cannot be written"):
            yield Path(target)
        return
    try:
        destination = Path(os.path.realpath(target))
        _sweep(destination.parent)
        handle, name = tempfile.mkstemp(
            dir=destination.parent,
            prefix=f"{_PREFIX}{destination.stem}-",
            suffix=destination.suffix,
        )
    except (OSError, ValueError) as problem:  # ValueError: a null character in the name
        words = getattr(problem, "strerror", None) or problem
        raise InputError.FILE_UNWRITABLE(f"{target} cannot be written: {words}.") from None
    temporary = Path(name)
    try:
        if not _lock(handle):
            os.close(handle)
            handle = -1
        with unwritable(f"{target} cannot be written"):
            yield temporary
            temporary.chmod(_mode_for(destination))
            os.replace(temporary, destination)
    finally:
        if handle >= 0:
            os.close(handle)
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def unwritable(what: str) -> Generator[None]:
    """Add what cannot be done to an error of the system.

    Raises:
        InputError: In place of an `OSError`.
    """
    try:
        yield
    except OSError as problem:
        words = problem.strerror or problem
        raise InputError.FILE_UNWRITABLE(f"{what}: {words}.") from None


def _lock(handle: int) -> bool:
    """Lock a file until it is closed; False where another process has locked it, or none can."""
    if sys.platform == "win32":
        return False
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _sweep(folder: Path) -> None:
    """Remove temporary files of processes that were killed, once for a folder."""
    if folder in _swept:
        return
    _swept.add(folder)
    for file in folder.glob(f"{_PREFIX}*"):
        with contextlib.suppress(OSError):
            handle = os.open(file, os.O_RDWR)
            try:
                if _lock(handle):
                    file.unlink()
            finally:
                os.close(handle)


def is_replaceable(path: Path) -> bool:
    """Return whether renaming over `path` is right: it is an ordinary file, or none yet."""
    return not path.exists() or path.is_file()


def _mode_for(destination: Path) -> int:
    """Return the permissions of the file there is, or those a new file would get."""
    if destination.exists():
        return stat.S_IMODE(destination.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def check_is_path(value: object, what: str) -> None:
    """Raise InputError unless a value is the path of what it shall be."""
    if not isinstance(value, str | os.PathLike):
        raise InputError.WRONG_TYPE(f"the path of {what} is needed; got {value!r:.60}")
