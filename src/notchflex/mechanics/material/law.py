"""Section laws: resultants of a cross-section from strains and memory.

Each law is a file in this folder that registers itself for its description by
`section_law.register`; the package imports every file of the folder.

All materials have the same interface for a cross-section of a flexure, so the chain does not depend
on the material. A law gives the bending moment over the curvature; the rest is linear, and the ends
of the notch are added here, for all laws:

    s = kappa / q,   (1 + c w) k + (1 - c) w Phi(k) / (E I) = s,   M = Phi(k) / q

with the curvature k of the section itself, its moment Phi(k), the end compliance w of which a
share c follows the material, and the flattening q.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from functools import partial, singledispatch
from typing import Any, ClassVar, NamedTuple

from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex._pytree import Pytree
from notchflex.mechanics.material.fibre_section import FibreSection
from notchflex.mechanics.material.flattening import Flattening, flattening
from notchflex.mechanics.material.root import bracketed_root
from notchflex.mechanics.registration import unregistered


class SectionResponse(NamedTuple):
    """Response of a section law.

    Attributes:
        resultants: Moments about x, y, z (N mm) and forces along x, y, z (N).
        memory: The memory after these strains.
        slope: Change of the moment about y with the curvature about y, where the law provides it
            and all else is elastic; None to differentiate.
    """

    resultants: Float[Array, " 6"]
    memory: Any
    slope: Float[Array, ""] | None = None


class Bending(NamedTuple):
    """A section between its ends, bent about the weak axis.

    Attributes:
        curvature: Curvature of the section itself, beyond that of the free tube, 1/mm.
        moment: Its moment, N mm.
        memory: The memory after it.
        slope: Change of the moment with s, where the law provides it; None to differentiate.
        strain: Strain of the neutral axis, for laws of fibres.
    """

    curvature: Float[Array, ""]
    moment: Float[Array, ""]
    memory: Any
    slope: Array | None = None
    strain: Array | float = 0.0


# Mask of weak-axis bending among strains and resultants.
_WEAK = xp.arange(6) == 1


class SectionLaw(Pytree, ABC):
    """Section law of a material. Tangents are derivatives of the resultants.

    Attributes:
        is_linear: Whether the moment of a section is proportional to its curvature.
        elastic_modulus: Young's modulus in the free robot, MPa.
        shear_modulus: Shear modulus, MPa.
    """

    is_linear: ClassVar[bool] = False
    elastic_modulus: Float[Array, ""]
    shear_modulus: Float[Array, ""]

    @property
    def remembers(self) -> bool:
        """Whether the moment depends on the past."""
        return False

    def rest(self, section: FibreSection) -> Any:
        """Return the memory of a free section, or of many; () for laws without memory."""
        del section
        return ()

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Return the energy per length lost between two memories, N mm/mm; for plain arrays."""
        del before, after
        return xp.zeros(xp.shape(section.area))

    @abstractmethod
    def moment(self, curvature: Float[Array, ""], section: FibreSection) -> Float[Array, ""]:
        """Return the moment of a section without ends at a curvature about its weak axis, N mm."""

    @abstractmethod
    def bending_energy(
        self, curvature: Float[Array, ""], section: FibreSection, memory: Any
    ) -> Float[Array, ""]:
        """Return the energy per length of a section without ends at a curvature, N mm/mm."""

    def bent(self, reduced: Float[Array, ""], section: FibreSection, memory: Any) -> Bending:
        """Bend a section between its ends by s = kappa / q; for laws without memory."""
        if section.ends is None:
            curvature = reduced
        elif self.is_linear:
            curvature = reduced / (1.0 + section.ends.weak)
        else:
            curvature = _between_ends(self, section, reduced)
        return Bending(curvature, self.moment(curvature, section), memory)

    def respond_all(
        self, strain: Float[Array, "*shape 6"], section: FibreSection, memory: Any
    ) -> SectionResponse:
        """Compute the resultants of many cross-sections."""
        respond = self.respond
        for _ in strain.shape[:-1]:
            respond = jax.vmap(respond)
        return respond(strain, section, memory)

    def respond(
        self, strain: Float[Array, "*shape 6"], section: FibreSection, memory: Any
    ) -> SectionResponse:
        """Compute the resultants of a cross-section from its strains beyond those of the free tube.

        Laws that bend many sections at once accept many.
        """
        elastic = self.elastic(jnp.moveaxis(strain, -1, 0), section)
        ends, curvature = section.ends, strain[..., 1]
        if ends is None:
            bending = self.bent(curvature, section, memory)
            moment, slope = bending.moment, bending.slope
        else:
            q = ends.flattening(curvature)
            bending = self.bent(curvature / q, section, memory)
            moment, slope = bending.moment / q, bending.slope
            if slope is not None:
                by_q = (ends.odd + 2.0 * ends.even * curvature) / q
                slope = (slope * (1.0 - curvature * by_q) / q - bending.moment * by_q) / q
        resultants = jnp.where(_WEAK, moment[..., None], elastic)
        return SectionResponse(resultants, bending.memory, slope)

    def energy(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> Float[Array, ""]:
        """Return the energy stored per length under given strains, N mm/mm.

        It is the area under the moment over the curvature, and the elastic energy of the other
        strains. With hysteresis it is the energy of fibres, ends and flattening; the rest of the
        area is dissipated.
        """
        return self.stored_energy_density(strain, section, memory)[0]

    def stored_energy_density(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> tuple[Float[Array, ""], Flattening]:
        """Compute the stored energy per length, and the flattening, which depends on the memory."""
        others = 0.5 * jnp.where(_WEAK, 0.0, self.elastic(strain, section)) @ strain
        ends, curvature = section.ends, strain[1]
        if ends is None:
            own = self.bending_energy(curvature, section, memory)
            return others + own, Flattening.none(curvature)
        bending = self.bent(curvature / ends.flattening(curvature), section, memory)
        stored = (1.0 + ends.material_share * ends.weak) * self.bending_energy(
            bending.curvature, section, memory
        )
        rigidity = self.elastic_modulus * section.second_moment_weak
        stored += 0.5 * (1.0 - ends.material_share) * ends.weak * bending.moment**2 / rigidity
        flat = flattening(self, curvature, section, memory)
        return others + stored + flat.energy, flat

    def elastic(self, strain: Float[Array, " 6"], section: FibreSection) -> Float[Array, " 6"]:
        """Compute the resultants with the moduli of the free robot."""
        plain = dataclasses.replace(section, fibres=None)
        return elastic_resultants(self.elastic_modulus, self.shear_modulus, plain, strain)

    def stiffness(self, section: FibreSection) -> Float[Array, "*shape 6 6"]:
        """Compute the stiffness in the free robot, of a section or of many."""
        return elastic_stiffness(self.elastic_modulus, self.shear_modulus, section)

    def tangent(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> Float[Array, "6 6"]:
        """Return the change of the resultants with the strains."""
        return jax.jacfwd(lambda varied: self.respond(varied, section, memory).resultants)(strain)


def _imbalance(law: SectionLaw, section: FibreSection, reduced: Array, curvature: Array) -> Array:
    """Compute the bending of a section with its ends at a curvature, beyond s."""
    ends = section.ends
    assert ends is not None
    elastic = law.moment(curvature, section) / (law.elastic_modulus * section.second_moment_weak)
    share = ends.material_share
    return (1.0 + share * ends.weak) * curvature + (1.0 - share) * ends.weak * elastic - reduced


def _between_ends(law: SectionLaw, section: FibreSection, reduced: Array) -> Float[Array, ""]:
    """Find the curvature of a section between its ends.

    Only the last Newton step is differentiated, from a constant point.
    """
    fixed = jax.tree.map(jax.lax.stop_gradient, (law, section, reduced))
    ends, aim = fixed[1].ends, fixed[2]

    def at(curvature: Array) -> tuple[Array, Array]:
        return jax.jvp(partial(_imbalance, *fixed), (curvature,), (jnp.ones_like(curvature),))

    # Bound: a section without resistance, where only the compliance that follows it limits it.
    soft_limit = aim / (1.0 + ends.material_share * ends.weak)
    low, high = jnp.minimum(soft_limit, 0.0), jnp.maximum(soft_limit, 0.0)
    root = bracketed_root(at, aim / (1.0 + ends.weak), low, high)
    return root - _imbalance(law, section, reduced, root) / at(root)[1]


def elastic_resultants(
    elastic_modulus: float | Array,
    shear_modulus: float | Array,
    section: FibreSection,
    strain: Float[Array, " 6"],
) -> Float[Array, "*shape 6"]:
    """Compute the resultants of a linear elastic section about its neutral axis, with its ends.

    The axes through the centroid are principal, so bending and stretch do not couple. Shear
    along y acts at the shear centre, `shear_centre` on the spine's side, where the section's
    shear is v_y - shear_centre * twist: that couples it with torsion. The shear areas are the
    whole area (Gao 2017 takes the same factor of 1).

    Args:
        elastic_modulus: Young's modulus, MPa.
        shear_modulus: Shear modulus, MPa.
        section: The section, or many.
        strain: Its strains.

    Returns:
        Resultants, in the order of the strains.
    """
    about_x, about_y, twist, along_x, along_y, stretch = (
        strain[component] for component in range(6)
    )
    if (ends := section.ends) is not None:
        about_x, about_y = about_x / (1.0 + ends.strong), about_y / (1.0 + ends.weak)
        stretch = stretch / (1.0 + ends.axial)
    free_twist = twist if ends is None else twist / (1.0 + ends.torsion)
    shear = shear_modulus * section.area
    across = shear * (along_y - section.shear_centre * twist)
    if ends is not None:
        across = across / (1.0 + ends.sway)
        along_x = along_x / (1.0 + ends.push)
    sideways = elastic_modulus * section.second_moment_strong * about_x
    torsion = shear_modulus * section.torsion_constant * free_twist
    if ends is not None:
        sideways = sideways + elastic_modulus * ends.oblique * twist
        torsion = torsion + elastic_modulus * ends.oblique * strain[0]
    resultants = [
        sideways,
        elastic_modulus * section.second_moment_weak * about_y,
        torsion - section.shear_centre * across,
        shear * along_x,
        across,
        elastic_modulus * section.area * stretch,
    ]
    return xp.stack(resultants, axis=-1)


def elastic_stiffness(
    elastic_modulus: float | Array, shear_modulus: float | Array, section: FibreSection
) -> Float[Array, "*shape 6 6"]:
    """Compute the stiffness of a linear elastic section, or of many; see `elastic_resultants`."""
    plain = dataclasses.replace(section, fibres=None)
    every = jax.tree.map(lambda leaf: xp.asarray(leaf)[..., None], plain)
    by_strain = elastic_resultants(elastic_modulus, shear_modulus, every, constant(xp.eye(6)))
    return by_strain.swapaxes(-1, -2)


@singledispatch
def section_law(material: Any) -> SectionLaw:
    """Return the section law of a material description.

    Args:
        material: A material description, such as `notchflex.Linear(60000.0)`.

    Returns:
        The law, its constants as arrays (MPa).

    Raises:
        TypeError: There is no law for this kind of description.
    """
    raise unregistered("section law", material, "material", "section_law")
