"""Design: dimensions of a robot from a specification."""

from notchflex.designing.design_robot import design, design_front
from notchflex.designing.result import (
    FILES,
    Design,
    DesignFront,
    VariableResult,
    WishResult,
    design_document,
    numbers,
)
from notchflex.designing.robust import YieldOf
from notchflex.designing.specification import (
    DesignConstraint,
    DesignObjective,
    DesignSpec,
    DesignState,
    DesignVariable,
    RobustOptions,
    SearchOptions,
    Stock,
    TargetCurve,
    read_design,
)

__all__ = [
    "FILES",
    "Design",
    "DesignConstraint",
    "DesignFront",
    "DesignObjective",
    "DesignSpec",
    "DesignState",
    "DesignVariable",
    "RobustOptions",
    "SearchOptions",
    "Stock",
    "TargetCurve",
    "VariableResult",
    "WishResult",
    "YieldOf",
    "design",
    "design_document",
    "design_front",
    "numbers",
    "read_design",
]
