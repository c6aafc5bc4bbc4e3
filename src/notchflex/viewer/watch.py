"""Seeing that a file was saved again."""

from __future__ import annotations

from pathlib import Path


class Watched:
    """A file that somebody edits beside us.

    Args:
        path: The file; it may be missing for a while, as editors replace files.
    """

    def __init__(self, path: Path) -> None:
        """Remember how it is now."""
        self.path = path
        self._seen = self._look()

    def changed(self) -> bool:
        """Whether it has been saved since the last time that this was asked."""
        now = self._look()
        if now is None or now == self._seen:
            return False
        self._seen = now
        return True

    def _look(self) -> tuple[int, int, int] | None:
        try:
            found = self.path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino


__all__ = ["Watched"]
