"""The result of every exporter: a document that is complete before anything is written."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from notchflex.results import EquilibriumPath
    from notchflex.robot import Robot


@dataclass(frozen=True)
class Subject:
    """Subject of an export: a robot, and for a robot under load the step of a path."""

    robot: Robot
    path: EquilibriumPath | None = None
    step: int = 0


class Document(Protocol):
    """A file that can be written."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences for the user about what is in the file."""
        ...

    @property
    def facts(self) -> dict[str, Any]:
        """Numbers about what is in the file, for `--json`; plain values, units in the names."""
        ...

    def save(self, file: Path) -> None:
        """Write it to a file, which is then renamed: `write` calls it with a temporary name."""
        ...


@dataclass(frozen=True)
class FileDocument:
    """A document whose content is known; text is written as UTF-8."""

    content: str | bytes
    warnings: tuple[str, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict[str, Any])

    def save(self, file: Path) -> None:
        """Write it."""
        content = self.content
        file.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
