r"""Energy of the flattening of a notch at constant transformation.

The moment M = Phi(s) / q with s = kappa / q does more work than fibres and ends absorb: the rest,
Phi dX with dX = kappa q' / q^2 dkappa, flattens the notch. At constant transformed strains of the
fibres the section is elastic, Phi = K (s - e), with one number e for the transformation of all
fibres. The energy of flattening is then, with Y the integral of s dX,

    psi(kappa, e) = K (Y(kappa) - e X(kappa)) + H(e),    d psi / d kappa = Phi X'.

H belongs to the transformation. It makes the force on e vanish in the middle of the hysteresis,
H'(e) = K X(kappa_m) where loading has transformed as much by halfway stresses, at kappa_m:

    H(e) = K * integral of (e - e_m) dX over 0 ... kappa_m.

A change of e thus dissipates (K X(kappa) - H'(e)) de, which is zero without hysteresis.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from jaxtyping import Array

from notchflex._arrays import xp
from notchflex._jax import constant, jax, jnp
from notchflex.mechanics.material.fibre_section import FibreSection, NotchEnds
from notchflex.mechanics.material.root import bracketed_root

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
    """Flattening of a section, per length.

    Attributes:
        path: X.
        transformed: K e, N mm.
        by_transformation: H, N mm/mm.
        energy: psi, N mm/mm.
    """

    path: Array
    transformed: Array
    by_transformation: Array
    energy: Array

    @classmethod
    def none(cls, like: Array) -> Flattening:
        """Return zero flattening."""
        return cls(*(jnp.zeros_like(like) for _ in cls._fields))


def flattening(
    law: SectionBending, curvature: Array, section: FibreSection, memory: Any
) -> Flattening:
    """Compute the flattening of a section at a curvature.

    Args:
        law: Its material.
        curvature: Curvature kappa of the notch, 1/mm.
        section: The section; its notch has ends.
        memory: Memory of the material; () for laws without memory.

    Returns:
        Path, transformation and energy of the flattening.
    """
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
    """Find the curvature where loading by halfway stresses has transformed a section as much.

    Only the last Newton step is differentiated.
    """
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
