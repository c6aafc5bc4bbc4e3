"""Tolerances and acceptance limits: worst case, yield, and which dimension to control."""

from notchflex.tolerancing.analysis import ToleranceAnalysis, tolerance_analysis
from notchflex.tolerancing.spec import AcceptanceLimit, ToleranceSpec, read_tolerance_spec

__all__ = ["AcceptanceLimit", "ToleranceAnalysis", "ToleranceSpec"]
__all__ += ["read_tolerance_spec", "tolerance_analysis"]
