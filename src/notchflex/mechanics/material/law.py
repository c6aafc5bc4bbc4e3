"""Section laws: resultants of a cross-section from strains and memory.

Each law is a file in this folder that registers itself for its description by
`section_law.register`; the package imports every file of the folder.

All materials have the same interface for a cross-section of a flexure, so the chain does not depend
on the material. A law gives the bending moment over the curvature; the rest is linear, and the ends
of the notch are added here, for all laws:

    s = kappa / q,   (1 + c w) k + (1 - c) w Phi(k) / (E I) = s,   M = Phi(k) / q

with the curvature k of the section itself, its moment Phi(k), the end compliance w of which a
share c follows the material, and the flattening q. Bending flattens the section, and so does the
rings' yielding to the stress of the arc, which goes with Phi instead of kappa: q falls by 1 + a e,

    q = (1 + odd kappa + even kappa^2) / (1 + a e),   e = s - (1 + w) Phi(k) / (E I)

with the curvature e by transformation, and that part a of `odd`.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial, singledispatch
from typing import Any, ClassVar, NamedTuple, Self

from jaxtyping import Array, Bool, Float, Int

from notchflex._arrays import decide, xp
from notchflex._imports import unregistered
from notchflex._jax import Pytree, choose, constant, jax, jnp
from notchflex.mechanics.section import gauss_on

Scalar = Float[Array, ""]
Each = Float[Array, "*shape"]
Strain = Float[Array, "*shape 6"]
"""Curvatures about x, y, z (1/mm), shear along x, y, stretch along z; or resultants of these."""


def bracketed_root(
    beyond: Callable[..., tuple[Array, Array]], varied: Any, start: Array, low: Array, high: Array
) -> Array:
    """Find the root of a rising function by Newton's method with bisection."""
    # The function of `varied` and the unknown returns its value and slope. Only a last Newton step
    # is differentiated. A bilinear law takes three of the 20 steps, a plastic branch up to 19.
    fixed, bracket = jax.tree.map(
        jax.lax.stop_gradient, (varied, (start, low, high, 2.0 * (high - low)))
    )

    def improve(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        root, low, high, last_step = search
        value, slope = beyond(*fixed, root)
        low = jnp.where(value <= 0.0, root, low)
        high = jnp.where(value >= 0.0, root, high)
        step = -value / slope
        new = root + step
        # At the root a step is rounding, and may be longer than the last one.
        falls = jnp.abs(step) <= 0.5 * last_step + 1e-12 * jnp.abs(root)
        new = jnp.where(falls & (new >= low) & (new <= high), new, 0.5 * (low + high))
        return new, low, high, jnp.abs(new - root)

    root = jax.lax.fori_loop(0, 20, improve, bracket)[0]
    value, slope = beyond(*varied, root)
    slope = jax.lax.stop_gradient(slope)
    return root - jnp.where(slope > 1e-9, value, 0.0) / jnp.maximum(slope, 1e-9)


class SectionEnds(NamedTuple):
    """The section between its ends: direct * k + soft * moment = x, which is `reduced`."""

    direct: Array
    soft: Array
    reduced: Array

    def beyond(self, curvature: Array, moment: Array) -> Array:
        """Return by how much section and ends bend beyond x."""
        return self.direct * curvature + self.soft * moment - self.reduced

    def slope(self, free: Array) -> Array:
        """Return the change of the moment with x, from that with the section's own curvature."""
        return free / (self.direct + self.soft * free)


class NotchEnds(Pytree):
    """Compliance of the rings beside a notch, added to that of its section.

    Attributes:
        weak: Fraction added in the bending of the notch.
        strong: In sideways bending.
        axial: In stretch.
        torsion: In torsion.
        odd: Flattening by bending: the distance of the fibres falls to 1/q of their own,
            q = 1 + odd * kappa + even * kappa^2, at the elastic curvature kappa about the weak
            axis (positive closes), mm.
        even: Its even part, mm^2.
        warped: Part of `odd` by the rings, which goes with the moment of the section, mm.
        material_share: Share of `weak` that follows the material; the rest stays elastic.
        sway: In shear sideways.
        push: In shear in the plane of bending.
        oblique: Moment about x by the twist, and torsion moment by the curvature about x, over
            Young's modulus, mm^4; its square is below the product of both stiffnesses.
    """

    # Compliances are fractions of that of the section along the length of the flexure: a stiffness
    # is that of the section over 1 + fraction. A fraction may be negative, above -1, for stiff
    # ends.

    weak: Each | float = 0.0
    strong: Each | float = 0.0
    axial: Each | float = 0.0
    torsion: Each | float = 0.0
    odd: Each | float = 0.0
    even: Each | float = 0.0
    warped: Each | float = 0.0
    material_share: Each | float = 0.0
    sway: Each | float = 0.0
    push: Each | float = 0.0
    oblique: Each | float = 0.0

    @property
    def direct(self) -> Any:
        """Bend of a section with the part of the ends that follows its material, over its own."""
        return 1.0 + self.material_share * self.weak

    def flattening(self, curvature: Scalar) -> Scalar:
        """Compute the factor q by which the distances of elastic fibres shrink at a curvature."""
        return 1.0 + curvature * (self.odd + curvature * self.even)

    def slope_factor(self, curvature: Scalar) -> Scalar:
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
    """Properties of a cross-section about its neutral axis, mm; x to the cut, z along the rod.

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

    area: Each
    second_moment_weak: Each
    second_moment_strong: Each
    torsion_constant: Each
    shear_centre: Each
    edge_spine: Each
    edge_near: Each
    ends: NotchEnds | None = None
    fibres: Fibres | None = None
    edge_across: Each | float = 0.0
    outer_radius: Each | float = 0.0
    half_angle: Each | float = 0.0

    def stiffened(self, factor: Each) -> FibreSection:
        """Multiply the stiffness in all directions. Strains stay as they are."""
        names = ("area", "second_moment_weak", "second_moment_strong", "torsion_constant")
        scaled: dict[str, Any] = {name: factor * getattr(self, name) for name in names}
        if (ends := self.ends) is not None:
            scaled["ends"] = dataclasses.replace(ends, oblique=factor * ends.oblique)
        if (fibres := self.fibres) is not None:
            area = constant(factor[..., None] * fibres.area)
            scaled["fibres"] = dataclasses.replace(fibres, area=area)
        return dataclasses.replace(self, **scaled)

    @property
    def compliance(self) -> NotchEnds:
        """Compliance of its ends, rigid ones where it has none."""
        return self.ends or NotchEnds()

    @property
    def softens(self) -> bool:
        """Whether any section flattens as it bends; for plain arrays."""
        return decide(xp.any(self.compliance.odd) | xp.any(self.compliance.even))


# Energy of the flattening of a notch at constant transformation.
#
# The moment M = Phi(s) / q with s = kappa / q does more work than fibres and ends absorb. With
# p = 1 + odd kappa + even kappa^2, g = 1 + a e = p / q, x = kappa / p, dX = kappa p' / p^2 dkappa,
# the rest, Phi (g dX - a x de), flattens the notch. At constant transformed strains of the fibres
# the section is elastic, Phi = K (s - e), with one number e for the transformation of all fibres.
# The energy of flattening is then, with Y the integral of x dX,
#
#     psi(kappa, e) = K g (g Y(kappa) - e X(kappa)) + H(e),    d psi / d kappa = Phi g X'.
#
# H belongs to the transformation. It makes the force on e vanish in the middle of the hysteresis,
# where loading by halfway stresses transforms as much, at kappa_m: all work is stored on this way,
#
#     H(e) = K * integral of (s_m - e_m) (g_m dX - a x de_m) - g (g x - e) dX over 0 ... kappa_m,
#
# in which de_m is integrated by parts, as it jumps where a fibre yields. A change of e thus
# dissipates (K R - H'(e)) de, R = (g + a e) X - 2 a g Y - a x (g x - e), zero without hysteresis.

NODES, WEIGHTS = gauss_on(0.0, 1.0, 64)
"""Gauss's rule on 0 ... 1."""


class Flattening(NamedTuple):
    """Flattening of a section, per length."""

    path: Array  # R
    transformed: Array  # K e, N mm
    by_transformation: Array  # H, N mm/mm
    energy: Array  # psi, N mm/mm


def flattening(law: SectionLaw, curvature: Array, section: FibreSection, memory: Any) -> Flattening:
    """Compute the flattening of a section at a curvature."""
    ends = section.compliance
    stiffness = law.elastic_modulus * section.second_moment_weak / (1.0 + ends.weak)

    def transformed(reduced: Array, past: Any) -> Transformed:
        return law.transformed(reduced, law.bent(reduced, section, past), section)

    reduced = curvature / ends.flattening(curvature)
    (present, gain, *_), middle = transformed(reduced, memory), curvature
    if not isinstance(memory, tuple):
        middle = _middle(law, section, reduced, present)

    def add(total: tuple[Array, ...], node: Array) -> tuple[tuple[Array, ...], None]:
        path, elastic, transformation = total
        at, change, _ = _along(ends, curvature, node)
        until, flat, bent = _along(ends, middle, node)
        on_way, its_gain, *_ = transformed(until, ())
        more = its_gain * (its_gain * until - on_way) - gain * (gain * until - present)
        by_parts = on_way * (2.0 * until - on_way * (0.5 - ends.warped * until))
        stored = more * flat + ends.warped * by_parts * bent
        return (path + change, elastic + at * change, transformation + stored), None

    none, last = jnp.zeros_like(curvature), middle / ends.flattening(middle)
    path, elastic, transformation = jax.lax.scan(
        add, (none, none, none), constant(xp.stack([NODES, WEIGHTS], axis=-1))
    )[0]
    at_last = present * last * (last - 0.5 * present * (1.0 - ends.warped * last))
    by_transformation = stiffness * (transformation - ends.warped * at_last)
    energy = stiffness * gain * (gain * elastic - present * path) + by_transformation
    path = (2.0 * gain - 1.0) * path - 2.0 * ends.warped * gain * elastic
    path -= ends.warped * reduced * (gain * reduced - present)
    return Flattening(path, stiffness * present, by_transformation, energy)


def _along(ends: NotchEnds, curvature: Array, node: Array) -> tuple[Array, Array, Array]:
    """Return x at a node of the rule on 0 ... curvature, and its weights of dX and of dx."""
    part = node[0] * curvature
    q, slope = ends.flattening(part), ends.odd + 2.0 * ends.even * part
    flat, all_of = part * slope / q**2, node[1] * curvature
    return part / q, all_of * flat, all_of * (1.0 / q - flat)


def _middle(law: SectionLaw, section: FibreSection, start: Array, present: Array) -> Array:
    """Find the curvature where loading by halfway stresses has transformed a section as much."""
    ends = section.compliance

    def beyond(
        law: SectionLaw, section: FibreSection, present: Array, reduced: Array
    ) -> tuple[Array, Array]:
        found = law.transformed(reduced, law.bent(reduced, section, ()), section)
        return found.curvature - present, found.by

    # x is largest at kappa^2 = 1 / even; the transformation is a fraction of it. Where a section
    # does not flatten, `even` is negligible, but above 0.
    root = jnp.sqrt(jnp.maximum(ends.even, 1e-12))
    side = jnp.where(present < 0.0, -1.0, 1.0)
    extreme = side / (2.0 * root + side * ends.odd)
    least = present / (1.0 + ends.warped * present)
    low, high = jnp.minimum(least, extreme), jnp.maximum(least, extreme)
    bounds = jax.lax.stop_gradient((low, high))
    varied = law, section, present
    reduced = jnp.clip(bracketed_root(beyond, varied, jnp.clip(start, *bounds), *bounds), *bounds)
    # The solution of x = kappa / p before that largest one.
    linear = 1.0 - ends.odd * reduced
    square = jnp.maximum(linear**2 - 4.0 * ends.even * reduced**2, 0.0)
    return 2.0 * reduced / (linear + jnp.sqrt(square))


class SectionResponse(NamedTuple):
    """Response of a section law."""

    resultants: Strain  # Moments about x, y, z (N mm) and forces along x, y, z (N)
    memory: Any  # The memory after these strains
    slope: Scalar  # Change of the moment about y with the curvature about y; the rest is elastic


class Bending(NamedTuple):
    """A section between its ends, bent about the weak axis."""

    # Curvature of the section itself, beyond that of the free tube, 1/mm
    curvature: Scalar
    moment: Scalar  # Its moment, N mm
    memory: Any  # The memory after it
    slope: Array  # Change of the moment with s, at constant 1 + a e
    strain: Array | float = 0.0  # Strain of the neutral axis, for laws of fibres


class Transformed(NamedTuple):
    """What the transformation adds to the elastic bending of a section between its ends."""

    curvature: Array  # e, 1/mm
    gain: Array  # 1 + a e
    slope: Array  # Change of the moment with x
    by: Array  # Change of e with x


# Mask of weak-axis bending among strains and resultants.
_WEAK = xp.arange(6) == 1


class Law(Pytree):
    """What the chain needs of the law of a section, of any kind.

    Attributes:
        is_linear: Whether the moment of a section is proportional to its curvature.
        axis: Axis of its numbers that runs along the flexures; None where one law serves all.
        moving: Names of its strains that move with the temperature, each by its own of `moves`.
        lumped: Whether it is that of a flexure as a whole: no moment between is missed, and the
            strains of its section are not known.
    """

    is_linear: ClassVar[bool] = False
    axis: ClassVar[int | None] = None
    lumped: ClassVar[bool] = False
    moving: ClassVar[tuple[str, ...]] = ()
    respond: ClassVar[Callable[..., SectionResponse]]
    bent: ClassVar[Callable[..., Bending]]
    elastic: ClassVar[Callable[..., Strain]]
    tangent: ClassVar[Callable[..., Strain]]
    covers: ClassVar[Callable[..., Array]]
    stored_energy_density: ClassVar[Callable[..., tuple[Scalar, Flattening]]]
    # How far each strain of `moving` moves with the temperature, 1/K; () where they stay
    moves: tuple[Any, ...] = dataclasses.field(default=(), kw_only=True)

    @property
    def remembers(self) -> bool:
        """Whether the moment depends on the past."""
        return False

    def rest(self, section: FibreSection) -> Any:
        """Return the memory of a free section, or of many; () for laws without memory."""
        return ()

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Return the energy per length lost between two memories, N mm/mm; for plain arrays."""
        return xp.zeros(xp.shape(section.area))

    def warmed(self, rise: Scalar) -> Self:
        """Return the law at a higher temperature, K; what has transformed stays."""
        pairs = zip(self.moving, self.moves, strict=False)
        strains = {name: getattr(self, name) + move * rise for name, move in pairs}
        return dataclasses.replace(self, **strains)

    def stiffness(self, section: FibreSection) -> Float[Array, "*shape 6 6"]:
        """Compute the stiffness in the free robot, of a section or of many."""
        plain = dataclasses.replace(section, fibres=None)
        columns = jax.tree.map(lambda leaf: xp.asarray(leaf)[..., None], plain)
        return self.elastic(constant(xp.eye(6)), columns).swapaxes(-1, -2)


class SectionLaw(Law, ABC):
    """Section law of a material. Tangents are derivatives of the resultants.

    Attributes:
        elastic_modulus: Young's modulus in the free robot, MPa.
        shear_modulus: Shear modulus, MPa.
    """

    elastic_modulus: Scalar
    shear_modulus: Scalar

    def covers(self, strain: Strain, section: FibreSection) -> Bool[Array, "*shape"]:
        """Return whether no fibre is shortened to nothing."""
        farthest = jnp.maximum(section.edge_spine, section.edge_near)
        return jnp.abs(strain[..., 1]) * farthest < 1.0

    def tangent(self, strain: Strain, slope: Array, section: FibreSection) -> Strain:
        """Return the change of the resultants with many strains, of the slope about y."""
        columns = jax.tree.map(lambda leaf: leaf[..., None], section)
        return jnp.where(_WEAK, slope * strain, self.elastic(strain.T, columns))

    @abstractmethod
    def moment(self, curvature: Scalar, section: FibreSection) -> Scalar:
        """Return the moment of a section without ends at a curvature about its weak axis, N mm."""

    @abstractmethod
    def bending_energy(self, curvature: Scalar, section: FibreSection, memory: Any) -> Scalar:
        """Return the energy per length of a section without ends at a curvature, N mm/mm."""

    def joint(self, reduced: Each, section: FibreSection) -> SectionEnds:
        """Join sections to their ends, as they flatten at x (`reduced`)."""
        ends, rigidity = section.compliance, self.elastic_modulus * section.second_moment_weak
        soft = (1.0 - ends.material_share) * ends.weak
        follows = ends.warped * reduced * ends.direct
        return SectionEnds(ends.direct - follows, (soft + follows) / rigidity, reduced)

    def transformed(self, reduced: Each, bending: Bending, section: FibreSection) -> Transformed:
        """Compute what the transformation of bent sections adds to their elastic bending."""
        ends, rigidity = section.compliance, self.elastic_modulus * section.second_moment_weak
        curvature = ends.direct * (bending.curvature - bending.moment / rigidity)
        gain = 1.0 + ends.warped * curvature
        slope = gain * bending.slope
        by = (gain - slope * (1.0 + ends.weak) / rigidity) / (1.0 - ends.warped * reduced)
        return Transformed(curvature, gain, slope, by)

    def bent(self, reduced: Each, section: FibreSection, memory: Any) -> Bending:
        """Bend sections between their ends by x, kappa / p; for laws without memory."""

        def moment(law: SectionLaw, section: FibreSection, curvature: Array) -> tuple[Array, Array]:
            moment_at = partial(law.moment, section=section)
            return jax.jvp(moment_at, (curvature,), (jnp.ones_like(curvature),))

        def beyond(
            law: SectionLaw, section: FibreSection, reduced: Array, curvature: Array
        ) -> tuple[Array, Array]:
            joint, (bends, slope) = law.joint(reduced, section), moment(law, section, curvature)
            return joint.beyond(curvature, bends), joint.direct + joint.soft * slope

        curvature = reduced / (1.0 + section.compliance.weak)
        joint = self.joint(reduced, section)
        if not self.is_linear and section.ends is not None:
            # Bound: a section without resistance, where only what follows it limits it.
            most = reduced / joint.direct
            bounds = jnp.minimum(most, 0.0), jnp.maximum(most, 0.0)
            curvature = bracketed_root(beyond, (self, section, reduced), curvature, *bounds)
        bends, slope = moment(self, section, curvature)
        return Bending(curvature, bends, memory, joint.slope(slope))

    def respond(self, strain: Strain, section: FibreSection, memory: Any) -> SectionResponse:
        """Compute resultants from strains beyond those of the free tube, of one section or many."""
        elastic = self.elastic(jnp.moveaxis(strain, -1, 0), section)
        ends, curvature = section.compliance, strain[..., 1]
        q = ends.flattening(curvature)
        bending = self.bent(curvature / q, section, memory)
        _, gain, slope, by = self.transformed(curvature / q, bending, section)
        by_q, moment = (ends.odd + 2.0 * ends.even * curvature) / q, gain * bending.moment
        slope = gain * slope + ends.warped * by * bending.moment
        slope = (slope * (1.0 - curvature * by_q) / q - moment * by_q) / q
        resultants = jnp.where(_WEAK, (moment / q)[..., None], elastic)
        return SectionResponse(resultants, bending.memory, slope)

    def stored_energy_density(
        self, strain: Strain, section: FibreSection, memory: Any
    ) -> tuple[Scalar, Flattening]:
        """Compute the stored energy per length, N mm/mm, and the flattening of the section."""
        # It is the area under the moment over the curvature, and the elastic energy of the other
        # strains. With hysteresis it is the energy of fibres, ends and flattening; the rest of the
        # area is dissipated.
        others = 0.5 * jnp.where(_WEAK, 0.0, self.elastic(strain, section)) @ strain
        ends, curvature = section.compliance, strain[1]
        bending = self.bent(curvature / ends.flattening(curvature), section, memory)
        joint = self.joint(jnp.zeros_like(curvature), section)
        stored = joint.direct * self.bending_energy(bending.curvature, section, memory)
        if section.ends is None:
            return others + stored, Flattening(*[jnp.zeros_like(curvature)] * 4)
        stored += 0.5 * joint.soft * bending.moment**2
        flat = flattening(self, curvature, section, memory)
        return others + stored + flat.energy, flat

    def elastic(self, strain: Strain, section: FibreSection) -> Strain:
        """Compute the resultants with the moduli of the free robot, of components first."""
        # The axes through the centroid are principal, so bending and stretch do not couple. Shear
        # along y acts at the shear centre, `shear_centre` on the spine's side, where the section's
        # shear is v_y - shear_centre * twist: that couples it with torsion. The shear areas are
        # the area of the section (Gao 2017 takes the same factor of 1).
        ends, young, shear = section.compliance, self.elastic_modulus, self.shear_modulus
        about_x, about_y, twist, along_x, along_y, stretch = (strain[k] for k in range(6))
        across = shear * section.area * (along_y - section.shear_centre * twist) / (1.0 + ends.sway)
        torsion = shear * section.torsion_constant * (twist / (1.0 + ends.torsion))
        torsion = torsion + young * ends.oblique * about_x
        sideways = young * section.second_moment_strong * (about_x / (1.0 + ends.strong))
        resultants = [
            sideways + young * ends.oblique * twist,
            young * section.second_moment_weak * (about_y / (1.0 + ends.weak)),
            torsion - section.shear_centre * across,
            shear * section.area * (along_x / (1.0 + ends.push)),
            across,
            young * section.area * (stretch / (1.0 + ends.axial)),
        ]
        return xp.stack(resultants, axis=-1)


def _of_kind(name: str, *, after: bool = False) -> Any:
    """Return a method of a mixed law; `after` a memory, which is then its last argument."""

    def method(mixed: MixedLaw, *arguments: Any) -> Any:
        *others, memory = arguments
        results: list[Any] = []
        for law in mixed.laws:
            forgets = after and not law.remembers
            results.append(getattr(law, name)(*others, () if forgets else memory))
            if forgets and hasattr(results[-1], "memory"):
                results[-1] = results[-1]._replace(memory=memory)
        return mixed.chosen(results)

    return method


class MixedLaw(Law):
    """Laws of several materials, one for each flexure; its methods are those of one flexure."""

    axis = 0
    kind: Int[Array, "*n"]  # Which of the laws it is
    laws: tuple[Law, ...]  # One of every kind; where it is not meant its numbers are of another

    respond = _of_kind("respond", after=True)
    bent = _of_kind("bent", after=True)
    stored_energy_density = _of_kind("stored_energy_density", after=True)
    elastic, tangent, covers = map(_of_kind, ("elastic", "tangent", "covers"))

    @classmethod
    def of(cls, laws: Sequence[Law]) -> MixedLaw:
        """Join the laws of flexures, one for each."""
        forms = [repr(jax.tree.map(xp.shape, law)) for law in laws]
        kinds = [*dict.fromkeys(forms)]
        columns = [
            [laws[k if own == form else forms.index(form)] for k, own in enumerate(forms)]
            for form in kinds
        ]
        stacked = (jax.tree.map(lambda *leaves: xp.stack(leaves), *same) for same in columns)
        return cls(xp.array([*map(kinds.index, forms)]), tuple(stacked))

    @property
    def is_linear(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Whether all are."""
        return all(law.is_linear for law in self.laws)

    @property
    def lumped(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Whether that of each flexure is; False where none is."""
        each = [jnp.full(self.kind.shape, law.lumped) for law in self.laws]
        return any(law.lumped for law in self.laws) and self.chosen(each)

    @property
    def remembers(self) -> bool:
        """Whether any of them does."""
        return any(law.remembers for law in self.laws)

    def warmed(self, rise: Scalar) -> Self:
        """Return the laws at a higher temperature, K."""
        return dataclasses.replace(self, laws=tuple(law.warmed(rise) for law in self.laws))

    def rest(self, section: FibreSection) -> Any:
        """Return the memory of free sections, which serves all laws that remember."""
        return next((law.rest(section) for law in self.laws if law.remembers), ())

    def chosen(self, results: Sequence[Any]) -> Any:
        """Choose among what each of the laws gives."""
        chosen = results[0]
        for number, result in enumerate(results[1:], 1):
            chosen = choose(self.kind == number, result, chosen)
        return chosen

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Return the energy per length lost in all flexures between rows of their memories."""

        def lost(law: MixedLaw, *between: Any) -> Array:
            return law.chosen([one.dissipated(*between) for one in law.laws])

        rows = jax.vmap(lost, (None, None, 0, 0))
        return jax.vmap(rows, (0, 0, 1, 1), 1)(self, section, before, after)


def moduli(material: Any) -> tuple[Array, Array]:
    """Return Young's modulus and the shear modulus of a material description, MPa."""
    modulus = constant(material.elastic_modulus)
    return modulus, modulus / (2.0 * (1.0 + material.poisson_ratio))


def moves_of(material: Any, *sides: Any) -> tuple[Array, ...]:
    """Return the moves of a law whose strains move by shares (`sides`) of a stress."""
    # Clausius and Clapeyron: the stress of a transformation changes in proportion to temperature.
    if material.reference_temperature is None:
        return ()
    by_kelvin = material.stress_per_kelvin / material.elastic_modulus
    return tuple(constant(by_kelvin * xp.array(side)) for side in sides)


@singledispatch
def section_law(material: Any) -> Law:
    """Return the section law of a material description."""
    raise unregistered("section law", material, "material", "section_law")
