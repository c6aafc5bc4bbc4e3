"""Imports every file of a folder, so that a new part registers itself without a list."""

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules


def import_all(package: str, path: Iterable[str]) -> None:
    """Import every module directly inside a package."""
    for module in iter_modules(path):
        import_module(f"{package}.{module.name}")
