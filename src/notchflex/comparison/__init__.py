"""Measured notch angles against what the model says: reading, solving, root-mean-square errors."""

from notchflex.comparison.comparison import Comparison, compare, compare_kinematics
from notchflex.comparison.measured import Measured, read_measured
from notchflex.comparison.tables import comparison_columns, comparison_document, errors_document

__all__ = [
    "Comparison",
    "Measured",
    "compare",
    "compare_kinematics",
    "comparison_columns",
    "comparison_document",
    "errors_document",
    "read_measured",
]
