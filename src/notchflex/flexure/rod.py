"""What one notch becomes for the solver: a short rod with a few strain modes, as arrays.

The rod is followed along its neutral axis in intervals of constant strain. The strain of
interval i is `reference_strain[i] + basis[i] @ q`; strains are (curvature about x, y, z of the
rod, shear along x, y, stretch along z), the stretch being 1 where nothing is strained.
"""

from __future__ import annotations

import equinox as eqx
from jaxtyping import Array, Float

from notchflex.material.section_law import FibreSection


class Rod(eqx.Module):
    """One flexure, or with a leading axis all flexures of a chain. Units mm, rad.

    Attributes:
        start_rotation: Rotation from the rod's first section to the proximal body.
        start_offset: Where the rod starts, in the frame of the proximal body. A notch alone
            counts it from its proximal face on the tube axis; the chain adds the body's length.
        end_rotation: Rotation from the distal body to the rod's last section.
        end_offset: Where the distal face of the notch lies on the tube axis, in the frame of
            the rod's last section.
        length: Length of each interval along the neutral axis.
        reference_strain: Strain of each interval of the free, cut tube.
        basis: Strain of each interval for a unit of each mode.
        section: What is left of the tube at each interval.
        lip: Where the notch closes, across the section from the neutral axis (x, y): the
            fibre that has no length left when the lips meet.
    """

    start_rotation: Float[Array, "*n 3 3"]
    start_offset: Float[Array, "*n 3"]
    end_rotation: Float[Array, "*n 3 3"]
    end_offset: Float[Array, "*n 3"]
    length: Float[Array, "*n intervals"]
    reference_strain: Float[Array, "*n intervals 6"]
    basis: Float[Array, "*n intervals 6 modes"]
    section: FibreSection
    lip: Float[Array, "*n 2"]

    @property
    def modes(self) -> int:
        """Number of strain modes of a flexure."""
        return self.basis.shape[-1]
