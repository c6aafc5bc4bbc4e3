"""Files for other programs: cut patterns, drawings, solids and models of simulators."""

from notchflex.export.export import Exported, export_robot
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.options import PatternOptions, SolidOptions
from notchflex.export.simulators.options import SimulatorOptions

__all__ = [
    "DeckOptions",
    "Exported",
    "PatternOptions",
    "SimulatorOptions",
    "SolidOptions",
    "export_robot",
]
