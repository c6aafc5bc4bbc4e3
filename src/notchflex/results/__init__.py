"""Results: equilibria and paths, the registry of quantities, tables and files.

What computes, reads or writes is loaded on first use: `notchflex --help` passes by here.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from notchflex._quantity import Quantity

if TYPE_CHECKING:
    from notchflex.results.io import (
        read_path,
        save_path,
    )
    from notchflex.results.path import EquilibriumPath, Recorded
    from notchflex.results.quantities import QUANTITIES
    from notchflex.results.reading import read_table
    from notchflex.results.state import (
        Equilibrium,
        SavedState,
        State,
    )

__all__ = [
    "QUANTITIES",
    "Equilibrium",
    "EquilibriumPath",
    "Quantity",
    "Recorded",
    "SavedState",
    "State",
    "read_path",
    "read_table",
    "save_path",
]

_HOME = {
    **dict.fromkeys(("EquilibriumPath", "Recorded"), "path"),
    **dict.fromkeys(("Equilibrium", "SavedState", "State"), "state"),
    **dict.fromkeys(("read_path", "save_path"), "io"),
    "read_table": "reading",
    "QUANTITIES": "quantities",
}


def __getattr__(name: str) -> object:
    """Import the home of a name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
