"""The law of a cross-section: strains and memory in, resultants out.

A law lives in a file of its own in this folder and registers itself for its description by
`section_law.register`; the package imports every file of the folder, so no list is kept.

Every material answers the same question for one cross-section of a flexure, so the chain never
asks which material it is. Memory is there for materials whose answer depends on the past; the
two laws of today have none and hand it back untouched.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import singledispatch
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import array_module, constant, jax
from notchflex._pytree import Pytree


class FibreSection(Pytree):
    """What a law needs of a cross-section, about its neutral axis. Units mm.

    The section's x points to the cut side, z along the rod. Leading axes are allowed.

    Attributes:
        area: Area, mm^2.
        second_moment_weak: Second moment for bending that closes the notch (about y), mm^4.
        second_moment_strong: Second moment for sideways bending (about x), mm^4.
        torsion_constant: Torsion constant, mm^4.
        shear_centre: Distance of the shear centre from the neutral axis toward the spine, mm.
        edge_spine: Distance of the outer fibre on the spine from the neutral axis, mm.
        edge_near: Distance of the farthest fibre on the cut side, mm.
    """

    area: Float[Array, "*shape"]
    second_moment_weak: Float[Array, "*shape"]
    second_moment_strong: Float[Array, "*shape"]
    torsion_constant: Float[Array, "*shape"]
    shear_centre: Float[Array, "*shape"]
    edge_spine: Float[Array, "*shape"]
    edge_near: Float[Array, "*shape"]


class Response(NamedTuple):
    """Answer of a section law.

    Attributes:
        resultants: Moments about x, y, z (N mm) and forces along x, y, z (N).
        memory: The memory after these strains.
    """

    resultants: Float[Array, " 6"]
    memory: Any


class SectionLaw(Pytree, ABC):
    """A material as the chain sees it. Tangents come from the resultants by differentiation.

    Attributes:
        is_linear: Whether `stiffness` says all: what modes resist with is then summed up once.
    """

    is_linear: ClassVar[bool] = False

    @abstractmethod
    def respond(self, strain: Float[Array, " 6"], section: FibreSection, memory: Any) -> Response:
        """Resultants of a cross-section under given strains (beyond those of the free tube)."""

    @abstractmethod
    def energy(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> Float[Array, ""]:
        """Energy stored per length under given strains, N mm/mm."""

    @abstractmethod
    def stiffness(self, section: FibreSection) -> Float[Array, "*shape 6 6"]:
        """Resultants per strain in the free robot, of a section or of many."""

    def tangent(
        self, strain: Float[Array, " 6"], section: FibreSection, memory: Any
    ) -> Float[Array, "6 6"]:
        """Change of the resultants with the strains."""
        return jax.jacfwd(lambda varied: self.respond(varied, section, memory).resultants)(strain)


def elastic_resultants(
    elastic_modulus: float | Array,
    shear_modulus: float | Array,
    section: FibreSection,
    strain: Float[Array, " 6"],
) -> Float[Array, "*shape 6"]:
    """Resultants of a linear elastic section about its neutral axis.

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
    xp = array_module(*jax.tree.leaves((elastic_modulus, shear_modulus, section)), strain)
    about_x, about_y, twist, along_x, along_y, stretch = (strain[place] for place in range(6))
    shear = shear_modulus * section.area
    across = shear * (along_y - section.shear_centre * twist)
    resultants = [
        elastic_modulus * section.second_moment_strong * about_x,
        elastic_modulus * section.second_moment_weak * about_y,
        shear_modulus * section.torsion_constant * twist - section.shear_centre * across,
        shear * along_x,
        across,
        elastic_modulus * section.area * stretch,
    ]
    return xp.stack(resultants, axis=-1)


def elastic_stiffness(
    elastic_modulus: float | Array, shear_modulus: float | Array, section: FibreSection
) -> Float[Array, "*shape 6 6"]:
    """Resultants per strain of a linear elastic section, or of many; see `elastic_resultants`."""
    xp = array_module(*jax.tree.leaves(section))
    every = jax.tree.map(lambda leaf: xp.asarray(leaf)[..., None], section)
    by_strain = elastic_resultants(elastic_modulus, shear_modulus, every, constant(np.eye(6)))
    return by_strain.swapaxes(-1, -2)


@singledispatch
def section_law(material: Any) -> SectionLaw:
    """Section law of a material of a robot file.

    Args:
        material: A material description, such as `notchflex.Linear(60000.0)`.

    Returns:
        The law, its constants as arrays (MPa).

    Raises:
        TypeError: There is no law for this kind of description.
    """
    raise TypeError(
        f"no section law is registered for a material of type {type(material).__name__}; "
        "add one to notchflex/mechanics/material with @section_law.register"
    )
