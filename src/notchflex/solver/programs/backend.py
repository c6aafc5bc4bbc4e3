"""The compiler of programs, chosen by environment variables, and a warning where it is not used."""

from __future__ import annotations

import os
import warnings

from lanewise import UnsupportedPrimitiveError
from notchflex.errors import InputError

BACKEND = "NOTCHFLEX_BACKEND"
"""Environment variable: `native` (lanewise, the default) or `xla` compiles the programs."""

LEVEL = "NOTCHFLEX_OPTIMISATION"
"""Environment variable: how hard LLVM optimises, 0 to 3. Programs that run a few times want 0."""

_ALLOWED = {BACKEND: ("native", "xla"), LEVEL: ("2", "0", "1", "3")}
_warned: set[str] = set()


def backend() -> str:
    """Return the compiler of programs, "native" or "xla".

    Raises:
        InputError: `NOTCHFLEX_BACKEND` has another value.
    """
    return _chosen(BACKEND)


def optimisation_level() -> int:
    """Return how hard LLVM optimises, 0 to 3.

    Raises:
        InputError: `NOTCHFLEX_OPTIMISATION` has another value.
    """
    return int(_chosen(LEVEL))


def _chosen(variable: str) -> str:
    value, allowed = os.environ.get(variable), _ALLOWED[variable]
    if value and value not in allowed:
        names = ", ".join(sorted(allowed))
        raise InputError.UNKNOWN_NAME(
            f"the environment variable {variable} is {value!r}; allowed are {names}. "
            f"Set it to one of them, or unset it for {allowed[0]!r}."
        )
    return value or allowed[0]


def warn_of_xla(function: str, error: UnsupportedPrimitiveError, stacklevel: int = 2) -> None:
    """Warn once for each unsupported primitive that XLA compiles a function.

    Args:
        function: Name of the function.
        error: What lanewise does not support.
        stacklevel: Callers between the warning and the code that it should name.
    """
    reason = error.primitive or str(error)
    if reason in _warned:
        return
    _warned.add(reason)
    warnings.warn(
        f"XLA compiles {function}, which makes it some ten times slower: lanewise does not support "
        f"{error}",
        RuntimeWarning,
        stacklevel=stacklevel + 1,
    )


__all__ = ["BACKEND", "LEVEL", "backend", "optimisation_level", "warn_of_xla"]
