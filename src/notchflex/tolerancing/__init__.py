"""Tolerances and acceptance limits: worst case, yield, and which dimension to control."""

from notchflex.tolerancing.analysis import tolerance_analysis
from notchflex.tolerancing.reading import read_tolerance_spec
from notchflex.tolerancing.result import ToleranceAnalysis
from notchflex.tolerancing.spec import AcceptanceLimit, ToleranceSpec

__all__ = ["AcceptanceLimit", "ToleranceAnalysis", "ToleranceSpec"]
__all__ += ["read_tolerance_spec", "tolerance_analysis"]
