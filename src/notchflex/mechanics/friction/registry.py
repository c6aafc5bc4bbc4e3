"""From the description of friction to its law: how far tension can fall over a contact.

A law lives in a file of its own in this folder and registers itself for its description; the
package imports every file of the folder, so no list is kept.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import singledispatch
from typing import Any, ClassVar

from jaxtyping import Array, Bool, Float

from notchflex._jax import jnp
from notchflex._pytree import Pytree


class FrictionLaw(Pytree, ABC):
    """Friction of a tendon at the two edges of a gap.

    Attributes:
        remembers: Whether a solved state depends on the one before.
    """

    remembers: ClassVar[bool] = True

    @abstractmethod
    def bounds(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> tuple[Float[Array, "*t"], Float[Array, "*t"]]:
        """Largest |ln(tension on the base side / tension on the tip side)| at both edges.

        Args:
            exit_turning: Angle by which the tendon turns where it leaves the proximal body, rad.
            entry_turning: Angle by which it turns where it enters the distal body, rad.

        Returns:
            The bound at the exit edge and at the entry edge, each >= 0.
        """

    def valid(
        self, exit_turning: Float[Array, "*t"], entry_turning: Float[Array, "*t"]
    ) -> Bool[Array, "*t"]:
        """Tell where the law holds; beyond, `bounds` is finite but means nothing.

        Args:
            exit_turning: As for `bounds`.
            entry_turning: As for `bounds`.
        """
        return jnp.ones_like(exit_turning + entry_turning, dtype=bool)


@singledispatch
def friction_law(friction: Any) -> FrictionLaw:
    """Law of the friction of a robot file.

    Args:
        friction: A friction description, such as `notchflex.Capstan(0.13)`.

    Returns:
        The law, its constants as arrays.

    Raises:
        TypeError: There is no law for this kind of description.
    """
    raise TypeError(
        f"no friction law is registered for a description of type {type(friction).__name__}; "
        "add one to notchflex/friction with @friction_law.register"
    )
