"""Strain cycles of notches, and limit lines of fatigue; no number of cycles is predicted."""

from notchflex.fatigue.cycle import (
    StrainCycle,
    cycle_columns,
    cycle_document,
    line_words,
    strain_cycle,
)

__all__ = ["StrainCycle", "cycle_columns", "cycle_document", "line_words", "strain_cycle"]
