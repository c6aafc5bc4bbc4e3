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

# Newton's method ends at this imbalance, as a part of the strain of bending, or after many tries.
_BALANCED, _MOST_TRIES = 1e-13, 16
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

    def size(self, curvature: Array, sums: _Sums, scale: tuple[Array, Array]) -> Array:
        """Imbalance of forces and of bending, as strains."""
        beyond = self.own * curvature + self.soft * sums.moment - self.reduced
        return jnp.abs(sums.force) / scale[1] + scale[0] * jnp.abs(beyond)

    def slope(self, slopes: _Sums) -> Array:
        """Change of the moment with s."""
        free = slopes.bending - slopes.mixed**2 / slopes.stretch
        return free / (self.own + self.soft * free)


class NitinolLaw(SectionLaw):
    """Fibres that transform; everything but bending about the weak axis is elastic.

    Attributes:
        onset: Strain from which each segment of the lower and of the upper curve transforms;
            one curve without hysteresis.
        low: Strain beyond the onset up to which a segment transforms in compression; 0 in tension.
        high: The same in tension; 0 in compression.
        slope: Transformed strain per strain in it.
    """

    onset: Float[Array, "curves segments"]
    low: Float[Array, " segments"]
    high: Float[Array, " segments"]
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
        start = reduced / (1.0 + weak)
        scale = section.edge_near, self.elastic_modulus * section.area
        everything = self, fibres, memory, joint, scale, start
        still = jax.tree.map(jax.lax.stop_gradient, everything)
        strain, curvature = _settled(*still)
        _, held, _, fixed, *_ = still
        sums, transformed, slope = self.sum_fibres(fibres, memory, strain, curvature)
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

    def sum_fibres(
        self, fibres: Fibres, memory: Any, strain: Array, curvature: Array
    ) -> tuple[_Sums, Array, Array]:
        """Sums over the fibres, transformed strain of each and its change with the strain."""

        def some(array: Array) -> Array:
            return jnp.reshape(array, (-1, _AT_ONCE))

        def add(total: _Sums, some: tuple[Array, Array, Any]) -> tuple[_Sums, tuple[Array, Array]]:
            arm, area, past = some
            own = strain + curvature * arm
            transformed, slope = self._transformed(own, past)
            force, tangent = area * (own - transformed), area * (1.0 - slope)
            parts = force, force * arm, tangent, tangent * arm, tangent * arm * arm
            added = _Sums(*(jnp.sum(part) for part in parts))
            return jax.tree.map(jnp.add, total, added), (transformed, slope)

        none = _Sums(*(jnp.zeros_like(strain) for _ in _Sums._fields))
        every = some(fibres.arm), some(fibres.area), jax.tree.map(some, memory)
        sums, (transformed, slope) = jax.lax.scan(add, none, every)
        sums = jax.tree.map(lambda total: self.elastic_modulus * total, sums)
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
        for start, low, high, by in self._segments(onset):
            beyond = strain - start
            within = jnp.clip(beyond, low, high)
            transformed = transformed + by * within
            slope = slope + jnp.where(within == beyond, by, 0.0)
        return transformed, slope

    def _segments(self, onset: Array) -> list[tuple[Array, ...]]:
        """Onset, limits and slope of every segment of a curve."""
        parts = onset, self.low, self.high, self.slope
        return [tuple(part[j] for part in parts) for j in range(self.slope.shape[0])]

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
        for start, low, high, by in self._segments(halfway):
            part = jnp.clip(transformed / by, low, high)
            there = there + jnp.where(part != 0.0, start + part, 0.0)
        elastic = (strain - transformed) ** 2 - (there - transformed) ** 2
        held = self._area_under(there, halfway) + 0.5 * self.elastic_modulus * elastic
        return fibres.area @ held

    def _area_under(self, strain: Array, onset: Array) -> Array:
        """Area under the stress of a curve up to a strain, N mm/mm^3."""
        area = 0.5 * strain**2
        for start, low, high, by in self._segments(onset):
            beyond = strain - start
            within = jnp.clip(beyond, low, high)
            area = area - by * within * (beyond - 0.5 * within)
        return self.elastic_modulus * area

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Energy per length turned to heat between two memories, N mm/mm; for plain arrays."""
        if not self.remembers or section.fibres is None:
            return super().dissipated(section, before, after)
        loss = np.zeros(np.shape(after))
        for lower, upper, low, high, by in zip(
            *self.onset, self.low, self.high, self.slope, strict=True
        ):
            width = self.elastic_modulus * np.abs(upper - lower)
            change = np.clip(after, by * low, by * high) - np.clip(before, by * low, by * high)
            loss = loss + 0.5 * width * np.abs(change)
        ends = section.ends
        follows = 1.0 if ends is None else 1.0 + ends.material_share * ends.weak
        return follows * np.sum(loss * section.fibres.area, axis=-1)


def _settle(
    law: NitinolLaw,
    fibres: Fibres,
    memory: Any,
    joint: _Joint,
    scale: tuple[Array, Array],
    start: Array,
) -> tuple[Array, Array]:
    """Find strain of the neutral axis and curvature of all sections together, from a curvature.

    Together, so that one condition stops the search, whose sections may have leading axes.
    """
    balance = law.sum_fibres
    for _ in start.shape:
        balance = jax.vmap(balance)

    def proceed(search: tuple[Array, ...]) -> Array:
        *_, least, tries = search
        return jnp.any(least > _BALANCED * scale[0] * jnp.abs(joint.reduced)) & (
            tries < _MOST_TRIES
        )

    def improve(search: tuple[Array, ...]) -> tuple[Array, ...]:
        """Try a step: the next one where the imbalance falls, half of it where not."""
        strain, curvature, by_strain, by_curvature, least, tries = search
        trial = strain + by_strain, curvature + by_curvature
        sums = balance(fibres, memory, *trial)[0]
        size = joint.size(trial[1], sums, scale)
        falls = size < least
        new = *trial, *joint.step(trial[1], sums, sums), size
        old = strain, curvature, 0.5 * by_strain, 0.5 * by_curvature, least
        kept = (jnp.where(falls, *pair) for pair in zip(new, old, strict=True))
        return *kept, tries + 1

    none, far = jnp.zeros_like(start), jnp.full_like(start, jnp.inf)
    begin = none, start, none, none, far, jnp.zeros((), int)
    strain, curvature, by_strain, by_curvature, *_ = jax.lax.while_loop(proceed, improve, begin)
    return strain + by_strain, curvature + by_curvature


_settled = jax.custom_batching.custom_vmap(_settle)


@_settled.def_vmap
def _(size: int, batched: Any, law: NitinolLaw, *sections: Any) -> tuple[Any, tuple[bool, bool]]:
    if any(jax.tree.leaves(batched[0])):  # rows of a batch that is not one of sections
        axes = jax.tree.map(lambda one: 0 if one else None, list(batched))
        return jax.vmap(_settle, in_axes=tuple(axes))(law, *sections), (True, True)
    every = jax.tree.map(
        lambda one, leaf: leaf if one else jnp.broadcast_to(leaf, (size, *jnp.shape(leaf))),
        list(batched[1:]),
        list(sections),
    )
    return _settled(law, *every), (True, True)


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
    length = _ENDLESS if end is None else end - loading
    return NitinolLaw(
        elastic_modulus=constant(modulus),
        shear_modulus=constant(modulus / (2.0 * (1.0 + material.poisson_ratio))),
        onset=constant(curves),
        low=constant([0.0, -length]),
        high=constant([length, 0.0]),
        slope=constant([1.0 - hardening / modulus] * 2),
    )
