"""The model beside measurements: solved at every measured row, root-mean-square errors."""

from notchflex.comparison.comparison import (
    Comparison,
    compare,
    compare_kinematics,
    comparison_columns,
    comparison_document,
    errors_document,
    takes_stroke_of_model,
)

__all__ = [
    "Comparison",
    "compare",
    "compare_kinematics",
    "comparison_columns",
    "comparison_document",
    "errors_document",
    "takes_stroke_of_model",
]
