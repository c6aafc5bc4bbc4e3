"""JAX, switched to 64-bit floats in this one place, and how programs are compiled.

Angles must be right to 1e-8 rad and friction to 1e-7 N, which single precision cannot hold.
Every module that needs JAX imports it from here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, TypeVar, cast, dataclass_transform

import jax
import jax.numpy as jnp  # pyright: ignore[reportUnusedImport]
import numpy as np
from numpy.typing import ArrayLike

from notchflex._arrays import is_traced, xp

jax.config.update("jax_enable_x64", True)


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


def jit(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function as `jax.jit` does, with the options of this package."""
    return jax.jit(function, compiler_options=_OPTIONS, **options)


def constant(value: ArrayLike) -> jax.Array:
    """Return an array of floats, typed as the JAX array that a program makes of it."""
    return cast("jax.Array", xp.asarray(value, float))


def scan(step: Callable[..., Any], state: Any, entries: tuple[Any, ...]) -> tuple[Any, Any]:
    """Repeat a step along arrays as `jax.lax.scan` does; in Python where all is plain."""
    if is_traced((state, entries)):
        return jax.lax.scan(step, state, entries)
    results: list[Any] = []
    for entry in zip(*entries, strict=True):
        state, result = step(state, entry)
        results.append(result)
    return state, tuple(map(np.array, zip(*results, strict=True)))


# Frozen dataclasses of arrays that JAX can traverse (pytrees).

Tree = TypeVar("Tree")


def static(**options: Any) -> Any:
    """Return a field that is not an array: programs are compiled for its value."""
    return dataclasses.field(metadata={"static": True}, **options)


@dataclass_transform(
    frozen_default=True, eq_default=False, field_specifiers=(static, dataclasses.field)
)
class Pytree:
    """Base of dataclasses whose fields are arrays, or trees of them.

    Every subclass becomes a frozen dataclass and a pytree of JAX. Varying the numbers of a robot
    creates hundreds of instances, so creating one must cost no more than its fields.

    Example:
        >>> class Pair(Pytree):
        ...     first: float
        ...     kind: str = static()
        >>> jax.tree.leaves(Pair(1.0, "own"))
        [1.0]
    """

    def __init_subclass__(cls, *, eq: bool = False, **options: Any) -> None:
        """Make the subclass a dataclass and register its arrays with JAX.

        Args:
            eq: Whether instances with equal fields are equal; not for fields of arrays.
            options: For other bases.
        """
        super().__init_subclass__(**options)
        dataclasses.dataclass(frozen=True, eq=eq)(cls)
        jax.tree_util.register_dataclass(cls)


def choose(condition: Any, new: Tree, old: Tree) -> Tree:
    """Return the new tree of arrays where a condition holds, the old one where not."""
    return jax.tree.map(
        lambda new_leaf, old_leaf: jnp.where(condition, new_leaf, old_leaf), new, old
    )
