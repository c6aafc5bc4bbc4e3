"""Files for other programs: cut patterns, drawings, solids and models of simulators."""

from notchflex.export.export import Exported, export_robot

__all__ = ["Exported", "export_robot"]
