"""Imports on demand: names on first use, all files of a folder, and optional libraries."""

import importlib.util
import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pkgutil import iter_modules

from notchflex.errors import InputError


def loader(module: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """Return a `__getattr__` (PEP 562) that imports a name from its home and keeps it."""

    def load(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[module], name, value)
        return value

    return load


def import_all(package: str, path: Iterable[str]) -> None:
    """Import every module directly inside a package: a new part registers itself without a list."""
    for module in iter_modules(path):
        import_module(f"{package}.{module.name}")


def unregistered(wanted: str, part: object, folder: str, function: str) -> TypeError:
    """Make the error of a kind of part that no file of `mechanics/folder` registers a law for."""
    return TypeError(
        f"no {wanted} is registered for a description of type {type(part).__name__}; "
        f"add one to notchflex/mechanics/{folder} with @{function}.register"
    )


def need(module: str, extra: str, what: str) -> None:
    """Raise if an optional library is not installed; nothing is imported.

    Args:
        module: What would be imported.
        extra: The extra that installs it.
        what: What needs it, as the message begins.

    Raises:
        InputError: It is not installed; the message has the command that installs it.

    Example:
        >>> need("numpy", "plot", "--plot")
    """
    if importlib.util.find_spec(module) is None:
        raise InputError.MISSING_PACKAGE(
            f"{what} needs {module}, which is not installed: {install_command(extra)}"
        )


def install_command(extra: str) -> str:
    """Return the command that installs an extra.

    Example:
        >>> install_command("plot")
        "pip install 'notchflex[plot]'"
    """
    return f"pip install 'notchflex[{extra}]'"
