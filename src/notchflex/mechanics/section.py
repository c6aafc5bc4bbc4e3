"""The cross-section that a cut leaves of a tube, as the numbers a rod needs."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

from notchflex._arrays import cached, is_traced, xp
from notchflex._jax import constant, jax, scan
from notchflex._values import read_only


@lru_cache(maxsize=64)
def leggauss(count: int) -> Any:
    """Return Gauss's nodes from -1 to 1 and their weights, read-only."""
    return tuple(map(read_only, np.polynomial.legendre.leggauss(count)))


def gauss_on(low: Any, high: Any, count: int = 16) -> tuple[Array, Array]:
    """Return Gauss's nodes and weights between two numbers, or many with an axis left for them."""
    half = 0.5 * (high - low)
    shape = (*[1] * (xp.ndim(half) - 1), count)
    points, weights = (values.reshape(shape) for values in leggauss(count))
    return low + half * (1.0 + points), half * weights


def legendre(points: Float[Array, " k"], count: int) -> Float[Array, "k count"]:
    """Return the first Legendre polynomials at points between -1 and 1."""
    values = [xp.ones_like(points), points]
    for degree in range(2, count):
        last, before = values[-1], values[-2]
        values.append(((2.0 * degree - 1.0) * points * last - (degree - 1.0) * before) / degree)
    return xp.stack(values[:count], axis=-1)


@lru_cache(maxsize=64)
def _projection(count: int) -> Float[Array, "count nodes"]:
    """Return the coefficients, of Legendre polynomials, of Lagrange's at Gauss's nodes."""
    points, weights = leggauss(count)
    return (xp.arange(count) + 0.5)[:, None] * (weights[:, None] * legendre(points, count)).T


def up_to(count: int, parts: Float[Array, " k"]) -> Float[Array, "k nodes"]:
    """Integrate the Lagrange polynomials of Gauss's nodes on (0, 1) from 0 to given parts."""
    values = legendre(2.0 * xp.asarray(parts) - 1.0, count + 1)
    higher = (values[:, 2:] - values[:, :-2]) / (2.0 * xp.arange(1, count) + 1.0)
    integrals = xp.concatenate([1.0 + values[:, 1:2], higher], axis=1)
    return 0.5 * integrals @ _projection(count)


def half_angle(radius: Array, above: Array, below: Array) -> Array:
    """Compute half of the angle of a circle beyond a chord, arccos(d / r), clipped."""
    cut = (above > 0.0) & (below > 0.0)
    above_safe = xp.where(cut, above, radius)
    below_safe = xp.where(cut, below, radius)
    angle = 2.0 * xp.arctan2(xp.sqrt(above_safe), xp.sqrt(below_safe))
    return xp.where(cut, angle, xp.where(above > 0.0, xp.pi, 0.0))


# Series over arrays of any shape, with the terms as leading axis.


def broadcast_terms(constants: Array, like: Array) -> Array:
    """Shape one constant for each term so that it combines with `like[None]`."""
    return xp.asarray(constants).reshape((-1, *([1] * like.ndim)))


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

    area: Array
    centroid: Array
    second_moment_weak: Array
    second_moment_strong: Array
    torsion_constant: Array
    shear_centre: Array
    edge_near: Array
    edge_spine: Array
    edge_across: Array
    outer_radius: Array
    half_angle: Array


Formula = TypeVar("Formula", bound=Callable[..., Section])


def of_any_shape(properties: Formula) -> Formula:
    """Let a formula for arrays of one shape take radii and depth in any form, and be cached."""

    @cached(1024)  # notches of a tube, and their sites, share sections
    def known(*numbers: ArrayLike) -> Section:
        return Section(*map(read_only, properties(*xp.broadcast_arrays(*numbers))))

    @wraps(properties)
    def section(outer_radius: ArrayLike, inner_radius: ArrayLike, depth: ArrayLike) -> Section:
        return known(outer_radius, inner_radius, depth)

    return cast("Formula", section)


# Two parallel rectangular walls: the section of a strip that two opposite cuts leave of a tube.
#
# A strip runs across the tube, and the lumen parts it into two walls, each b wide across the strip
# and h thick in the direction in which the strip bends, with their middles at ±c. Both ends of the
# strip are clamped in rigid pieces of the tube, which prevent warping of its section; Vlasov's
# theory of thin-walled bars gives how much that stiffens its torsion.
#
# Used when a robot is assembled, so plain NumPy.


def two_walls(width: ArrayLike, thickness: ArrayLike, middle: ArrayLike) -> Section:
    r"""Compute the section of two equal walls (all in mm) of a strip side by side.

    Example:
        >>> strip = two_walls(2.0, 1.5, 4.0)
        >>> print(f"{strip.second_moment_weak:.4f} mm⁴, torsion {strip.torsion_constant:.4f} mm⁴")
        1.1250 mm⁴, torsion 2.4362 mm⁴
    """
    # Weak is the bending of the strip, 2bh^3/12, strong the bending sideways, 2(hb^3/12 + bhc^2);
    # the torsion constant is that of free warping.
    b, h, c = map(constant, xp.broadcast_arrays(width, thickness, middle))
    nought = xp.zeros_like(b)
    return Section(
        area=2.0 * b * h,
        centroid=nought,
        second_moment_weak=2.0 * b * h**3 / 12.0,
        second_moment_strong=2.0 * (h * b**3 / 12.0 + b * h * c**2),
        torsion_constant=2.0 * rectangle_torsion_constant(b, h),
        shear_centre=nought,
        edge_near=0.5 * h,
        edge_spine=0.5 * h,
        edge_across=c + 0.5 * b,
        outer_radius=nought,
        half_angle=nought,
    )


def rectangle_torsion_constant(width: ArrayLike, thickness: ArrayLike) -> Array:
    """Compute Saint-Venant's torsion constant of a rectangle, to rounding."""
    # With the longer side b and the shorter h (Timoshenko and Goodier, Theory of Elasticity, §109):
    # $$J = \frac{bh^3}{3}\Big[1 - \frac{192}{\pi^5}\frac hb
    # \sum_{n=1,3,\dots}\frac{\tanh(n\pi b/2h)}{n^5}\Big]$$
    # The sum of $n^{-5}$ is known, and what the tanh takes off falls with $e^{-n\pi}$ or faster.
    sides = constant(width), constant(thickness)
    b, h = xp.maximum(*sides), xp.minimum(*sides)
    odd = 2.0 * xp.arange(8) + 1.0
    decay = xp.exp(-np.pi * odd * (b / h)[..., None])
    taken_off = xp.sum(2.0 * decay / (1.0 + decay) / odd**5, axis=-1)
    fifth_powers = 31.0 / 32.0 * 1.0369277551433699  # sum of n^-5 over odd n, from zeta(5)
    return b * h**3 / 3.0 * (1.0 - 192.0 / np.pi**5 * (h / b) * (fifth_powers - taken_off))


def clamped_torsion_constant(
    section: Section, middle: ArrayLike, length: float, poisson_ratio: float = 0.33
) -> Array:
    """Compute the equivalent torsion constant of two walls clamped at both ends."""
    # Where the strip turns about its own axis, its walls are bent one up, one down. With the
    # warping constant $I_\omega = 2\,(bh^3/12)\,c^2$ the torque that turns the whole length L by
    # an angle is that of free warping with
    # $$J_\text{clamped} = \frac{J}{1 - \tanh u/u},\qquad
    # u = \frac L2\sqrt{\frac{GJ}{EI_\omega}},$$
    # (Vlasov 1961, Thin-Walled Elastic Beams): for short strips $12EI_\omega/GL^2$, two beams.
    free, warping = section.torsion_constant, section.second_moment_weak * constant(middle) ** 2
    u = 0.5 * length * xp.sqrt(free / (2.0 * (1.0 + poisson_ratio) * warping))
    # 1 - tanh(u)/u is the mean of tanh² up to u: where u is small, without cancellation.
    is_small = u < 1.0
    near, far = xp.where(is_small, u, 1.0), xp.where(is_small, 1.0, u)
    parts, weights = gauss_on(0.0, near[..., None])
    mean = xp.sum(xp.tanh(parts) ** 2 * weights, axis=-1) / near
    return free / xp.where(is_small, mean, 1.0 - xp.tanh(far) / far)


# Fibres of a section: arms from the neutral axis and areas, by Gauss's rule.
#
# The rule is that of the section's width over its height, computed from many fine strips. Area,
# centroid and second moment equal those of the section to rounding: the arms are shifted and scaled
# by the error of the strips, below 1e-7.

FIBRES = 30
Points = tuple[Float[Array, "*nodes fibres"], Float[Array, "*nodes fibres"]]
"""Arms (mm) and areas (mm^2)."""

FibresAt = Callable[[Any, Any, int], Points]
"""Fibres of sections by the distances of their edges, near and spine, from their neutral axes, mm,
and their number; only those of one section where all are alike."""


def two_walls_fibres(near: Any, spine: Any, count: int) -> Points:
    """Few fibres of walls of constant width (`two_walls`, or any rectangle)."""
    points, weights = leggauss(count)
    beside_spine, beside_near = xp.outer(spine, 1.0 + points), xp.outer(near, 1.0 - points)
    return 0.5 * (beside_spine - beside_near), weights


def fitted(points: Points, area: Any, second_moment: Any) -> Points:
    """Shift fibres to their centroid; scale to given areas (mm^2) and second moments (mm^4)."""
    arm, areas = map(xp.atleast_2d, points)

    def total(values: Any) -> Any:
        return xp.sum(values, -1, keepdims=True)

    areas = areas * (area[:, None] / total(areas))
    arm = arm - total(areas * arm) / area[:, None]
    return arm * xp.sqrt(second_moment[:, None] / total(areas * arm**2)), areas


def gauss_rule(points: Array, weights: Array, count: int) -> Points:
    """Compute the Gauss rule of a discrete measure, exact up to degree 2 count - 1."""
    # The nodes are the roots of the last of the polynomials orthogonal over the points. Signs of
    # the others tell how many lie above a place; they are searched along the angle of its cosine,
    # where they are evenly spaced.
    total = xp.sum(weights)
    shares = weights / total

    def extend(state: Any, _: Any) -> Any:
        before, polynomial = state
        diagonal = shares @ (points * polynomial**2)
        following = (points - diagonal) * polynomial - before
        off_diagonal = xp.sqrt(shares @ following**2)
        return (off_diagonal * polynomial, following / off_diagonal), (diagonal, off_diagonal)

    start = xp.zeros_like(points), xp.ones_like(points)
    recurrence = scan(extend, start, (np.zeros(count),))[1]
    fixed, ends = recurrence, points
    if is_traced(points):  # the last step below has the slopes of the nodes
        fixed, ends = jax.lax.stop_gradient((recurrence, points))
    low, high = xp.min(ends), xp.max(ends)

    def place(angle: Any) -> Any:
        return 0.5 * (low + high) - 0.5 * (high - low) * xp.cos(angle)

    # A node is searched in eighths of an angle; five times, and the error is below 1e-4 rad.
    parts, widths = np.arange(1, 8)[:, None], np.pi / 8.0 ** np.arange(1, 6)

    def node(order: Any) -> tuple[Any, Any]:
        """Return nodes and areas, shape (1, k), by their order from the top."""

        def narrow(angle: Any, width: Any) -> Any:
            above = _polynomials(fixed, place(angle + width[0] * parts))[-1]
            beyond = xp.sum(above >= order, 0, keepdims=True)
            return angle + width[0] * beyond, ()

        angle = scan(narrow, 0.0 * order, (widths,))[0]
        nodes = place(angle + 0.5 * widths[-1])
        for known in (fixed, fixed, fixed, recurrence):  # Newton's steps for the last two's ratio
            before, last, squares, _ = _polynomials(known, nodes)
            nodes = nodes - before * last / squares
        return nodes, total / _polynomials(recurrence, nodes)[2]

    order = np.arange(count, 0.0, -1.0)[:, None, None]
    # Compiled as a loop: soon, and small enough for the cache of code.
    rule = jax.lax.map(node, order) if is_traced(points) else node(order[..., 0].T)
    nodes, areas = (values.ravel() for values in rule)
    return nodes, areas


def _polynomials(recurrence: Any, places: Any) -> Any:
    """Return the last two polynomials, the sum of squares without the last, changes of sign."""

    def step(state: Any, entry: Any) -> Any:
        before, polynomial, squares, changes = state
        diagonal, off_diagonal = entry
        following = (places - diagonal) * polynomial - before
        changes = changes + ((following < 0.0) != (polynomial < 0.0))
        return (
            off_diagonal * polynomial,
            following / off_diagonal,
            squares + polynomial**2,
            changes,
        ), ()

    none = xp.zeros_like(places)
    return scan(step, (none, none + 1.0, none, xp.zeros_like(places, int)), recurrence)[0]
