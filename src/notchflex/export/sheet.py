"""The dimensioned sheet of a robot: for the shop, and to inspect the parts that come back."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notchflex.export.document import Subject
from notchflex.export.options import SheetOptions

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Sheet:
    """A dimensioned drawing."""

    figure: Figure
    warnings: tuple[str, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict[str, Any])

    def save(self, file: Path) -> None:
        """Write it as PDF."""
        from notchflex.plotting.style import save

        save(self.figure, file)


def sheet(subject: Subject, options: SheetOptions) -> Sheet:
    """Make the sheet of a robot."""
    from notchflex.plotting.drawings.dimensioned import dimensioned_figure

    del options
    return Sheet(dimensioned_figure(subject.robot))
