"""Files for other programs: cut patterns, drawings, solids and models of simulators."""

from notchflex.export.export import Exported, export_robot
from notchflex.export.formats import DeckOptions, PatternOptions, SimulatorOptions, SolidOptions

__all__ = [
    "DeckOptions",
    "Exported",
    "PatternOptions",
    "SimulatorOptions",
    "SolidOptions",
    "export_robot",
]
