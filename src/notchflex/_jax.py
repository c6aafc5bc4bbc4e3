"""JAX, switched to 64-bit floats in this one place, and how programs are compiled.

Angles must be right to 1e-8 rad and friction to 1e-7 N, which single precision cannot hold.
Every module that needs JAX imports it from here.
"""

from collections.abc import Callable
from contextvars import ContextVar
from functools import wraps
from types import ModuleType
from typing import Any, TypeVar, cast

import jax
import numpy as np
from numpy.typing import ArrayLike

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
from jax.experimental.xla_metadata import set_xla_metadata  # noqa: E402

_Told = TypeVar("_Told")

# The chain is many small steps one after the other, each far too small for several threads. XLA's
# newer fusion on the CPU compiles them in 7 s rather than 4 s (jax 0.10.1); later versions have no
# other. Its library for products of matrices takes some 5 us to begin one, and a loop over a few
# hundred numbers that is shared out among cores waits for them: together a fifth of the time of a
# robot with 27 notches.
_OPTIONS: dict[str, Any] = {"xla_cpu_multi_thread_eigen": False}
if jax.__version_info__ < (0, 11):
    _OPTIONS["xla_cpu_use_fusion_emitters"] = False
    _OPTIONS["xla_cpu_experimental_ynn_fusion_type"] = ""
    _OPTIONS["xla_disable_hlo_passes"] = "cpu-parallel-task-assigner"
_compiled_here = ContextVar("_compiled_here", default=False)


def jit(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function as `jax.jit` does, with the options of this package.

    Args:
        function: What to compile.
        options: Others of `jax.jit`.
    """

    @wraps(function)
    def traced(*arguments: Any) -> Any:
        before = _compiled_here.set(True)
        try:
            return function(*arguments)
        finally:
            _compiled_here.reset(before)

    return jax.jit(traced, compiler_options=_OPTIONS, **options)


def array_module(*values: Any) -> ModuleType:
    """NumPy for plain numbers, so that nothing is compiled; JAX where it is traced or given.

    Formulas that turn a robot into arrays run once per robot. Written with the module that this
    returns they take microseconds there, and can still be differentiated.
    """
    return jnp if any(isinstance(value, jax.Array) for value in values) else np


def in_one_kernel(function: Callable[..., _Told], *arrays: Any, short: bool) -> _Told:
    """What a function returns, all that it does being one kernel of a program for the CPU.

    XLA makes a kernel of every few operations. To begin one takes 50 to 100 ns, which for a robot
    of few notches is most of the time. LLVM works longer on one long kernel than on many short
    ones, out of proportion, so that only short programs gain by it. Elsewhere than in functions of
    `jit` kernels stay as they are: with other options XLA puts into them what they cannot hold.

    Args:
        function: What to do with the arrays; it must not close over others that are traced.
        arrays: Arrays, or trees of them.
        short: Whether what it does is short; elsewhere kernels stay as XLA makes them.

    Returns:
        What the function returns.
    """
    known = _compiled_here.get() and jax.__version_info__ < (0, 11)
    if not short or not known or jax.default_backend() != "cpu":
        return function(*arrays)

    def inside(*given: Any) -> tuple[_Told, Any]:
        with set_xla_metadata(xla_cpu_small_call="false", inlineable="true"):
            # All that is given is returned: XLA (jaxlib 0.10.1) ends the process where such a
            # kernel is given what it does not use.
            return function(*given), given

    with set_xla_metadata(xla_cpu_small_call="true", inlineable="false"):
        return jax.jit(inside)(*arrays)[0]


def constant(value: ArrayLike) -> jax.Array:
    """A NumPy array of floats, typed as the JAX array that a compiled program makes of it."""
    return cast("jax.Array", np.asarray(value, float))


__all__ = ["array_module", "constant", "in_one_kernel", "jax", "jit", "jnp"]
