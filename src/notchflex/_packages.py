"""Imports every file of a folder, so that a new part registers itself without a list."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules


def import_all(package: str, path: Iterable[str]) -> None:
    """Import every module directly inside a package."""
    for module in iter_modules(path):
        import_module(f"{package}.{module.name}")


# What is raised for parts of a robot that no law is registered for.


def unregistered(wanted: str, part: object, folder: str, function: str) -> TypeError:
    """Make the error of a kind that a function was not told of."""
    return TypeError(
        f"no {wanted} is registered for a description of type {type(part).__name__}; "
        f"add one to notchflex/mechanics/{folder} with @{function}.register"
    )
