"""Design: dimensions of a robot from a specification."""

from notchflex.designing.design_robot import design
from notchflex.designing.front import DesignFront, design_front
from notchflex.designing.result import (
    Design,
    VariableResult,
    WishResult,
    design_document,
    write_design,
    write_front,
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
    "read_design",
    "write_design",
    "write_front",
]
