"""Balance of the fibres of a section: strain of the neutral axis, and curvature between its ends.

Both are unknowns of two equations: the axial force vanishes, and section and ends (`law.py`) bend
by s in total.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from jaxtyping import Array

from notchflex._jax import jax, jnp
from notchflex.mechanics.material.fibre_section import Fibres

# Newton's method stops at this imbalance relative to the bending strain, or at this iteration.
_BALANCED, _MAX_ITERATIONS = 1e-13, 60
# Longest step relative to the bending strain: with all fibres on a plateau it would be endless.
_LONGEST, _TINY = 0.2, 1e-300


class FibreSums(NamedTuple):
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


class SectionEnds(NamedTuple):
    """The section between its ends: own * k + soft * moment = s."""

    own: Array | float
    soft: Array | float
    reduced: Array

    def step(self, curvature: Array, sums: FibreSums, slopes: FibreSums) -> tuple[Array, Array]:
        """Return Newton's step of the strain of the neutral axis and of the curvature."""
        beyond = self.own * curvature + self.soft * sums.moment - self.reduced
        by_strain, by_curvature = self.soft * slopes.mixed, self.own + self.soft * slopes.bending
        determinant = slopes.stretch * by_curvature - slopes.mixed * by_strain
        strain = slopes.mixed * beyond - by_curvature * sums.force
        return strain / determinant, (
            by_strain * sums.force - slopes.stretch * beyond
        ) / determinant

    def size(self, curvature: Array, sums: FibreSums, scale: tuple[Array, Array]) -> Array:
        """Return the imbalance of forces and of bending, as strains."""
        beyond = self.own * curvature + self.soft * sums.moment - self.reduced
        return jnp.abs(sums.force) / scale[1] + scale[0] * jnp.abs(beyond)

    def slope(self, slopes: FibreSums) -> Array:
        """Return the change of the moment with s."""
        free = slopes.bending - slopes.mixed**2 / slopes.stretch
        return free / (self.own + self.soft * free)


class SumsFibres(Protocol):
    """A law that sums up the stress of fibres."""

    def sum_fibres(self, fibres: Fibres, memory: Any, strain: Array, curvature: Array) -> FibreSums:
        """Sum over the fibres of a section, or of many."""
        ...


def _settle(
    law: SumsFibres,
    fibres: Fibres,
    memory: Any,
    joint: SectionEnds,
    scale: tuple[Array, Array],
    start: Array,
) -> tuple[Array, Array, FibreSums]:
    """Find strain of the neutral axis, curvature and sums of all sections, from a curvature.

    One condition stops the iteration of all sections; they may have leading axes.
    """
    bending_strain = scale[0] * jnp.abs(joint.reduced)

    def proceed(search: tuple[Array, ...]) -> Array:
        *_, imbalance, iterations = search
        return jnp.any(imbalance > _BALANCED * bending_strain) & (iterations < _MAX_ITERATIONS)

    def improve(search: tuple[Any, ...]) -> tuple[Any, ...]:
        """Try a step: take it where the imbalance falls, halve it elsewhere."""
        strain, curvature, by_strain, by_curvature, sums, imbalance, iterations = search
        trial = strain + by_strain, curvature + by_curvature
        trial_sums = law.sum_fibres(fibres, memory, *trial)
        size = joint.size(trial[1], trial_sums, scale)
        falls = size < imbalance
        step = joint.step(trial[1], trial_sums, trial_sums)
        longest = _LONGEST * bending_strain / jnp.maximum(jnp.abs(step[0]), _TINY)
        by = [jnp.minimum(longest, 1.0) * part for part in step]
        new = *trial, *by, trial_sums, size
        old = strain, curvature, 0.5 * by_strain, 0.5 * by_curvature, sums, imbalance
        return *jax.tree.map(lambda *pair: jnp.where(falls, *pair), new, old), iterations + 1

    none, far = jnp.zeros_like(start), jnp.full_like(start, jnp.inf)
    sums = FibreSums(*(none for _ in FibreSums._fields))
    begin = none, start, none, none, sums, far, jnp.zeros((), int)
    strain, curvature, _, _, sums, *_ = jax.lax.while_loop(proceed, improve, begin)
    return strain, curvature, sums


settle_fibres = jax.custom_batching.custom_vmap(_settle)


@settle_fibres.def_vmap
def _(size: int, batched: Any, law: SumsFibres, *sections: Any) -> tuple[Any, Any]:
    all_batched = True, True, FibreSums._make([True] * len(FibreSums._fields))
    if any(jax.tree.leaves(batched[0])):  # rows of a batch that is not one of sections
        axes = jax.tree.map(lambda one: 0 if one else None, list(batched))
        return jax.vmap(_settle, in_axes=tuple(axes))(law, *sections), all_batched
    every = jax.tree.map(
        lambda one, leaf: leaf if one else jnp.broadcast_to(leaf, (size, *jnp.shape(leaf))),
        list(batched[1:]),
        list(sections),
    )
    return settle_fibres(law, *every), all_batched


@jax.custom_jvp
def same_sums(sums: FibreSums, *of: Any) -> FibreSums:
    """Return known sums over fibres, with the derivatives of the summation.

    Without differentiation nothing is summed or traced.
    """
    del of
    return sums


def _change_of_sums(
    primals: tuple[Any, ...], tangents: tuple[Any, ...]
) -> tuple[FibreSums, FibreSums]:
    """Differentiate with respect to the varying arguments only."""
    (sums, *of), (_, *moved) = primals, tangents
    leaves, tree = jax.tree.flatten(of)
    by = jax.tree.leaves(moved, is_leaf=_is_still)
    varies = [index for index, one in enumerate(by) if not _is_still(one)]

    def again(*varied: Array) -> FibreSums:
        every = list(leaves)
        for index, one in zip(varies, varied, strict=True):
            every[index] = one
        law, *rest = jax.tree.unflatten(tree, every)
        return law.sum_fibres(*rest)

    at, along = [leaves[index] for index in varies], [by[index] for index in varies]
    return sums, jax.jvp(again, at, along)[1]


def _is_still(tangent: Any) -> bool:
    return isinstance(tangent, jax.custom_derivatives.SymbolicZero)


same_sums.defjvp(_change_of_sums, symbolic_zeros=True)
