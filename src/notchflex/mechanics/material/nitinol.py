"""Nitinol by fibres: elastic, a plateau with hardening, unloading on a plateau of its own.

A fibre carries sigma = E (eps - e), with the transformed strain e between two curves over its
strain: one that it does not fall below while the strain grows, and one that it does not exceed
while it shrinks. Between them e stays and the fibre is elastic: a play operator, independent of
rate, whose loops close (return-point memory). One number a fibre remembers the past, since
unloading ends before the stress is gone. Without hysteresis the two curves are one.

The curvature k of the section and the strain of its neutral axis follow together: the forces of
the fibres vanish in sum, and section and ends (`law.py`) bend by s between them.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.material.fibre_section import Fibres, FibreSection
from notchflex.mechanics.material.law import Bending, SectionLaw, section_law
from notchflex.robot import Nitinol

# Newton's iterations from the elastic solution.
_ITERATIONS = 10
# So many fibres at once: programs get longer with more, and slower with fewer.
_AT_ONCE = 8
# A transformed strain this near to a curve goes on along it.
_ON_CURVE = 1e-12

# Length of a plateau without end, as a strain.
_ENDLESS = 1e6


class _Sums(NamedTuple):
    """Sums over the fibres: force (N) and moment (N mm), and how they change.

    Attributes:
        force: Axial force.
        moment: Moment.
        stretch: Change of the force with the strain of the neutral axis.
        mixed: Change of the force with the curvature, and of the moment with that strain.
        bending: Change of the moment with the curvature.
    """

    force: Array
    moment: Array
    stretch: Array
    mixed: Array
    bending: Array


class _Joint(NamedTuple):
    """The section between its ends: own * k + soft * moment = s."""

    own: Array | float
    soft: Array | float
    reduced: Array

    def step(self, curvature: Array, sums: _Sums, slopes: _Sums) -> tuple[Array, Array]:
        """Newton's step of the strain of the neutral axis and of the curvature."""
        beyond = self.own * curvature + self.soft * sums.moment - self.reduced
        by_strain, by_curvature = self.soft * slopes.mixed, self.own + self.soft * slopes.bending
        determinant = slopes.stretch * by_curvature - slopes.mixed * by_strain
        strain = slopes.mixed * beyond - by_curvature * sums.force
        return strain / determinant, (
            by_strain * sums.force - slopes.stretch * beyond
        ) / determinant

    def size(self, curvature: Array, sums: _Sums, modulus: Array, section: FibreSection) -> Array:
        """Imbalance of forces and of bending, as strains."""
        beyond = self.own * curvature + self.soft * sums.moment - self.reduced
        stretch = sums.force / (modulus * section.area)
        return jnp.abs(stretch) + section.edge_near * jnp.abs(beyond)

    def slope(self, slopes: _Sums) -> Array:
        """Change of the moment with s."""
        free = slopes.bending - slopes.mixed**2 / slopes.stretch
        return free / (self.own + self.soft * free)


class NitinolLaw(SectionLaw):
    """Fibres that transform; everything but bending about the weak axis is elastic.

    Attributes:
        onset: Strain from which each segment of the lower and of the upper curve transforms;
            one curve without hysteresis.
        side: 1 for segments of tension, -1 for those of compression.
        length: Strain over which a segment transforms.
        slope: Transformed strain per strain in it.
    """

    onset: Float[Array, "curves segments"]
    side: Float[Array, " segments"]
    length: Float[Array, " segments"]
    slope: Float[Array, " segments"]

    @property
    def remembers(self) -> bool:
        """Whether loading and unloading differ."""
        return self.onset.shape[0] == 2

    def rest(self, section: FibreSection) -> Any:
        """No fibre is transformed."""
        assert section.fibres is not None
        return constant(np.zeros(np.shape(section.fibres.arm))) if self.remembers else ()

    def moment(self, curvature: Float[Array, ""], section: FibreSection) -> Float[Array, ""]:
        """Moment halfway between loading and unloading."""
        return self.bent(curvature, dataclasses.replace(section, ends=None), ()).moment

    def bent(self, reduced: Float[Array, ""], section: FibreSection, memory: Any) -> Bending:
        """Bend the section between its ends; the last of Newton's steps is differentiated."""
        fibres, ends = section.fibres, section.ends
        assert fibres is not None
        weak, share = (0.0, 0.0) if ends is None else (ends.weak, ends.material_share)
        rigidity = self.elastic_modulus * section.second_moment_weak
        joint = _Joint(1.0 + share * weak, (1.0 - share) * weak / rigidity, reduced)
        everything = self, fibres, memory, joint
        still, held, past, fixed = jax.tree.map(jax.lax.stop_gradient, everything)

        def improve(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
            """Try a step: the next one where the imbalance falls, half of it where not."""
            strain, curvature, *steps, least = search
            trial = strain + steps[0], curvature + steps[1]
            sums = still._sum(held, past, *trial)[0]
            size = fixed.size(trial[1], sums, still.elastic_modulus, section)
            falls = size < least
            steps = [
                jnp.where(falls, new, 0.5 * old)
                for new, old in zip(fixed.step(trial[1], sums, sums), steps, strict=True)
            ]
            strain, curvature = (
                jnp.where(falls, new, old)
                for new, old in zip(trial, (strain, curvature), strict=True)
            )
            return strain, curvature, *steps, jnp.where(falls, size, least)

        elastic = fixed.reduced / (1.0 + jax.lax.stop_gradient(weak))
        none, far = jnp.zeros_like(elastic), jnp.full_like(elastic, jnp.inf)
        begin = none, elastic, none, none, far
        strain, curvature, *steps, _ = jax.lax.fori_loop(0, _ITERATIONS, improve, begin)
        strain, curvature = strain + steps[0], curvature + steps[1]
        sums, transformed, slope = self._sum(fibres, memory, strain, curvature)
        slopes: _Sums = jax.tree.map(jax.lax.stop_gradient, sums)
        by_strain, by_curvature = joint.step(curvature, sums, slopes)
        if not isinstance(memory, tuple):
            moved = by_strain + by_curvature * held.arm
            memory = transformed + jax.lax.stop_gradient(slope) * moved
        return Bending(
            curvature=curvature + by_curvature,
            moment=sums.moment + slopes.mixed * by_strain + slopes.bending * by_curvature,
            memory=memory,
            slope=fixed.slope(slopes),
            strain=strain + by_strain,
        )

    def _sum(
        self, fibres: Fibres, memory: Any, strain: Array, curvature: Array
    ) -> tuple[_Sums, Array, Array]:
        """Sums over the fibres, transformed strain of each and its change with the strain."""

        def some(array: Array) -> Array:
            return jnp.reshape(array, (-1, _AT_ONCE))

        def add(total: _Sums, some: tuple[Array, Array, Any]) -> tuple[_Sums, tuple[Array, Array]]:
            arm, area, past = some
            own = strain + curvature * arm
            transformed, slope = self._transformed(own, past)
            force = area * self.elastic_modulus * (own - transformed)
            tangent = area * self.elastic_modulus * (1.0 - slope)
            parts = force, force * arm, tangent, tangent * arm, tangent * arm**2
            added = _Sums(*(jnp.sum(part) for part in parts))
            return jax.tree.map(jnp.add, total, added), (transformed, slope)

        none = _Sums(*(jnp.zeros_like(strain) for _ in _Sums._fields))
        every = some(fibres.arm), some(fibres.area), jax.tree.map(some, memory)
        sums, (transformed, slope) = jax.lax.scan(add, none, every)
        shape = fibres.arm.shape
        return sums, jnp.reshape(transformed, shape), jnp.reshape(slope, shape)

    def _transformed(self, strain: Array, past: Any) -> tuple[Array, Array]:
        """Transformed strain of fibres after a strain, and its change with that strain."""
        if isinstance(past, tuple):
            return self._curve(strain, jnp.mean(self.onset, axis=0))
        (lower, by_lower), (upper, by_upper) = (self._curve(strain, at) for at in self.onset)
        transformed = jnp.where(past < lower, lower, jnp.where(past > upper, upper, past))
        slope = jnp.where(past >= upper - _ON_CURVE, by_upper, 0.0)
        return transformed, jnp.where(past <= lower + _ON_CURVE, by_lower, slope)

    def _curve(self, strain: Array, onset: Array) -> tuple[Array, Array]:
        """Transformed strain on a curve, and its slope."""
        transformed, slope = jnp.zeros_like(strain), jnp.zeros_like(strain)
        for side, start, length, by in self._segments(onset):
            beyond = side * (strain - start)
            transformed = transformed + side * by * jnp.clip(beyond, 0.0, length)
            slope = slope + jnp.where((beyond > 0.0) & (beyond < length), by, 0.0)
        return transformed, slope

    def _segments(self, onset: Array) -> list[tuple[Array, ...]]:
        """Side, onset, length and slope of every segment of a curve."""
        parts = self.side, onset, self.length, self.slope
        return [tuple(part[j] for part in parts) for j in range(self.side.shape[0])]

    def bending_energy(
        self, curvature: Float[Array, ""], section: FibreSection, memory: Any
    ) -> Float[Array, ""]:
        """Energy that the fibres hold: with hysteresis that of the curve halfway, and elastic."""
        fibres, plain = section.fibres, dataclasses.replace(section, ends=None)
        assert fibres is not None
        bent = self.bent(curvature, plain, memory)
        strain, halfway = bent.strain + bent.curvature * fibres.arm, jnp.mean(self.onset, axis=0)
        if isinstance(memory, tuple):
            return fibres.area @ self._area_under(strain, halfway)
        # Where the curve halfway has the same transformed strain.
        there, transformed = jnp.zeros_like(strain), bent.memory
        for side, start, _, by in self._segments(halfway):
            there = there + jnp.where(side * transformed > 0.0, start + transformed / by, 0.0)
        elastic = (strain - transformed) ** 2 - (there - transformed) ** 2
        held = self._area_under(there, halfway) + 0.5 * self.elastic_modulus * elastic
        return fibres.area @ held

    def _area_under(self, strain: Array, onset: Array) -> Array:
        """Area under the stress of a curve up to a strain, N mm/mm^3."""
        area = 0.5 * strain**2
        for side, start, length, by in self._segments(onset):
            beyond = side * (strain - start)
            within = jnp.clip(beyond, 0.0, length)
            area = area - by * within * (beyond - 0.5 * within)
        return self.elastic_modulus * area

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Energy per length turned to heat between two memories, N mm/mm; for plain arrays."""
        if not self.remembers or section.fibres is None:
            return super().dissipated(section, before, after)
        loss = np.zeros(np.shape(after))
        for number, side in enumerate(np.asarray(self.side)):
            width = self.elastic_modulus * np.abs(self.onset[0, number] - self.onset[1, number])
            change = np.maximum(side * after, 0.0) - np.maximum(side * before, 0.0)
            loss = loss + 0.5 * width * np.abs(change)
        ends = section.ends
        follows = 1.0 if ends is None else 1.0 + ends.material_share * ends.weak
        return follows * np.sum(loss * section.fibres.area, axis=-1)


@section_law.register
def _(material: Nitinol) -> NitinolLaw:
    modulus, hardening = material.elastic_modulus, material.plateau_modulus
    loading = material.plateau_stress / modulus
    ratio = material.compression_ratio
    curves = [(loading, -ratio * loading)]
    if material.unloading_stress is not None:
        unloading = material.unloading_stress / modulus
        # A fibre does not fall below loading in tension, nor below unloading in compression.
        curves = [(loading, -ratio * unloading), (unloading, -ratio * loading)]
    end = material.transformation_strain
    return NitinolLaw(
        elastic_modulus=constant(modulus),
        shear_modulus=constant(modulus / (2.0 * (1.0 + material.poisson_ratio))),
        onset=constant(curves),
        side=constant([1.0, -1.0]),
        length=constant([_ENDLESS if end is None else end - loading] * 2),
        slope=constant([1.0 - hardening / modulus] * 2),
    )
