"""Files for other programs: cut patterns, drawings, solids and models of simulators."""

from notchflex.export.export import Exported, export_robot
from notchflex.export.formats import DeckOptions, PatternOptions, SimulatorOptions, SolidOptions
from notchflex.export.solids import MovingSolids

__all__ = [
    "DeckOptions",
    "Exported",
    "MovingSolids",
    "PatternOptions",
    "SimulatorOptions",
    "SolidOptions",
    "export_robot",
]
