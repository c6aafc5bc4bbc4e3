"""How the lips of a notch meet: what they leave open, and what their contact force does.

As with the tendons the chain is walked twice: from base to tip every kind of lips carries along
what a later body may close against, from tip to base it hands back the force on it.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from notchflex.flexure import FlexureState, Rod


class Touch(NamedTuple):
    """Lips of one kind at one flexure (mm, N).

    Attributes:
        gap: What is left of the opening, >= 0 in a solved state.
        pull: What the contact forces add to the balance of the flexure's modes.
        wrench: Moment and force of the contact on the distal body, about and along its frame;
            None for lips that act on the modes alone.
        carried: What goes on to the next flexure.
        reaction: What is handed back to the proximal body.
    """

    gap: Float[Array, " l"]
    pull: Float[Array, " modes"]
    wrench: Float[Array, " 6"] | None
    carried: Any
    reaction: Any


class LipGroup(eqx.Module):
    """Lips of one kind. Arrays carry the flexures as leading axis, then the lips.

    Attributes:
        acts_on_bodies: Whether the contact is a force on bodies.
        closes: 1 where there are such lips at a flexure.
    """

    acts_on_bodies: ClassVar[bool]
    closes: eqx.AbstractVar[Float[Array, "*n l"]]

    @abstractmethod
    def leave_base(self) -> Any:
        """What is carried from the base on."""

    @abstractmethod
    def no_reaction(self) -> Any:
        """What comes back from beyond the tip: nothing."""

    @abstractmethod
    def touch(
        self,
        rod: Rod,
        flexure: FlexureState,
        force: Float[Array, " l"],
        carried: Any,
        reaction: Any,
    ) -> Touch:
        """Lips at one flexure (of a group without its leading axis).

        Args:
            rod: The flexure.
            flexure: Its state.
            force: Contact forces.
            carried: What was carried from the base side.
            reaction: What is handed back from beyond.
        """
