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
from collections.abc import Callable
from functools import partial, singledispatch
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import decide, xp
from notchflex._jax import (
    Pytree,
    constant,
    jax,
    jnp,
)
from notchflex._packages import unregistered

# Bracketed root of an increasing function.

# A bilinear law takes three iterations, one with a plastic branch more.
_ITERATIONS = 20


def bracketed_root(
    function: Callable[[Array], tuple[Array, Array]], start: Array, low: Array, high: Array
) -> Array:
    """Find the root by Newton's method with bisection in a bracket; not differentiable."""

    def improve(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        root, low, high, last_step = search
        value, slope = function(root)
        low = jnp.where(value <= 0.0, root, low)
        high = jnp.where(value >= 0.0, root, high)
        step = -value / slope
        new = root + step
        newton_step = (new >= low) & (new <= high) & (jnp.abs(step) <= 0.5 * last_step)
        new = jnp.where(newton_step, new, 0.5 * (low + high))
        return new, low, high, jnp.abs(new - root)

    search = start, low, high, 2.0 * (high - low)
    return jax.lax.fori_loop(0, _ITERATIONS, improve, search)[0]


# Properties of a cross-section of a flexure that material laws need.


class NotchEnds(Pytree):
    """Compliance of the rings beside a notch, added to that of its section.

    Compliances are fractions of that of the section along the length of the flexure: a stiffness is
    that of the section over 1 + fraction. A fraction may be negative, above -1, for stiff ends.

    Attributes:
        weak: Fraction added in the bending of the notch.
        strong: In sideways bending.
        axial: In stretch.
        torsion: In torsion.
        odd: Flattening by bending: the distance of the fibres falls to 1/q of their own,
            q = 1 + odd * kappa + even * kappa^2, at the elastic curvature kappa about the weak
            axis (positive closes), mm.
        even: Its even part, mm^2.
        material_share: Share of `weak` that follows the material; the rest stays elastic.
        sway: In shear sideways.
        push: In shear in the plane of bending.
        oblique: Moment about x by the twist, and torsion moment by the curvature about x, over
            Young's modulus, mm^4; its square is below the product of both stiffnesses.
    """

    weak: Float[Array, "*shape"]
    strong: Float[Array, "*shape"]
    axial: Float[Array, "*shape"]
    torsion: Float[Array, "*shape"]
    odd: Float[Array, "*shape"]
    even: Float[Array, "*shape"]
    material_share: Float[Array, "*shape"]
    sway: Float[Array, "*shape"] | float = 0.0
    push: Float[Array, "*shape"] | float = 0.0
    oblique: Float[Array, "*shape"] | float = 0.0

    @classmethod
    def rigid(cls, like: Float[Array, "*shape"]) -> NotchEnds:
        """Return rigid ends, in the shape of an array."""
        return cls(*(xp.zeros(xp.shape(like)) for _ in range(10)))  # pyright: ignore

    def flattening(self, curvature: Float[Array, ""]) -> Float[Array, ""]:
        """Compute the factor q by which the distances of the fibres shrink at a curvature."""
        return 1.0 + curvature * (self.odd + curvature * self.even)

    def slope_factor(self, curvature: Float[Array, ""]) -> Float[Array, ""]:
        """Compute the relative tangent stiffness of an elastic notch, times q^3."""
        return 1.0 - curvature * (self.odd + 3.0 * curvature * self.even)


class Fibres(Pytree):
    """Fibres of a section, for laws that sum their stresses.

    Attributes:
        arm: Distance of each fibre from the neutral axis, positive toward the spine, mm.
        area: Its area, mm^2.
    """

    arm: Float[Array, "*shape fibres"]
    area: Float[Array, "*shape fibres"]


class FibreSection(Pytree):
    """Properties of a cross-section about its neutral axis. Units mm.

    The section's x points to the cut side, z along the rod. Leading axes are allowed.

    Attributes:
        area: Area, mm^2.
        second_moment_weak: Second moment for bending that closes the notch (about y), mm^4.
        second_moment_strong: Second moment for sideways bending (about x), mm^4.
        torsion_constant: Torsion constant, mm^4.
        shear_centre: Distance of the shear centre from the neutral axis toward the spine, mm.
        edge_spine: Distance of the outer fibre on the spine from the neutral axis, mm.
        edge_near: Distance of the farthest fibre on the cut side, mm.
        ends: Compliance of the ends of the notch; None where no flexure of a chain has any.
        fibres: Its fibres; None where the material does not use them.
        edge_across: Distance from the line of symmetry to the farthest fibre on the cut side, mm.
        outer_radius: Radius of the arc that bounds the spine, mm; 0 for a straight line.
        half_angle: Half angle of that arc, rad.
    """

    area: Float[Array, "*shape"]
    second_moment_weak: Float[Array, "*shape"]
    second_moment_strong: Float[Array, "*shape"]
    torsion_constant: Float[Array, "*shape"]
    shear_centre: Float[Array, "*shape"]
    edge_spine: Float[Array, "*shape"]
    edge_near: Float[Array, "*shape"]
    ends: NotchEnds | None = None
    fibres: Fibres | None = None
    edge_across: Float[Array, "*shape"] | float = 0.0
    outer_radius: Float[Array, "*shape"] | float = 0.0
    half_angle: Float[Array, "*shape"] | float = 0.0

    def stiffened(self, factor: Float[Array, "*shape"]) -> FibreSection:
        """Multiply the stiffness in all directions; for plain arrays. Strains stay as they are."""
        names = ("area", "second_moment_weak", "second_moment_strong", "torsion_constant")
        moments = {name: constant(factor * getattr(self, name)) for name in names}
        ends, fibres = self.ends, self.fibres
        if ends is not None:
            ends = dataclasses.replace(ends, oblique=constant(factor * ends.oblique))
        if fibres is not None:
            fibres = dataclasses.replace(fibres, area=constant(factor[..., None] * fibres.area))
        return dataclasses.replace(self, **moments, ends=ends, fibres=fibres)

    @property
    def softens(self) -> bool:
        """Whether any section flattens as it bends; for plain arrays."""
        ends = self.ends
        return ends is not None and decide(xp.any(ends.odd) | xp.any(ends.even))


# Energy of the flattening of a notch at constant transformation.
#
# The moment M = Phi(s) / q with s = kappa / q does more work than fibres and ends absorb: the rest,
# Phi dX with dX = kappa q' / q^2 dkappa, flattens the notch. At constant transformed strains of the
# fibres the section is elastic, Phi = K (s - e), with one number e for the transformation of all
# fibres. The energy of flattening is then, with Y the integral of s dX,
#
#     psi(kappa, e) = K (Y(kappa) - e X(kappa)) + H(e),    d psi / d kappa = Phi X'.
#
# H belongs to the transformation. It makes the force on e vanish in the middle of the hysteresis,
# H'(e) = K X(kappa_m) where loading has transformed as much by halfway stresses, at kappa_m:
#
#     H(e) = K * integral of (e - e_m) dX over 0 ... kappa_m.
#
# A change of e thus dissipates (K X(kappa) - H'(e)) de, which is zero without hysteresis.

_POINTS, _TWICE = np.polynomial.legendre.leggauss(64)
NODES, WEIGHTS = 0.5 + 0.5 * _POINTS, 0.5 * _TWICE
"""Gauss's rule on 0 ... 1."""
_RULE = xp.stack([NODES, WEIGHTS], axis=-1)
# Lower bound of `even`, 1/mm^2, for sections that do not flatten: negligible, but above 0.
_MIN_EVEN = 1e-12
# With a smaller change of the transformation with s a section counts as elastic.
_MIN_SLOPE = 1e-9


class SectionBending(Protocol):
    """Bending of a section between its ends, see `SectionLaw.bent`."""

    @property
    def elastic_modulus(self) -> Array:
        """Young's modulus, MPa."""
        ...

    def bent(self, reduced: Array, section: FibreSection, memory: Any) -> Any:
        """Bend a section by s."""


class Flattening(NamedTuple):
    """Flattening of a section, per length."""

    path: Array  # X
    transformed: Array  # K e, N mm
    by_transformation: Array  # H, N mm/mm
    energy: Array  # psi, N mm/mm

    @classmethod
    def none(cls, like: Array) -> Flattening:
        """Return zero flattening."""
        return cls(*(jnp.zeros_like(like) for _ in cls._fields))


def flattening(
    law: SectionBending, curvature: Array, section: FibreSection, memory: Any
) -> Flattening:
    """Compute the flattening of a section at a curvature."""
    ends = section.ends
    assert ends is not None
    stiffness = law.elastic_modulus * section.second_moment_weak / (1.0 + ends.weak)

    def transformed(reduced: Array, past: Any) -> Array:
        return reduced - law.bent(reduced, section, past).moment / stiffness

    reduced = curvature / ends.flattening(curvature)
    own = transformed(reduced, memory)
    middle = curvature
    if not isinstance(memory, tuple):
        middle = _middle(law, section, reduced, own, stiffness)

    def add(total: tuple[Array, ...], node: Array) -> tuple[tuple[Array, ...], None]:
        path, elastic, transformation = total
        reduced, change = _along(ends, curvature, node)
        until, by = _along(ends, middle, node)
        return (
            path + change,
            elastic + reduced * change,
            transformation + (own - transformed(until, ())) * by,
        ), None

    none = jnp.zeros_like(curvature)
    path, elastic, transformation = jax.lax.scan(add, (none, none, none), constant(_RULE))[0]
    by_transformation = stiffness * transformation
    energy = stiffness * (elastic - own * path) + by_transformation
    return Flattening(path, stiffness * own, by_transformation, energy)


def _along(ends: NotchEnds, curvature: Array, node: Array) -> tuple[Array, Array]:
    """Return s at a node of the rule on 0 ... curvature, and its weight of dX."""
    at = node[0] * curvature
    q, slope = ends.flattening(at), ends.odd + 2.0 * ends.even * at
    return at / q, node[1] * curvature * at * slope / q**2


def _middle(
    law: SectionBending, section: FibreSection, start: Array, own: Array, stiffness: Array
) -> Array:
    """Find the curvature where loading by halfway stresses has transformed a section as much."""
    # Only the last Newton step is differentiated.
    ends = section.ends
    assert ends is not None

    def beyond(
        law: SectionBending, section: FibreSection, own: Array, stiffness: Array, reduced: Array
    ) -> tuple[Array, Array]:
        bent = law.bent(reduced, section, ())
        return reduced - bent.moment / stiffness - own, 1.0 - bent.slope / stiffness

    # s is largest at kappa^2 = 1 / even; the transformation is a fraction of it.
    root = jnp.sqrt(jnp.maximum(ends.even, _MIN_EVEN))
    side = jnp.where(own < 0.0, -1.0, 1.0)
    extreme = side / (2.0 * root + side * ends.odd)
    low, high = jnp.minimum(own, extreme), jnp.maximum(own, extreme)
    varied = law, section, own, stiffness
    bounds = jnp.clip(start, low, high), low, high
    fixed, fixed_bounds = jax.tree.map(jax.lax.stop_gradient, (varied, bounds))
    reduced = bracketed_root(partial(beyond, *fixed), *fixed_bounds)
    missing, slope = beyond(*varied, reduced)
    slope = jax.lax.stop_gradient(slope)
    transforms = slope > _MIN_SLOPE
    step = jnp.where(transforms, missing / jnp.where(transforms, slope, 1.0), 0.0)
    reduced = jnp.clip(reduced - step, *fixed_bounds[1:])
    # The solution of s = kappa / q before that largest one.
    linear = 1.0 - ends.odd * reduced
    square = jnp.maximum(linear**2 - 4.0 * ends.even * reduced**2, 0.0)
    return 2.0 * reduced / (linear + jnp.sqrt(square))


class SectionResponse(NamedTuple):
    """Response of a section law."""

    resultants: Float[Array, " 6"]  # Moments about x, y, z (N mm) and forces along x, y, z (N)
    memory: Any  # The memory after these strains
    # Change of the moment about y with the curvature about y, where the law provides it and all
    # else is elastic; None to differentiate
    slope: Float[Array, ""] | None = None


class Bending(NamedTuple):
    """A section between its ends, bent about the weak axis."""

    # Curvature of the section itself, beyond that of the free tube, 1/mm
    curvature: Float[Array, ""]
    moment: Float[Array, ""]  # Its moment, N mm
    memory: Any  # The memory after it
    # Change of the moment with s, where the law provides it; None to differentiate
    slope: Array | None = None
    strain: Array | float = 0.0  # Strain of the neutral axis, for laws of fibres


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
        """Compute resultants from strains beyond those of the free tube, N and N mm."""
        # Laws that bend many sections at once accept many.
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
        """Return the energy stored per length under given strains, N mm/mm."""
        # It is the area under the moment over the curvature, and the elastic energy of the other
        # strains. With hysteresis it is the energy of fibres, ends and flattening; the rest of the
        # area is dissipated.
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
    """Find the curvature of a section between its ends."""
    # Only the last Newton step is differentiated, from a constant point.
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
    """Compute the resultants of a linear elastic section about its neutral axis, with its ends."""
    # The axes through the centroid are principal, so bending and stretch do not couple. Shear along
    # y acts at the shear centre, `shear_centre` on the spine's side, where the section's shear is
    # v_y - shear_centre * twist: that couples it with torsion. The shear areas are the whole area
    # (Gao 2017 takes the same factor of 1).
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


# The largest strain of any fibre of a cross-section.
#
# The strain of a fibre is e + k x + c y: x from the neutral axis toward the spine, y from the line
# of symmetry. It is largest at a corner on the side of the cut, or on the outer arc of the spine.


class SectionStrain(NamedTuple):
    """Strains of a section itself, without those of its ends."""

    stretch: Array  # Strain of the neutral axis
    # Curvature about the weak axis, 1/mm; positive closes and stretches the spine
    curvature: Array
    sideways: Array  # Magnitude of the curvature about the strong axis, 1/mm


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
