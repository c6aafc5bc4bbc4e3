"""Arrays that belong together, as one frozen dataclass that JAX sees through."""

from __future__ import annotations

import dataclasses
from typing import Any, dataclass_transform

from notchflex._jax import jax


def static(**options: Any) -> Any:
    """A field that is no array: compiled programs are made for its value."""
    return dataclasses.field(metadata={"static": True}, **options)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(static,))
class Pytree:
    """Base of dataclasses whose fields are arrays, or trees of them.

    Subclasses become frozen dataclasses, and pytrees of JAX, by being written. They are made
    hundreds of times where a robot's numbers are varied: that must cost no more than their fields.

    Example:
        >>> class Pair(Pytree):
        ...     first: float
        ...     kind: str = static()
        >>> jax.tree.leaves(Pair(1.0, "own"))
        [1.0]
    """

    def __init_subclass__(cls, *, eq: bool = False, **options: Any) -> None:
        """Make a dataclass of the subclass, and tell JAX which of its fields are arrays.

        Args:
            eq: Whether equal fields make equals, as of plain numbers; arrays have no one answer.
            options: For other bases.
        """
        super().__init_subclass__(**options)
        dataclasses.dataclass(frozen=True, eq=eq)(cls)
        jax.tree_util.register_dataclass(cls)


__all__ = ["Pytree", "static"]
