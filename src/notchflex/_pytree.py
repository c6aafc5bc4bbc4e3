"""Frozen dataclasses of arrays that JAX can traverse (pytrees)."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar, dataclass_transform

from notchflex._jax import jax, jnp

Tree = TypeVar("Tree")


def static(**options: Any) -> Any:
    """Return a field that is not an array: programs are compiled for its value."""
    return dataclasses.field(metadata={"static": True}, **options)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(static,))
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
    return jax.tree.map(lambda one, other: jnp.where(condition, one, other), new, old)
