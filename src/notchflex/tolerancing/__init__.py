"""Tolerances and acceptance limits: worst case, yield, and which dimension to control."""

from notchflex.tolerancing.analysis import (
    ToleranceAnalysis,
    tolerance_analysis,
    tolerance_columns,
    tolerance_document,
)
from notchflex.tolerancing.spec import AcceptanceLimit, ToleranceSpec, read_tolerance_spec
from notchflex.tolerancing.study import (
    Study,
    drawn_levels,
    drawn_numbers,
    piece_rows,
    replicates,
    yield_interval,
    yield_of,
)

__all__ = ["AcceptanceLimit", "ToleranceAnalysis", "ToleranceSpec"]
__all__ += ["read_tolerance_spec", "tolerance_analysis"]
__all__ += ["Study", "drawn_levels", "drawn_numbers", "piece_rows", "replicates"]
__all__ += ["tolerance_columns", "tolerance_document", "yield_interval", "yield_of"]
