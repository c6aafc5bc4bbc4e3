"""Results as tables and files: one table of quantities gives names, units and texts to all.

Reading and writing need NumPy and are loaded on first use: `notchflex --help` passes by here.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from notchflex.results.quantities.quantity import Quantity
from notchflex.results.quantities.registry import QUANTITIES

if TYPE_CHECKING:
    from notchflex.results.files.io import read_path, save_path
    from notchflex.results.files.table import read_table

__all__ = ["QUANTITIES", "Quantity", "read_path", "read_table", "save_path"]

_HOME = {"read_path": "carry", "save_path": "carry", "read_table": "table"}


def __getattr__(name: str) -> object:
    """Import the home of a name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
