r"""Edge compliance of an uncut ring: a thin cylindrical shell under edge loads in harmonics.

The displacements $u\cos n\varphi$ (along the tube), $v\sin n\varphi$ (around) and
$w\cos n\varphi$ (outward) are polynomials of degree 18 of the distance z from the loaded edge. The
strains are those of Sanders' shell,

$$\varepsilon_z = u',\quad \varepsilon_\varphi = \frac{nv + w}{r},\quad \gamma = v' - \frac{nu}{r},
\quad \kappa_z = -w'',\quad \kappa_\varphi = \frac{nv + n^2 w}{r^2},\quad
\kappa_{z\varphi} = \frac{nu}{2r^2} + \frac{3v'}{2r} + \frac{2nw'}{r}$$

with the stiffnesses $t/(1-\nu^2)$ and $t^3/12(1-\nu^2)$, those of γ and κ_zφ times (1 − ν)/2.

The system is solved in few operations, so that it can be traced and differentiated. About the
middle of a ring, u even with v and w odd shares no energy with the reverse. Integrals of Legendre's
polynomials, u and v once and w twice, are nil at both edges and, in a suitable order, share energy
with the six nearest only: each half is a band. It is eliminated from the highest degree; left are
the polynomials that move the edges, four in each half. A dense solution agrees to 4e-7, and in the
lengths that a ring adds to a notch to 1e-8 (tests/mechanics/ends/test_ring_band.py); thin walls
and short free rings are the worst.

Between two notches a ring is loaded alike from both sides, in bending and tension, or its loads
pass through it, in torsion: then the middle of the ring warps, but keeps its place.
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import cached, decide, is_traced, plain_number, xp
from notchflex._values import read_only
from notchflex.mechanics.cuts import annular_sector
from notchflex.mechanics.section import Section

# Uncut ring beside a notch, with the boundary condition at its far edge.


BOUNDARIES = ("between", "clamped", "free")


class Side(NamedTuple):
    """The uncut ring beside a notch.

    Attributes:
        boundary: "between" two notches, "clamped" to a rigid plate (the base), or "free" (the
            ring beyond the last notch); or a share for each of the three, where it is traced.
        length: Uncut length c from the edge of the notch to the next notch, to the plate or to
            the free end, mm.
        turned: Whether the notch beyond the ring opens to another side of the tube.
        anchor: Distance from the tube axis of the tendon that ends behind the notch, on the side to
            which it bends, mm; 0 for none.
    """

    boundary: Literal["between", "clamped", "free"] | Array
    length: float
    turned: bool = False
    anchor: float = 0.0

    @property
    def shares(self) -> Any:
        """1 for its boundary, 0 for the others, in the order of `BOUNDARIES`."""
        if isinstance(self.boundary, str):
            return np.array([self.boundary == name for name in BOUNDARIES], float)
        return self.boundary

    @property
    def own_length(self) -> float:
        """Length that belongs to the notch: between two notches a half, mm."""
        return plain_number((1.0 - 0.5 * self.shares[0]) * self.length)


HARMONICS = 41  # n = 0 ... 40
_DEGREE = 18
_EDGE = 4  # polynomials of each half that move an edge: along, around, outward and its slope
_BAND = 7  # coefficients of a row, from the diagonal on
_GAUSS = np.polynomial.legendre.leggauss(_DEGREE + 1)  # exact for products of two polynomials


def _halves() -> list[list[tuple[int, int]]]:
    """List displacement (u, v, w: 0, 1, 2) and degree of polynomials, in the order of bands."""
    halves = [[(0, 0), (1, 1), (2, 1), (2, 3)], [(0, 1), (1, 0), (2, 0), (2, 2)]]
    for degree in range(2, _DEGREE + 1, 2):
        halves[0] += [(0, degree), (1, degree + 1), (2, degree + 3)]
        halves[1] += [(1, degree), (0, degree + 1), (2, degree + 2)]
    return [[term for term in half if term[1] <= _DEGREE] for half in halves]


_ROWS = max(map(len, _halves()))


def _polynomial(displacement: int, degree: int) -> np.ndarray:
    """Compute value and two derivatives by z / length at the far edge, the loaded one, the rule."""
    legendre = np.polynomial.legendre
    unit = np.eye(_DEGREE + 1)
    if displacement == 2 and degree >= _EDGE:
        series = legendre.legint(unit[degree - 2], 2, lbnd=-1.0)
    else:
        series = unit[degree] - (unit[degree - 2] if degree >= 2 else 0.0)
    places = np.concatenate([[1.0, -1.0], _GAUSS[0]])
    return np.array([legendre.legval(places, legendre.legder(series, d, 2.0)) for d in range(3)])


# The first half has one polynomial less.
_EMPTY = np.zeros((_ROWS + _BAND - _EDGE, _BAND, 2, 1))
_EMPTY[0, 0, 0] = 1.0

# Strain, displacement, power of n, derivative, factor; for r = 1. Strains are ε_z, ε_φ, γ and κs.
_STRAINS = (
    (0, 0, 0, 1, 1.0),
    (1, 1, 1, 0, 1.0),
    (1, 2, 0, 0, 1.0),
    (2, 1, 0, 1, 1.0),
    (2, 0, 1, 0, -1.0),
    (3, 2, 0, 2, -1.0),
    (4, 1, 1, 0, 1.0),
    (4, 2, 2, 0, 1.0),
    (5, 0, 1, 0, 0.5),
    (5, 1, 0, 1, 1.5),
    (5, 2, 1, 1, 2.0),
)


# Robots with rigid ends do without; this takes 40 ms.
@cache
def _energies() -> np.ndarray:
    """Integrate the products of strains in the energy, for r = 1, the highest degrees first."""
    strains = np.zeros((2, 3, 3, 6, _DEGREE + 1, len(_EMPTY) + _BAND))
    for half, terms in enumerate(_halves()):
        for number, (displacement, degree) in enumerate(terms):
            table = _polynomial(displacement, degree)[:, 2:]
            for strain, of, power, derivative, factor in _STRAINS:
                if of == displacement:
                    strains[half, power, derivative, strain, :, _ROWS - 1 - number] = (
                        factor * table[derivative]
                    )
    plane = np.array([np.diag([1.0, 1.0, 0.5]), [[0, 1, 0], [1, 0, 0], [0, 0, -0.5]]])
    stiffness = np.einsum("ab,ac,mst->ambsct", np.eye(2), np.eye(2), plane).reshape(2, 2, 6, 6)
    near = strains[..., np.arange(len(_EMPTY))[:, None] + np.arange(_BAND)]
    stresses = np.einsum("amst,g,hqetgio->hamqesgio", stiffness, 0.5 * _GAUSS[1], near)
    products = np.einsum("hpdsgi,hamqesgio->pqdeamioh", strains[..., : len(_EMPTY)], stresses)
    energies = np.zeros((2, 2, 5, 5, *_EMPTY.shape[:3]))
    for p, q, d, e in np.ndindex(3, 3, 3, 3):
        energies[:, :, d + e, p + q] += products[p, q, d, e]
    return np.where(np.abs(energies) < 1e-13, 0.0, energies)


@cache
def _edges() -> np.ndarray:
    """Return the first polynomials of both halves by what moves, shape (halves, _EDGE, 2 _EDGE)."""
    # The order is u, v, w and slope at the far edge, then v, w, u and slope at the loaded one.
    moved = np.zeros((2 * _EDGE, 2 * _EDGE))
    for number, term in enumerate(_halves()[0][:_EDGE] + _halves()[1][:_EDGE]):
        value, slope = _polynomial(*term)[:2, :2]
        rows = ((0, 6), (1, 4), (2, 5))[term[0]]
        moved[rows, number] = value
        if term[0] == 2:
            moved[(3, 7), number] = slope
    return np.linalg.inv(moved).reshape(2, _EDGE, 2 * _EDGE)


def _held(boundary: str, passing: bool) -> np.ndarray:
    """Return what is held at the edges, in the order of `_edges`, (2 _EDGE, harmonics)."""
    held = np.zeros((2 * _EDGE, HARMONICS))
    held[[1, 4], 0] = 1.0  # no torsion
    if boundary == "clamped":
        held[:_EDGE] = 1.0
    elif boundary == "between" and passing:
        held[[1, 2]] = held[0, :2] = 1.0
    elif boundary == "between":
        held[[0, 3]] = held[1, 1] = 1.0
    else:  # free, but for the motions of a rigid ring
        held[0, :2] = held[2, 1] = 1.0
    return held


_POWERS = np.arange(HARMONICS, dtype=float) ** np.arange(5.0)[:, None]
_HELD = np.array([[_held(boundary, of) for boundary in BOUNDARIES] for of in (False, True)])
_ROW, _COLUMN = np.indices((_EDGE, _EDGE))
_SQUARE = np.minimum(_ROW, _COLUMN), np.abs(_ROW - _COLUMN)


def _edge_stiffness(by_power: Any, powers: Any, held: Any) -> Any:
    """Return the stiffness of v, w, u and slope at the loaded edge, (4, 4, harmonics)."""
    rows = xp.tensordot(by_power, powers, ((0,), (0,))) + _EMPTY
    window, shifted = rows[:_BAND], np.arange(1, _BAND)[:, None] + np.arange(_BAND)
    for following in range(_BAND, len(rows)):  # the first row of the window goes
        first = window[0]
        factor = first[1:] * (1.0 / first[:1])
        taken = factor[:, None] * xp.concatenate([first, 0.0 * first])[shifted]
        window = xp.concatenate([window[1:] - taken, rows[following : following + 1]])
    edges = _edges()
    half = xp.einsum("ijpn,pjb->pibn", window[_SQUARE][::-1, ::-1], edges)
    stiffness = xp.einsum("pia,pibn->abn", edges, half)
    free = (1.0 - held[:, None]) * (1.0 - held[None])
    stiffness = free * stiffness + np.eye(len(held))[..., None] * held[None]
    for _ in range(_EDGE):
        factor = stiffness[:1, 1:] * (1.0 / stiffness[:1, :1])
        stiffness = stiffness[1:, 1:] - stiffness[1:, :1] * factor
    return stiffness


def inverse(matrix: Array) -> Array:
    """Invert matrices of two or four rows, (..., n, n), by their blocks.

    LAPACK's functions are no operations that the programs of assembly can have.
    """
    half = matrix.shape[-1] // 2
    first, right = matrix[..., :half, :half], matrix[..., :half, half:]
    left, last = matrix[..., half:, :half], matrix[..., half:, half:]
    if half == 1:
        scale = 1.0 / (first * last - right * left)
        return scale * xp.block([[last, -right], [-left, first]])
    before = inverse(first)
    below = left @ before
    rest = inverse(last - below @ right)
    beside = -before @ right @ rest
    return xp.block([[before - beside @ below, beside], [-rest @ below, rest]])


@cached(256)  # rings of one length are equal, however deep the notches beside them
def edge_compliance(
    radius: float, wall: float, ring: Side, poisson_ratio: float, passing: bool = False
) -> Float[Array, "harmonics 4 4"]:
    """Compute the compliance of an edge to its loads, for each harmonic.

    Loads are, per length of the edge, those around the tube and outward, the tension, which pulls
    the edge toward the notch, and the moment of the wall; displacements are in their directions.
    Between two notches they pass through the ring, or act alike from both sides.
    """
    # Rounding errors grow as a ring gets shorter; one of a micrometre is no part of a tube.
    length = xp.maximum(ring.length, 1e-3 * radius)
    ratio = radius / length
    # Strains of the membrane come per 1/r, those of bending per 1/r².
    parts = xp.stack([1.0, wall**2 / (12.0 * radius**2)])
    material = xp.stack([1.0, 1.0 * poisson_ratio])
    slopes = xp.stack([1.0, ratio, ratio**2, ratio**3, ratio**4])
    factors = xp.einsum("a,b,c->abc", parts, material, slopes).ravel()
    energies, held = _energies(), xp.tensordot(ring.shares, _HELD[int(passing)], 1)
    by_power = (factors @ energies.reshape(len(factors), -1)).reshape(energies.shape[3:])
    if is_traced(by_power):  # compiled as a loop: soon, and small enough for the cache of code
        compliance = sys.modules["jax"].lax.map(
            lambda of: inverse(_edge_stiffness(by_power, of[0][:, None], of[1][:, None])[..., 0]),
            (_POWERS.T, held.T),
        )
    else:
        compliance = inverse(xp.moveaxis(_edge_stiffness(by_power, _POWERS, held), -1, 0))
    # Displacements are of order r² per N/mm over E t length; a slope along z has one length less.
    scale = (1.0 - poisson_ratio**2) * radius**2 / (wall * length)
    units = xp.stack([1.0, 1.0, -1.0, -1.0 / length])
    return read_only(compliance * (scale * xp.outer(units, units))[None])


# End compliance: the compliance that the ring beside a notch adds to the notch.
#
# The stress of the arc, that of a beam, acts on the edge of the ring as loads of a shell. Bending
# of the notch, bending sideways and tension are the stresses $[(r + \zeta)\cos\varphi - \bar y]/I$,
# $(r + \zeta)\sin\varphi/I_y$ and $1/A$ on |φ| < a, with ζ through the wall; membrane force and
# moment of the wall, $\int\sigma(1 + \zeta/r)\,d\zeta$ and $\int\sigma\zeta(1 + \zeta/r)\,d\zeta$,
# follow in closed form, and so do their harmonics.
#
# A prescribed stress makes the ring too compliant; that the stress at the interface relaxes is one
# factor on the harmonics from n = 2, fitted to finite elements.


class WallSector(NamedTuple):
    """The arc of wall that a cut leaves, as an annular sector with edges at right angles."""

    radius: float  # Mean radius r, mm
    wall: float  # Wall t, mm
    half_angle: float  # a, rad, such that the sector has the area of the section, A = 2 a r t
    section: Section  # The sector of that half angle, whatever the cut


def arc_of(outer: float, inner: float, section: Section) -> WallSector:
    """Replace what the cut leaves by a sector of the same area."""
    radius, wall = 0.5 * (outer + inner), outer - inner
    angle = plain_number(section.area) / (2.0 * radius * wall)
    return WallSector(
        radius, wall, angle, annular_sector(outer, inner, outer * (1.0 + xp.cos(angle)))
    )


class EndCompliance(NamedTuple):
    """Compliance that one ring adds to a notch."""

    weak: Any  # Length δ added to that of the bending of the notch, mm
    strong: Any  # Length added to that of the bending sideways, mm
    axial: Any  # Length added to that of the stretch of the centroid, mm
    # b_c, mm²: I E times the stretch of the centroid per bending moment; less that of the tendon
    coupling: Any
    warped: Any  # Displacements of its edge by the moment of the notch along given loads
    yielding: Any  # Its compliance to these loads


def arc_loads(arc: WallSector) -> tuple[Array, Array, Array]:
    """Expand the edge loads of the arc's stress in harmonics, (harmonics, 4)."""
    r, t, a = arc.radius, arc.wall, arc.half_angle
    n = xp.arange(HARMONICS, dtype=float)
    # Integrals over |φ| < a of cos nφ, cos φ cos nφ, sin φ sin nφ.
    even = 2.0 * a * xp.sinc(n * (a / np.pi))
    below, above = a * xp.sinc((n - 1.0) * (a / np.pi)), a * xp.sinc((n + 1.0) * (a / np.pi))
    cosine, sine = below + above, below - above
    third = t**3 / 12.0

    def loads(constant: Array, varying: Array) -> Array:
        """Compute loads of the stress `constant` + (1 + ζ/r) `varying`, in harmonics of φ."""
        force = t * (constant + varying) + third / r**2 * varying
        moment = third / r * (constant + 2.0 * varying)
        nought = xp.zeros_like(force)
        return xp.stack([nought, nought, force, -moment], axis=-1) / EDGE_NORM[:, None]

    section = arc.section
    weak = loads(-plain_number(section.centroid) * even, r * cosine) / section.second_moment_weak
    strong = loads(0.0 * sine, r * sine) / section.second_moment_strong
    return weak, strong, loads(even, 0.0 * even) / section.area


EDGE_NORM = np.pi * np.where(np.arange(HARMONICS) == 0, 2.0, 1.0)
"""Integrals of the squares of the harmonics around the tube."""


def end_compliance(
    arc: WallSector,
    side: Side,
    poisson_ratio: float,
    distorting: Array,
    relaxation: float,
) -> EndCompliance:
    """Compute the compliance of a ring, whose beam bends and stretches with it.

    Args:
        arc: The arc that the notch leaves.
        side: The ring.
        poisson_ratio: Poisson's ratio.
        distorting: Loads by which the arc distorts the edge, (k, harmonics, 4).
        relaxation: Factor on the energy of the stress in the harmonics from n = 2.
    """
    if decide(side.own_length == 0.0):
        k = len(distorting)
        return EndCompliance(0.0, 0.0, 0.0, 0.0, np.zeros(k), np.zeros((k, k)))
    weak, strong, axial = arc_loads(arc)
    ring = Side(side.boundary, side.own_length)
    flexibility = edge_compliance(arc.radius, arc.wall, ring, poisson_ratio)
    section, bound = arc.section, arc.radius * EDGE_NORM

    def energy(first: Array, second: Array, weights: Any) -> Array:
        return xp.einsum("n,...ni,nij,knj->...k", weights, first, flexibility, second)

    # A tendon that ends there pulls the edge along: in the bending of the notch its pull counts as
    # a tension of the arc does.
    anchored, n = 1.0 * (side.anchor > 0.0), np.arange(HARMONICS)
    at_edge = (-1.0) ** n / bound  # opposite the arc, in harmonics
    nought, moment = 0.0 * at_edge, -(side.anchor - arc.radius) * at_edge
    pull = anchored * xp.stack([nought, nought, at_edge, moment], axis=-1)
    relaxed = bound * np.where(n < 2, 1.0, relaxation)
    by_weak = energy(weak, xp.stack([weak, axial]), relaxed) - energy(
        weak, xp.stack([0.0 * pull, pull]), bound
    )
    arm = section.centroid + side.anchor
    loads = weak + (pull - anchored * axial) / xp.where(anchored > 0.0, arm, 1.0)
    return EndCompliance(
        weak=section.second_moment_weak * by_weak[0],
        strong=section.second_moment_strong * energy(strong, strong[None], relaxed)[0],
        axial=section.area * energy(axial, axial[None], relaxed)[0],
        coupling=section.second_moment_weak * by_weak[1],
        warped=energy(loads, distorting, bound),
        yielding=energy(distorting, distorting, bound),
    )
