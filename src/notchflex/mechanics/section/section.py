"""The cross-section that a cut leaves of a tube, as the numbers a rod needs."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jax.typing import ArrayLike

from notchflex._jax import array_module, constant, jax


class Section(NamedTuple):
    """Properties of one cross-section (or of many: every field then has the same shape).

    The section is symmetric about the line through the tube axis and the spine, the wall
    that the cut leaves. Positions are measured along that line from the tube axis, positive
    toward the spine, that is away from the cut. A named tuple is a pytree, so sections go
    through `jit`, `vmap` and `grad` as they are.

    Attributes:
        area: Area of the material, mm².
        centroid: Distance from the tube axis to the centroid, the neutral axis of the bending
            of the notch, mm.
        second_moment_weak: Second moment for the bending of the notch, about the axis through
            the centroid perpendicular to the line of symmetry, mm⁴. (Weak for deep cuts; the
            name stays for shallow ones, and where it passes the other one.)
        second_moment_strong: Second moment for bending sideways, about the line of symmetry,
            mm⁴.
        torsion_constant: Saint-Venant torsion constant, mm⁴.
        shear_centre: Distance from the tube axis to the shear centre (Trefftz, that is for
            Poisson's ratio 0), mm.
        edge_near: Distance from the neutral axis to the farthest fibre on the side of the cut,
            mm.
        edge_spine: Distance from the neutral axis to the outer fibre of the spine, mm.
        edge_across: Distance from the line of symmetry to the farthest fibre on the side of the
            cut, mm.
        outer_radius: Radius of the arc that bounds the spine, about the tube axis, mm; 0 where the
            spine ends in a line as wide as the side of the cut.
        half_angle: Half angle of that arc, rad.
    """

    area: jax.Array
    centroid: jax.Array
    second_moment_weak: jax.Array
    second_moment_strong: jax.Array
    torsion_constant: jax.Array
    shear_centre: jax.Array
    edge_near: jax.Array
    edge_spine: jax.Array
    edge_across: jax.Array
    outer_radius: jax.Array
    half_angle: jax.Array


def plain_or_compiled(
    properties: Callable[[jax.Array, jax.Array, jax.Array], Section],
) -> Callable[[ArrayLike, ArrayLike, ArrayLike], Section]:
    """Let a formula for arrays of one shape take radii and depth in any form.

    Args:
        properties: Section of outer radius, inner radius and depth, written with `array_module`.

    Returns:
        The same for numbers and arrays that broadcast: by NumPy where they are plain, compiled
        by JAX where one is an array of JAX or traced.
    """
    compiled = jax.jit(properties)

    @lru_cache(maxsize=1024)  # notches of a tube, and their sites, share sections
    def of_numbers(outer: float, inner: float, depth: float) -> Section:
        properties_of_cut = properties(constant(outer), constant(inner), constant(depth))
        return Section(*(_fixed(value) for value in properties_of_cut))

    def section(outer: ArrayLike, inner: ArrayLike, depth: ArrayLike) -> Section:
        if isinstance(outer, float) and isinstance(inner, float) and isinstance(depth, float):
            return of_numbers(float(outer), float(inner), float(depth))
        xp = array_module(outer, inner, depth)
        chosen = properties if xp is np else compiled
        return chosen(
            *(xp.asarray(value, dtype=float) for value in xp.broadcast_arrays(outer, inner, depth))
        )

    return section


def _fixed(value: jax.Array) -> jax.Array:
    """Return a number as a read-only array, since results are cached."""
    array = np.array(value)
    array.setflags(write=False)
    return array  # pyright: ignore[reportReturnType]
