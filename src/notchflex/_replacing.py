"""Files replaced whole.

A file is first written beside its destination under a temporary name and then renamed over it, so
that whoever reads it sees the old file or the new one and never half of either.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Generator
from pathlib import Path

from notchflex.errors import InputError


@contextlib.contextmanager
def replacing(target: str | os.PathLike[str]) -> Generator[Path]:
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
        try:
            yield Path(target)
        except OSError as problem:
            words = problem.strerror or problem
            raise InputError.FILE_UNWRITABLE(f"{target} cannot be written: {words}.") from None
        return
    try:
        destination = Path(os.path.realpath(target))
        handle, name = tempfile.mkstemp(
            dir=destination.parent, prefix=f".{destination.stem}-", suffix=destination.suffix
        )
        os.close(handle)
    except (OSError, ValueError) as problem:  # ValueError: a null character in the name
        words = getattr(problem, "strerror", None) or problem
        raise InputError.FILE_UNWRITABLE(f"{target} cannot be written: {words}.") from None
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(_mode_for(destination))
        os.replace(temporary, destination)
    except OSError as problem:
        raise InputError.FILE_UNWRITABLE(
            f"{target} cannot be written: {problem.strerror or problem}."
        ) from None
    finally:
        temporary.unlink(missing_ok=True)


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
