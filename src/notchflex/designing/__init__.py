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
from notchflex.designing.solver import target_points
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
    design_schema,
    read_design,
)

__all__ = ["FILES", "Design", "DesignConstraint", "DesignFront", "DesignObjective", "DesignSpec"]
__all__ += ["DesignState", "DesignVariable", "RobustOptions", "SearchOptions", "Stock"]
__all__ += ["TargetCurve", "VariableResult", "WishResult", "YieldOf", "design"]
__all__ += ["design_document", "design_front", "design_schema", "numbers", "read_design"]
__all__ += ["target_points"]
