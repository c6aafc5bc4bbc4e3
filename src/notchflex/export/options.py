"""Options of the exported files, as values."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SheetOptions:
    """Options of the dimensioned sheet: none yet."""
