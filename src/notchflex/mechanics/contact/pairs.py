"""Contact between the edges of a notch: gap and contact force.

Like a tendon's span, a contact connects an anchor, the body with the face, and the body with the
edge. The gap depends on their relative pose, or on the flexure's strains alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._pytree import Pytree
from notchflex.mechanics.flexure import FlexureState, Rod
from notchflex.mechanics.motion import Motion


class GapResponse(NamedTuple):
    """Contacts of one kind at one flexure (mm).

    Attributes:
        gap: Gap, >= 0 in a solved state.
        wrench: Moment and force on the distal body per unit of contact force, about and along its
            frame; its opposite acts on the anchor. None for contacts that act only on the modes.
        slope: Change of the gap per unit of mode; None for contacts that act on bodies.
    """

    gap: Float[Array, " l"]
    wrench: Float[Array, "l w"] | None
    slope: Float[Array, "l modes"] | None


class ContactGroup(Pytree, ABC):
    """Contacts of one kind. Arrays have the flexures as leading axis, then the contacts.

    Attributes:
        acts_on_bodies: Whether the contact is a force on bodies.
        has_contact: 1 where a flexure has such a contact.
        back: Number of bodies from the distal one back to the anchor.
    """

    acts_on_bodies: ClassVar[bool]
    has_contact: Float[Array, "*n l"]
    back: Int[Array, "*n l"]

    def fibre(self, rods: Rod) -> Float[Array, "*n 2"] | None:
        """Locate the fibre along which the contact force acts, mm from the neutral axis.

        Args:
            rods: All flexures.

        Returns:
            Its position in the section; None where the force acts on bodies.
        """
        del rods

    @abstractmethod
    def gap_response(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> GapResponse:
        """Compute the contacts at one flexure (of a group without its leading axis).

        Args:
            rod: The flexure.
            flexure: Its state.
            anchors: Pose of the distal body seen from each anchor, contacts as leading axis; None
                where nothing acts on bodies.
        """
