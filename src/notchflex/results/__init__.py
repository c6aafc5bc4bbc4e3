"""Results as tables and files: one table of quantities gives names, units and texts to all."""

from notchflex.results.quantities import QUANTITIES
from notchflex.results.quantity import Quantity

__all__ = ["QUANTITIES", "Quantity"]
