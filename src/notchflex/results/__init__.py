"""Results: equilibria and paths, the registry of quantities, tables and files.

What computes, reads or writes is loaded on first use: `notchflex --help` passes by here.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from notchflex._quantity import Quantity

if TYPE_CHECKING:
    from notchflex.results.equilibrium import Equilibrium
    from notchflex.results.files.io import read_path, save_path
    from notchflex.results.files.table import read_table
    from notchflex.results.path import EquilibriumPath
    from notchflex.results.quantities.registry import QUANTITIES
    from notchflex.results.recorded import Recorded
    from notchflex.results.state import SavedState, State

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
    "Equilibrium": "equilibrium",
    "EquilibriumPath": "path",
    "Recorded": "recorded",
    **dict.fromkeys(("SavedState", "State"), "state"),
    **dict.fromkeys(("read_path", "save_path"), "files.io"),
    "read_table": "files.table",
    "QUANTITIES": "quantities.registry",
}


def __getattr__(name: str) -> object:
    """Import the home of a name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
