"""Strains of a cross-section: the largest, those of its boundary, and the limit line of cycles."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import Pytree, jnp
from notchflex.mechanics.material.law import Each, FibreSection, Law, Strain

# The largest strain of any fibre of a cross-section.
#
# The strain of a fibre is e + k x + c y: x from the neutral axis toward the spine, y from the line
# of symmetry. It is largest at a corner on the side of the cut, or on the outer arc of the spine.


class SectionStrain(NamedTuple):
    """Strains of a section itself, without those of its ends."""

    stretch: Array  # Strain of the neutral axis
    # Curvature about the weak axis, 1/mm; positive closes and stretches the spine
    curvature: Array
    sideways: Array  # Curvature about the strong axis, 1/mm


def section_strain(
    law: Law, strain: Strain, section: FibreSection, memory: object
) -> SectionStrain:
    """Compute the strains of a section from those of its flexure, which holds its ends too."""
    ends, curvature = section.compliance, strain[1]
    bending = law.bent(curvature / ends.flattening(curvature), section, memory)
    stretch = strain[5] / (1.0 + ends.axial) + bending.strain
    return SectionStrain(stretch, bending.curvature, strain[0] / (1.0 + ends.strong))


def peak_strain(strain: SectionStrain, section: FibreSection) -> Each:
    """Compute the largest magnitude of the strain of any fibre, without the shear of torsion."""
    stretch, curvature, sideways = strain._replace(sideways=jnp.abs(strain.sideways))
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


# Strains all along the boundary of a section, and the limit line of their cycles.

_ARC = xp.linspace(-1.0, 1.0, 33)  # Points of the arc of the spine, in parts of its half angle
_FACE = xp.linspace(0.0, 1.0, 9)[1:]  # Points from its end to the corner on the side of the cut


def edge_strain(strain: SectionStrain, section: FibreSection) -> Each:
    """Compute the strains of points on the boundary: the arc, then both faces from its ends."""
    # They are plane over the section; the last point of each face is the corner of the cut.
    part = xp.broadcast_to(_ARC, (*xp.shape(section.half_angle), len(_ARC)))
    face = xp.broadcast_to(_FACE, (*part.shape[:-1], len(_FACE)))
    radius, spine, across, near, angle, stretch, curvature, sideways = (
        xp.asarray(value)[..., None]
        for value in (
            section.outer_radius,
            section.edge_spine,
            section.edge_across,
            section.edge_near,
            section.half_angle,
            *strain,
        )
    )
    x = spine - radius * (1.0 - xp.cos(angle * part))
    y = radius * xp.sin(angle * part) + xp.where(radius == 0.0, across * part, 0.0)
    x_face = x[..., -1:] - face * (x[..., -1:] + near)
    y_face = y[..., -1:] + face * (across - y[..., -1:])
    x = xp.concatenate([x, x_face, x_face], axis=-1)
    y = xp.concatenate([y, y_face, -y_face], axis=-1)
    return stretch + curvature * x + sideways * y


PLACES = np.repeat(("spine", *2 * ("face", "corner of the cut")), (len(_ARC), *2 * (7, 1)))
"""Where the points of `edge_strain` are."""

CORNERS = PLACES == "corner of the cut"
"""Which of them are corners of the cut."""


class LimitLine(Pytree):
    """A limit line of fatigue: straight between points of mean strain and allowed amplitude."""

    # Of every notch, which all have the same line
    mean: Float[Array, "n k"]
    amplitude: Float[Array, "n k"]
    # Strain at a corner of the cut over that of the section, of every notch
    corner_factor: Float[Array, " n"]

    def margin(self, mean: Array, amplitude: Array) -> Array:
        """Compute by how much cycles at the points of `edge_strain` are below; NaN if not known."""
        # A mean in compression counts as one in tension of its size: cracks open in tension.
        factor = xp.where(CORNERS, self.corner_factor[:, None, None], 1.0)
        certain = factor == factor
        factor = xp.where(certain, factor, 1.0)  # no NaN in adjoints
        mean, amplitude = factor * xp.abs(mean), factor * amplitude
        line = xp.stack([self.mean, self.amplitude]).T[..., None, None]
        allowed = line[0, :, 1]
        for (low, first), (high, last) in pairwise(xp.moveaxis(line, 2, 1)):
            allowed = allowed + (last - first) * (xp.clip(mean, low, high) - low) / (high - low)
        known = certain & (mean >= line[0, :, 0]) & (mean <= line[-1, :, 0])
        return xp.where(known, allowed - amplitude, xp.nan)
