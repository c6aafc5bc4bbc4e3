"""How the lips of a notch meet: what they leave open, and what their contact force does.

Like a tendon's span, an opening lies between an anchor, the body with the face that may be closed
against, and the body whose edge comes to it. What it leaves open depends on the pose of the one
seen from the other, or on the flexure's strains alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._pytree import Pytree
from notchflex.mechanics.flexure import FlexureState, Rod
from notchflex.mechanics.motion import Motion


class GapResponse(NamedTuple):
    """Lips of one kind at one flexure (mm).

    Attributes:
        gap: What is left of the opening, >= 0 in a solved state.
        wrench: Moment and force on the distal body per unit of contact force, about and along its
            frame; its opposite acts on the anchor. None for lips that act on the modes alone.
        slope: Change of the gap per unit of mode; None for lips that act on bodies.
    """

    gap: Float[Array, " l"]
    wrench: Float[Array, "l w"] | None
    slope: Float[Array, "l modes"] | None


class ContactGroup(Pytree, ABC):
    """Lips of one kind. Arrays carry the flexures as leading axis, then the lips.

    Attributes:
        acts_on_bodies: Whether the contact is a force on bodies.
        has_contact: 1 where there are such lips at a flexure.
        back: How many bodies before the distal one their anchor is.
    """

    acts_on_bodies: ClassVar[bool]
    has_contact: Float[Array, "*n l"]
    back: Int[Array, "*n l"]

    def fibre(self, rods: Rod) -> Float[Array, "*n 2"] | None:
        """Locate the fibre along which the contact force acts, mm from the neutral axis.

        Args:
            rods: All flexures.

        Returns:
            Its place in the section; None where the force acts on bodies.
        """
        del rods

    @abstractmethod
    def gap_response(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> GapResponse:
        """Lips at one flexure (of a group without its leading axis).

        Args:
            rod: The flexure.
            flexure: Its state.
            anchors: Pose of the distal body seen from the anchor of each, lips as leading axis;
                None where nothing acts on bodies.
        """
