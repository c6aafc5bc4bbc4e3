"""Design: dimensions of a robot from a specification."""

from notchflex.designing.design_robot import design, design_front
from notchflex.designing.result import (
    FILES,
    Design,
    DesignFront,
    WishResult,
    design_document,
    numbers,
)
from notchflex.designing.solver import target_points
from notchflex.designing.specification import DesignSpec, design_schema, read_design

__all__ = ["FILES", "Design", "DesignFront", "DesignSpec", "WishResult", "design"]
__all__ += ["design_document", "design_front", "design_schema", "numbers", "read_design"]
__all__ += ["target_points"]
