"""Tolerances and acceptance limits: worst case, yield, and which dimension to control."""

from notchflex.tolerancing.analysis import ToleranceAnalysis, tolerance_analysis
from notchflex.tolerancing.documents import tolerance_columns, tolerance_document
from notchflex.tolerancing.spec import AcceptanceLimit, ToleranceSpec, read_tolerance_spec
from notchflex.tolerancing.study import (
    REPLICATES,
    TAIL,
    Outcomes,
    Study,
    piece_rows,
    points_of_each,
    replicates,
    yield_interval,
)

__all__ = ["AcceptanceLimit", "ToleranceAnalysis", "ToleranceSpec"]
__all__ += ["read_tolerance_spec", "tolerance_analysis"]
__all__ += ["REPLICATES", "TAIL", "Outcomes", "Study", "piece_rows", "points_of_each"]
__all__ += ["replicates", "tolerance_columns", "tolerance_document", "yield_interval"]
