"""Results: equilibria and paths, the registry of quantities, tables and files.

What computes, reads or writes is loaded on first use: `notchflex --help` passes by here.
"""

from typing import TYPE_CHECKING

from notchflex._lazy import loader
from notchflex._quantity import Quantity

if TYPE_CHECKING:
    from notchflex.results.io import read_path, save_path
    from notchflex.results.path import EquilibriumPath, Recorded
    from notchflex.results.quantities import QUANTITIES
    from notchflex.results.reading import read_table
    from notchflex.results.state import Equilibrium, State

__all__ = [
    "QUANTITIES",
    "Equilibrium",
    "EquilibriumPath",
    "Quantity",
    "Recorded",
    "State",
    "read_path",
    "read_table",
    "save_path",
]

__getattr__ = loader(
    __name__,
    {
        "Equilibrium": "notchflex.results.state",
        "EquilibriumPath": "notchflex.results.path",
        "Recorded": "notchflex.results.path",
        "State": "notchflex.results.state",
        **dict.fromkeys(("read_path", "save_path"), "notchflex.results.io"),
        "read_table": "notchflex.results.reading",
        "QUANTITIES": "notchflex.results.quantities",
    },
)
