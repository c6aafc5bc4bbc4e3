"""Libraries that only some users need: which extra brings them, and what to say without them."""

from __future__ import annotations

import importlib.util

from notchflex.errors import InputError


def need(module: str, extra: str, what: str) -> None:
    """Raise if an optional library is not installed; nothing is imported.

    Args:
        module: What would be imported.
        extra: The extra that brings it.
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
