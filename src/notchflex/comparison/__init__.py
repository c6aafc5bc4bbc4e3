"""The model beside measurements: solved at every measured row, root-mean-square errors."""

from notchflex.comparison.comparison import Comparison, compare, compare_kinematics
from notchflex.comparison.tables import comparison_columns, comparison_document, errors_document

__all__ = [
    "Comparison",
    "compare",
    "compare_kinematics",
    "comparison_columns",
    "comparison_document",
    "errors_document",
]
