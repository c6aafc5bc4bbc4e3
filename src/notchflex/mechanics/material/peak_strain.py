"""The largest strain of any fibre of a cross-section.

The strain of a fibre is e + k x + c y: x from the neutral axis toward the spine, y from the line of
symmetry. It is largest at a corner on the side of the cut, or on the outer arc of the spine.
"""

from __future__ import annotations

from typing import NamedTuple

from jaxtyping import Array, Float

from notchflex._jax import jnp
from notchflex.mechanics.material.fibre_section import FibreSection
from notchflex.mechanics.material.law import SectionLaw


class SectionStrain(NamedTuple):
    """Strains of a section itself, without those of its ends.

    Attributes:
        stretch: Strain of the neutral axis.
        curvature: Curvature about the weak axis, 1/mm; positive closes and stretches the spine.
        sideways: Magnitude of the curvature about the strong axis, 1/mm.
    """

    stretch: Array
    curvature: Array
    sideways: Array


def section_strain(
    law: SectionLaw, strain: Float[Array, " 6"], section: FibreSection, memory: object
) -> SectionStrain:
    """Compute the strains of a section from those of its flexure, which holds its ends too."""
    ends, about_weak = section.ends, strain[1]
    stretch, sideways = strain[5], jnp.abs(strain[0])
    if ends is not None:
        about_weak = about_weak / ends.flattening(about_weak)
        stretch, sideways = stretch / (1.0 + ends.axial), sideways / (1.0 + ends.strong)
    bending = law.bent(about_weak, section, memory)
    return SectionStrain(stretch + bending.strain, bending.curvature, sideways)


def peak_strain(strain: SectionStrain, section: FibreSection) -> Float[Array, "*shape"]:
    """Compute the largest magnitude of the strain of any fibre, without the shear of torsion."""
    stretch, curvature, sideways = strain
    radius, angle = section.outer_radius, section.half_angle
    centre = stretch + curvature * (section.edge_spine - radius)
    # Along the arc the strain is a cosine; beyond its ends it has no maximum or no minimum.
    flat = (curvature == 0.0) & (sideways == 0.0)
    size = jnp.sqrt(jnp.where(flat, 1.0, curvature**2 + sideways**2))
    largest = jnp.where(flat, 0.0, size)
    along, across = curvature * jnp.cos(angle), sideways * jnp.sin(angle)
    rises, falls = (jnp.arctan2(sideways, sign * curvature) <= angle for sign in (1.0, -1.0))
    top = centre + radius * jnp.where(rises, largest, along + across)
    bottom = centre + radius * jnp.where(falls, -largest, along - across)
    # A spine without an arc ends in a line as wide as the side of the cut.
    by_width = sideways * section.edge_across
    at_line = jnp.where(radius == 0.0, by_width, 0.0)
    near = stretch - curvature * section.edge_near
    places = (top + at_line, bottom - at_line, near + by_width, near - by_width)
    return jnp.max(jnp.abs(jnp.stack(places)), axis=0)
