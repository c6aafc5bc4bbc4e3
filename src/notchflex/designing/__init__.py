"""Design: dimensions of a robot from a specification."""

from notchflex.designing.design_robot import design as design
from notchflex.designing.documents import design_document as design_document
from notchflex.designing.files import write_design as write_design
from notchflex.designing.files import write_front as write_front
from notchflex.designing.front import DesignFront as DesignFront
from notchflex.designing.front import design_front as design_front
from notchflex.designing.result import Design as Design
from notchflex.designing.result import VariableResult as VariableResult
from notchflex.designing.result import WishResult as WishResult
from notchflex.designing.search.robust_search import YieldOf as YieldOf
from notchflex.designing.specification.asked import DesignConstraint as DesignConstraint
from notchflex.designing.specification.asked import DesignObjective as DesignObjective
from notchflex.designing.specification.asked import TargetCurve as TargetCurve
from notchflex.designing.specification.chosen import DesignVariable as DesignVariable
from notchflex.designing.specification.chosen import Stock as Stock
from notchflex.designing.specification.reading import read_design as read_design
from notchflex.designing.specification.spec import DesignSpec as DesignSpec
from notchflex.designing.specification.spec import DesignState as DesignState
from notchflex.designing.specification.spec import RobustOptions as RobustOptions
from notchflex.designing.specification.spec import SearchOptions as SearchOptions
