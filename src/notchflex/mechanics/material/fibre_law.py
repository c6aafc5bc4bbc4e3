"""Laws of fibres: the stress of each depends on its strain and its history.

A fibre carries sigma = E (eps - e), with the transformed strain e between two curves over its
strain: a lower bound while the strain grows, and an upper bound while it shrinks. Between them e is
constant and the fibre is elastic: a rate-independent play operator with return-point memory. One
number per fibre is its memory, since unloading ends before the stress is zero. Without hysteresis
the two curves coincide.

The curvature k of the section and the strain of its neutral axis solve two equations: the axial
force vanishes, and section and ends (`law.py`) bend by s in total.
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.material.law import (
    Bending,
    Fibres,
    FibreSection,
    Scalar,
    SectionEnds,
    SectionLaw,
    moduli,
    moves_of,
    section_law,
)
from notchflex.robot import Nitinol, StressStrain


class FibreSums(NamedTuple):
    """Sums over the fibres: force (N) and moment (N mm), and how they change."""

    force: Array  # Axial force
    moment: Array  # Moment
    stretch: Array  # Change of the force with the strain of the neutral axis
    mixed: Array  # Change of the force with the curvature, and of the moment with that strain
    bending: Array  # Change of the moment with the curvature


def _step(
    joint: SectionEnds, curvature: Array, sums: FibreSums, slopes: FibreSums
) -> tuple[Array, Array]:
    """Return Newton's step of the strain of the neutral axis and of the curvature."""
    beyond = joint.beyond(curvature, sums.moment)
    by_strain = joint.soft * slopes.mixed
    by_curvature = joint.direct + joint.soft * slopes.bending
    determinant = slopes.stretch * by_curvature - slopes.mixed * by_strain
    strain = slopes.mixed * beyond - by_curvature * sums.force
    turn = by_strain * sums.force - slopes.stretch * beyond
    return strain / determinant, turn / determinant


def _settle(
    law: FibreLaw,
    fibres: Fibres,
    memory: Any,
    joint: SectionEnds,
    scale: tuple[Array, Array],
    start: Array,
) -> tuple[Array, Array, FibreSums]:
    """Find strain of the neutral axis, curvature and sums of all sections, from a curvature."""
    # One condition stops the iteration of all sections; they may have leading axes, and laws too.
    sum_fibres = FibreLaw.sum_fibres
    for _ in law.change.shape[1:]:
        sum_fibres = jax.vmap(sum_fibres)
    bending_strain = scale[0] * jnp.abs(joint.reduced)

    def proceed(search: tuple[Array, ...]) -> Array:
        *_, imbalance, iterations = search
        return jnp.any(imbalance > 1e-13 * bending_strain) & (iterations < 60)

    def improve(search: tuple[Any, ...]) -> tuple[Any, ...]:
        """Try a step: take it where the imbalance falls, halve it elsewhere."""
        strain, curvature, by_strain, by_curvature, sums, imbalance, iterations = search
        trial = strain + by_strain, curvature + by_curvature
        trial_sums = sum_fibres(law, fibres, memory, *trial)
        bends_beyond = joint.beyond(trial[1], trial_sums.moment)
        # Of forces and of bending, as strains.
        size = jnp.abs(trial_sums.force) / scale[1] + scale[0] * jnp.abs(bends_beyond)
        falls = size < imbalance
        step = _step(joint, trial[1], trial_sums, trial_sums)
        # With all fibres on a plateau a step would be endless.
        longest = 0.2 * bending_strain / jnp.maximum(jnp.abs(step[0]), 1e-300)
        by = [jnp.minimum(longest, 1.0) * part for part in step]
        new = *trial, *by, trial_sums, size
        old = strain, curvature, 0.5 * by_strain, 0.5 * by_curvature, sums, imbalance
        return *jax.tree.map(lambda *pair: jnp.where(falls, *pair), new, old), iterations + 1

    none, far = jnp.zeros_like(start), jnp.full_like(start, jnp.inf)
    begin = none, start, none, none, FibreSums(*[none] * 5), far, jnp.zeros((), int)
    strain, curvature, _, _, sums, *_ = jax.lax.while_loop(proceed, improve, begin)
    return strain, curvature, sums


settle_fibres = jax.custom_batching.custom_vmap(_settle)


@settle_fibres.def_vmap
def _(size: int, batched: Any, law: FibreLaw, *sections: Any) -> tuple[Any, Any]:
    all_batched = True, True, FibreSums._make([True] * 5)
    # A law of each section has leading axes too, all of them.
    shared = law.change.ndim == 1 and not any(jax.tree.leaves(batched[0]))
    rows = jax.tree.map(
        lambda varies, leaf: leaf if varies else jnp.broadcast_to(leaf, (size, *jnp.shape(leaf))),
        list(batched[shared:]),
        [law, *sections][shared:],
    )
    return settle_fibres(*[law][:shared], *rows), all_batched


@jax.custom_jvp
def same_sums(sums: FibreSums, *of: Any) -> FibreSums:
    """Return known sums over fibres, with the derivatives of the summation."""
    # Without differentiation nothing is summed or traced.
    return sums


@same_sums.defjvp
def _(primals: tuple[Any, ...], tangents: tuple[Any, ...]) -> tuple[FibreSums, FibreSums]:
    (sums, *of), (_, *moved) = primals, tangents
    return sums, jax.jvp(lambda law, *rest: law.sum_fibres(*rest), of, moved)[1]


_KINKS = 8  # kinks per loop iteration: more lengthen programs, fewer slow them down

FLATTEST = 1e-9
"""Least slope of a plateau over Young's modulus: it keeps the balance of fibres solvable.

Over a strain of 0.1 it adds 1e-10 of Young's modulus to the stress, 1e-8 of a usual plateau.
"""


class _Curve(NamedTuple):
    """Transformed strain over strain: positions of the kinks, and changes of slope there."""

    low: Array
    high: Array
    change: Array

    def under(self, strain: Array) -> tuple[Array, Array, Array]:
        """Evaluate the transformed strain, its slope and twice its area."""
        none = jnp.zeros_like(strain)

        def add(total: Any, kinks: _Curve) -> tuple[Any, None]:
            transformed, slope, square = total
            for low, high, change in zip(*kinks, strict=True):
                beyond = strain - jnp.clip(strain, low, high)
                transformed = transformed + change * beyond
                slope = slope + jnp.where(beyond != 0.0, change, 0.0)
                square = square + change * beyond**2
            return (transformed, slope, square), None

        if len(self.change) <= _KINKS:
            return add((none, none, none), self)[0]
        parts = jax.tree.map(lambda array: jnp.reshape(array, (-1, _KINKS)), self)
        return jax.lax.scan(add, (none, none, none), parts)[0]


class FibreLaw(SectionLaw):
    """Fibres that transform; everything but bending about the weak axis is elastic."""

    # The transformed strain on a curve is a sum over its kinks: change * (strain - the strain
    # clipped between low and high).

    moving = "low", "high"
    # Strain in compression where each kink of the lower and of the upper curve lies; one curve
    # without hysteresis
    low: Float[Array, "curves kinks"]
    high: Float[Array, "curves kinks"]  # The same in tension
    change: Float[Array, " kinks"]  # Change of transformed strain per strain at each kink

    @property
    def remembers(self) -> bool:
        """Whether loading and unloading differ."""
        return self.low.shape[-2] == 2

    def rest(self, section: FibreSection) -> Any:
        """Return untransformed fibres."""
        assert section.fibres is not None
        return constant(xp.zeros(xp.shape(section.fibres.arm))) if self.remembers else ()

    def moment(self, curvature: Scalar, section: FibreSection) -> Scalar:
        """Return the moment halfway between loading and unloading."""
        return self.bent(curvature, dataclasses.replace(section, ends=None), ()).moment

    def bent(self, reduced: Float[Array, "*shape"], section: FibreSection, memory: Any) -> Bending:
        """Bend sections between their ends; only the last Newton step is differentiated."""
        fibres = section.fibres
        assert fibres is not None
        joint = self.joint(reduced, section)
        start = reduced / (1.0 + section.compliance.weak)
        scale = section.edge_near, self.elastic_modulus * section.area
        everything = self, fibres, memory, joint, scale, start
        fixed_arguments = jax.tree.map(jax.lax.stop_gradient, everything)
        strain, curvature, slopes = settle_fibres(*fixed_arguments)
        sums = same_sums(slopes, self, fibres, memory, strain, curvature)
        by_strain, by_curvature = _step(joint, curvature, sums, slopes)
        free = slopes.bending - slopes.mixed**2 / slopes.stretch
        if not isinstance(memory, tuple):
            moves = strain, curvature, by_strain, by_curvature
            memory = self._remember(fibres, memory, moves)
        return Bending(
            curvature=curvature + by_curvature,
            moment=sums.moment + slopes.mixed * by_strain + slopes.bending * by_curvature,
            memory=memory,
            slope=fixed_arguments[3].slope(free),
            strain=strain + by_strain,
        )

    def sum_fibres(self, fibres: Fibres, memory: Any, strain: Array, curvature: Array) -> FibreSums:
        """Sum over the fibres of a section, or of many."""
        curves = self._curves(memory)

        def add(total: FibreSums, some: tuple[Array, Array, Any]) -> tuple[FibreSums, None]:
            arm, area, past = some
            stretch = _along(strain, curvature, arm)
            transformed, slope = self._transformed(stretch, past, curves)
            force, tangent = area * (stretch - transformed), area * (1.0 - slope)
            turning = tangent * arm
            parts = force, force * arm, tangent, turning, turning * arm
            added = FibreSums(*(jnp.sum(part, axis=-1) for part in parts))
            return jax.tree.map(jnp.add, total, added), None

        none = FibreSums(*[jnp.zeros_like(strain)] * 5)
        parts = jax.tree.map(_in_parts, (fibres.arm, fibres.area, memory))
        sums = jax.lax.scan(add, none, parts)[0]
        return jax.tree.map(lambda total: self.elastic_modulus * total, sums)

    def _remember(self, fibres: Fibres, memory: Array, moves: tuple[Array, ...]) -> Array:
        """Compute the memory after the last step, linearised about the iterate before it."""
        curves = self._curves(memory)
        strain, curvature, by_strain, by_curvature = moves

        def some(none: None, some: tuple[Array, Array, Array]) -> tuple[None, Array]:
            arm, still, past = some
            transformed, slope = self._transformed(_along(strain, curvature, arm), past, curves)
            moved = _along(by_strain, by_curvature, still)
            return none, transformed + jax.lax.stop_gradient(slope) * moved

        parts = jax.tree.map(_in_parts, (fibres.arm, jax.lax.stop_gradient(fibres.arm), memory))
        transformed = jnp.moveaxis(jax.lax.scan(some, None, parts)[1], 0, -2)
        return jnp.reshape(transformed, memory.shape)

    def _transformed(self, strain: Array, past: Any, curves: list[_Curve]) -> tuple[Array, Array]:
        """Compute the transformed strain of fibres after a strain, and its slope."""
        if isinstance(past, tuple):
            return curves[0].under(strain)[:2]
        (lower, by_lower), (upper, by_upper) = (curve.under(strain)[:2] for curve in curves)
        # One condition for value and slope: the derivative of a fibre on a curve, as where friction
        # holds its notch, must be consistent with its slope.
        on_upper, on_lower = past >= upper - 1e-12, past <= lower + 1e-12
        transformed = jnp.where(on_lower, lower, jnp.where(on_upper, upper, past))
        return transformed, jnp.where(on_lower, by_lower, jnp.where(on_upper, by_upper, 0.0))

    def _curves(self, memory: Any) -> list[_Curve]:
        """Return the lower and the upper curve; for fibres without memory the mean curve."""
        if isinstance(memory, tuple):
            return [self._halfway()]
        return [_Curve(*kinks, self.change) for kinks in zip(self.low, self.high, strict=True)]

    def _halfway(self) -> _Curve:
        """Return the mean curve of loading and unloading."""
        return _Curve(jnp.mean(self.low, axis=0), jnp.mean(self.high, axis=0), self.change)

    def bending_energy(self, curvature: Scalar, section: FibreSection, memory: Any) -> Scalar:
        """Return the energy of fibres; with hysteresis that of the mean curve, plus elastic."""
        fibres, plain = section.fibres, dataclasses.replace(section, ends=None)
        assert fibres is not None
        bent = self.bent(curvature, plain, memory)
        strain = bent.strain + bent.curvature * fibres.arm
        if isinstance(memory, tuple):
            return fibres.area @ self._area_under(strain)
        # Strain at which the mean curve has the same transformed strain.
        (low, *_), (high, *_), _ = self._halfway()
        transformed = bent.memory
        onset = jnp.where(transformed > 0.0, high, jnp.where(transformed < 0.0, low, 0.0))
        curve_strain = onset + transformed / self.change[0]
        elastic = (strain - transformed) ** 2 - (curve_strain - transformed) ** 2
        return fibres.area @ (self._area_under(curve_strain) + 0.5 * self.elastic_modulus * elastic)

    def _area_under(self, strain: Array) -> Array:
        """Integrate the stress of the mean curve up to a strain, N mm/mm^3."""
        return 0.5 * self.elastic_modulus * (strain**2 - self._halfway().under(strain)[2])

    def dissipated(self, section: FibreSection, before: Any, after: Any) -> Any:
        """Return the energy per length lost between two memories, N mm/mm; for plain arrays."""
        if not self.remembers or section.fibres is None:
            return super().dissipated(section, before, after)
        loss = 0.0
        for side, kinks in (xp.minimum, self.low), (xp.maximum, self.high):
            change = xp.abs(side(after, 0.0) - side(before, 0.0))
            loss = loss + 0.5 * self.elastic_modulus * xp.abs(kinks[1, 0] - kinks[0, 0]) * change
        return section.compliance.direct * xp.sum(loss * section.fibres.area, axis=-1)


def _in_parts(array: Array) -> Array:
    """Split the values of fibres into parts of five, as leading axis."""
    parts = jnp.reshape(array, (*array.shape[:-1], -1, 5))
    return jnp.moveaxis(parts, -2, 0)


def _along(strain: Array, curvature: Array, arm: Array) -> Array:
    """Compute the strain of fibres from that of the neutral axis and the curvature."""
    return strain[..., None] + curvature[..., None] * arm


# Nitinol: elastic, a plateau with hardening, unloading on a plateau of its own.


@section_law.register
def _(material: Nitinol) -> FibreLaw:
    modulus, ratio = material.elastic_modulus, material.compression_ratio
    loading, *lower = (stress / modulus for stress in material.plateaus)
    # A fibre does not fall below loading in tension, nor below unloading in compression.
    tension, compression = [loading], [-ratio * loading]
    for unloading in lower:
        tension, compression = [loading, unloading], [-ratio * unloading, -ratio * loading]
    low, high = xp.array(compression)[:, None], xp.array(tension)[:, None]
    change = xp.array([1.0 - xp.maximum(material.plateau_modulus / modulus, FLATTEST)])
    if material.transformation_strain is not None:
        length = material.transformation_strain - material.plateau_stress / modulus
        low, high = xp.hstack([low, low - length]), xp.hstack([high, high + length])
        change = xp.append(change, -change)
    moves = moves_of(material, [[-ratio]], [[1.0]])
    return FibreLaw(*moduli(material), *map(constant, (low, high, change)), moves=moves)


# A curve of stress over strain: each of its points is a kink.

_NEVER = 1e6  # a strain that no fibre reaches


@section_law.register
def _(material: StressStrain) -> FibreLaw:
    modulus = material.elastic_modulus
    high, change = _kinks(*material.in_tension, modulus)
    low = -high
    if material.in_compression is not None:
        strain, by = _kinks(*material.in_compression, modulus)
        low = xp.append(xp.full(len(high), -_NEVER), -strain)
        high = xp.append(high, xp.full(len(strain), _NEVER))
        change = xp.append(change, by)
    # Numbers of kinks are powers of two, so that curves share programs.
    spare = (0, (1 << (len(change) - 1).bit_length()) - len(change))
    low, high = (
        xp.pad(kinks, spare, constant_values=far)[None]
        for kinks, far in ((low, -_NEVER), (high, _NEVER))
    )
    return FibreLaw(*moduli(material), *map(constant, (low, high, xp.pad(change, spare))))


@lru_cache(maxsize=64)
def _kinks(
    strain: tuple[float, ...], stress: tuple[float, ...], modulus: float
) -> tuple[Array, Array]:
    """List the kinks of a curve, and the fall of slope there over Young's modulus."""
    corners, value = _few_points(xp.append(0.0, strain), xp.append(0.0, stress))
    slope = xp.maximum(xp.diff(value) / xp.diff(corners) / modulus, FLATTEST)
    change = -xp.diff(slope, prepend=1.0)
    turns = xp.abs(change) > 1e-12  # at zero only where compression begins with another slope
    if not turns.any():
        turns[0] = True
    return corners[:-1][turns], change[turns]


def _few_points(strain: Array, stress: Array) -> tuple[Array, Array]:
    """Keep the first point, the last and few between them; chords pass the others closely."""
    off = 1e-6 * stress[-1]
    chosen, last = [0], len(strain) - 1
    while chosen[-1] < last:
        begin = chosen[-1]
        least, most, reached = -np.inf, np.inf, begin + 1
        for point in range(begin + 1, last + 1):
            run, rise = strain[point] - strain[begin], stress[point] - stress[begin]
            if least <= rise / run <= most:
                reached = point
            least, most = max(least, (rise - off) / run), min(most, (rise + off) / run)
            if least > most:
                break
        chosen.append(reached)
    index = np.array(chosen)
    return strain[index], stress[index]
