"""The cross-section that a cut leaves of a tube, as the numbers a rod needs."""

from collections.abc import Callable
from typing import NamedTuple

from jax.typing import ArrayLike

from notchflex._arrays import cached, xp
from notchflex._jax import constant, jax
from notchflex._values import read_only


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


def of_any_shape(
    properties: Callable[[jax.Array, jax.Array, jax.Array], Section],
) -> Callable[[ArrayLike, ArrayLike, ArrayLike], Section]:
    """Let a formula for arrays of one shape take radii and depth in any form.

    Args:
        properties: Section of outer radius, inner radius and depth.

    Returns:
        The same for numbers and arrays that broadcast; read-only, as it is kept for plain numbers.
    """

    @cached(1024)  # notches of a tube, and their sites, share sections
    def section(outer: ArrayLike, inner: ArrayLike, depth: ArrayLike) -> Section:
        numbers = xp.broadcast_arrays(*map(constant, (outer, inner, depth)))
        return Section(*map(read_only, properties(*numbers)))

    return section
