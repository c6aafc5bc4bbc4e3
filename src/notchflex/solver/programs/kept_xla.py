"""Programs of XLA kept on disk, so that another process need not even trace them.

JAX's own cache keeps what XLA makes of a program, but to find it there the program is traced and
lowered first, which takes longer than all else that a short command does. Here the whole program
is found by what it was made from: the source code, the versions, and the forms of its arguments.
JAX serialises an executable by pickle only; `store.py` takes files of the user alone.
"""

from __future__ import annotations

import pickle
import re
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import update_wrapper
from typing import Any, ClassVar

import numpy as np
from jax.experimental.compilation_cache import compilation_cache

from notchflex._jax import jax, jit
from notchflex.solver.programs import store

_CALLED = re.compile(r'custom_call_target="([^"]+)"')
making = threading.RLock()


class Kept:
    """A function compiled by XLA whose programs are kept on disk.

    As all with options for the compiler it is called from plain code only, and is no part of
    another compiled function.

    Args:
        function: What to compile. Arguments are arrays, or trees of them, given by position.
        static: Positions of arguments that are no arrays; their `repr` must tell them apart.
    """

    loaded: ClassVar[dict[Any, Callable[..., Any]]] = {}

    def __init__(self, function: Callable[..., Any], static: tuple[int, ...]) -> None:
        """Compile nothing yet."""
        self._plain: Any = jit(function, static_argnums=static)
        self._static = frozenset(static)
        self._name = f"{function.__module__}.{function.__qualname__}"
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        """Run the program for these arguments, made or loaded where it is not there yet."""
        if getattr(jax.config, "jax_disable_jit") or jax.default_backend() != "cpu":  # noqa: B009
            return self._plain(*arguments)
        arrays = [one for place, one in enumerate(arguments) if place not in self._static]
        leaves, structure = jax.tree.flatten(arrays)
        static = tuple(arguments[place] for place in sorted(self._static))
        kinds = tuple((leaf.shape, leaf.dtype.str) for leaf in leaves)
        known = (self, structure, kinds, static)
        program = Kept.loaded.get(known)
        if program is not None:
            return program(*arrays)
        with making:  # threads that ask for the same program wait for the one that makes it
            if known in Kept.loaded:
                return Kept.loaded[known](*arrays)
            told = (self._name, str(structure), kinds, static)
            Kept.loaded[known], came = self._found(repr(told), arguments, arrays)
            return came

    def __getattr__(self, name: str) -> Any:
        """What else the compiled function of JAX can do."""
        return getattr(self._plain, name)

    def _found(self, told: str, arguments: tuple[Any, ...], arrays: list[Any]) -> tuple[Any, Any]:
        """The program of that description, from the folder or made and put there; its result."""
        program = _loaded(store.read(told))
        if program is not None:
            try:
                return program, program(*arrays)
            except jax.errors.JaxRuntimeError:  # what the file holds lacks a piece
                pass
        lowered = self._plain.lower(*arguments)
        with _without_cache():
            program = lowered.compile()
        stored = _stored(program)
        if stored is not None:
            store.write(told, stored)
        return program, program(*arrays)


def kept(*static: int) -> Callable[[Callable[..., Any]], Kept]:
    """Make a function one whose compiled programs are kept; see `Kept`."""
    return lambda function: Kept(function, static)


@contextmanager
def _without_cache() -> Generator[None]:
    """Let XLA compile anew: of what comes out of JAX's own cache, only a part would be kept.

    Seen with jax 0.10.1 as "Function ... not found" when it is run.
    """
    enabled: bool = getattr(jax.config, "jax_enable_compilation_cache")  # noqa: B009
    try:
        jax.config.update("jax_enable_compilation_cache", False)
        compilation_cache.reset_cache()
        yield
    finally:
        jax.config.update("jax_enable_compilation_cache", enabled)
        compilation_cache.reset_cache()


def _loaded(kept: bytes | None) -> Any:
    """The program of XLA that was kept; None where it cannot be run here."""
    from jax.experimental import serialize_executable

    if kept is None:
        return None
    try:
        by_lapack, parts = pickle.loads(kept)
        if by_lapack:
            _find_lapack()
        return serialize_executable.deserialize_and_load(*parts)
    except Exception:  # of another version
        return None


def _stored(program: Any) -> bytes | None:
    """What to keep of a program of XLA; None where nobody knows what must be ready for it."""
    from jax.experimental import serialize_executable

    try:
        called = set(_CALLED.findall(program.as_text()))
        if not all(target.startswith("lapack_") for target in called):
            return None
        return pickle.dumps((bool(called), serialize_executable.serialize(program)))
    except Exception:  # nothing that can be kept
        return None


def _find_lapack() -> None:
    """Let jaxlib look up LAPACK's routines, as it does when JAX lowers a call of one.

    A program that is only loaded would jump to nowhere.
    """
    from jaxlib import lapack

    lapack.prepare_lapack_call("getrf", np.dtype(float))


__all__ = ["Kept", "kept", "making"]
