r"""Edge compliance of an uncut ring: a thin cylindrical shell under edge loads in harmonics.

The displacements $u\cos n\varphi$ (along the tube), $v\sin n\varphi$ (around) and
$w\cos n\varphi$ (outward) are polynomials of degree 18 of the distance z from the loaded edge. The
strains are those of Sanders' shell,

$$\varepsilon_z = u',\quad \varepsilon_\varphi = \frac{nv + w}{r},\quad \gamma = v' - \frac{nu}{r},
\quad \kappa_z = -w'',\quad \kappa_\varphi = \frac{nv + n^2 w}{r^2},\quad
\kappa_{z\varphi} = \frac{nu}{2r^2} + \frac{3v'}{2r} + \frac{2nw'}{r}$$

with the stiffnesses $t/(1-\nu^2)$ and $t^3/12(1-\nu^2)$, those of γ and κ_zφ times (1 − ν)/2.

The polynomials are integrals of Legendre's from the far edge: the derivatives in the energy are
then nearly orthogonal, and a condition at the far edge leaves out one polynomial.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from notchflex._arrays import cached, xp
from notchflex._values import read_only

HARMONICS = 41  # n = 0 ... 40
_DEGREE = 18
_COUNT = _DEGREE + 1  # polynomials of each displacement


def _polynomials(integrals: int) -> np.ndarray:
    """Integrate Legendre polynomials of x = z / length from the far edge, x = 1.

    Args:
        integrals: How many times; as many Taylor terms at the far edge come first.

    Returns:
        Values and two derivatives at the loaded edge x = 0 and at the points of a Gauss rule, shape
        (3, 1 + points, polynomials).
    """
    legendre = np.polynomial.legendre
    at = xp.concatenate([[-1.0], _GAUSS[0]])
    series = [xp.array([1.0]), xp.array([-0.5, 0.5])][:integrals]
    for k in range(_COUNT - integrals):
        unit = xp.sqrt(2.0 * k + 1.0) * xp.eye(k + 1)[k]
        series.append(legendre.legint(unit, integrals, lbnd=1.0, scl=0.5))
    return xp.array(
        [[legendre.legval(at, legendre.legder(s, d, 2.0)) for s in series] for d in range(3)]
    ).transpose(0, 2, 1)


_GAUSS = np.polynomial.legendre.leggauss(_COUNT)  # exact for products of two polynomials


@cache
def _surface() -> tuple[np.ndarray, np.ndarray]:
    """Return the polynomials of in-surface and of outward displacements."""
    return _polynomials(1), _polynomials(2)


def _strains() -> np.ndarray:
    """Write strains as sums over powers: of n (0 to 2), and of the derivative (0 to 2).

    Returns:
        Array (power of n, derivative, strain, displacement) of factors, for r = 1.
    """
    factors = xp.zeros((3, 3, 6, 3))
    u, v, w = range(3)
    axial, around, shear, along, across, twist = range(6)
    for power, derivative, strain, displacement, factor in (
        (0, 1, axial, u, 1.0),
        (1, 0, around, v, 1.0),
        (0, 0, around, w, 1.0),
        (0, 1, shear, v, 1.0),
        (1, 0, shear, u, -1.0),
        (0, 2, along, w, -1.0),
        (1, 0, across, v, 1.0),
        (2, 0, across, w, 1.0),
        (1, 0, twist, u, 0.5),
        (0, 1, twist, v, 1.5),
        (1, 1, twist, w, 2.0),
    ):
        factors[power, derivative, strain, displacement] = factor
    return factors


# Robots with rigid ends do without; this takes a tenth of a second.
@cache
def _energies() -> np.ndarray:
    """Integrate the products of strains in the energy, for r = 1.

    Returns:
        Array (part, power of ν, power of radius / length, power of n, row, column): the stiffness
        of displacements × polynomials. Parts are the membrane and bending.
    """
    size = 3 * _COUNT
    in_surface, outward = _surface()
    tables = xp.stack([in_surface, in_surface, outward])[:, :, 1:]
    strains = xp.einsum("pdsk,kdgi->pdsgki", _strains(), tables).reshape(3, 3, 6, _COUNT, size)
    plane = xp.array([xp.diag([1.0, 1.0, 0.5]), [[0, 1, 0], [1, 0, 0], [0, 0, -0.5]]])
    energies = xp.zeros((2, 2, 5, 5, size, size))
    for part, of in enumerate((strains[:, :, :3], strains[:, :, 3:])):
        stresses = xp.einsum("mst,g,pdtgj->mpdsgj", plane, 0.5 * _GAUSS[1], of)
        for p, d, q, e in xp.ndindex(3, 3, 3, 3):
            product = xp.einsum("sgi,msgj->mij", of[p, d], stresses[:, q, e])
            energies[part, :, d + e, p + q] += product
    return energies


def _constraints(boundary: str) -> np.ndarray:
    """Return the constrained polynomials of each harmonic, shape (harmonics, 3 × polynomials)."""
    constrained = xp.zeros((HARMONICS, 3, _COUNT), dtype=bool)
    constrained[0, 1] = True  # no torsion
    if boundary == "clamped":
        constrained[:, :, 0] = constrained[:, 2, 1] = True
    elif boundary == "between":
        constrained[:, 0, 0] = constrained[:, 2, 1] = constrained[1, 1, 0] = True
    else:  # free, but for the motions of a rigid ring
        constrained[:2, 0, 0] = constrained[1, 2, 0] = True
    return constrained.reshape(HARMONICS, -1)


@cache
def _edge() -> np.ndarray:
    """Return displacement and slope of polynomials at the loaded edge, (3 × polynomials, 2)."""
    in_surface, outward = _surface()
    edge = xp.zeros((3 * _COUNT, 2))
    edge[:_COUNT, 0] = in_surface[0, 0]
    edge[2 * _COUNT :, 1] = outward[1, 0]
    return edge


_POWERS = xp.arange(HARMONICS, dtype=float)[:, None] ** xp.arange(5)
_CONSTRAINTS = {boundary: _constraints(boundary) for boundary in ("between", "clamped", "free")}


@cached(256)  # rings of one length are equal, however deep the notches beside them
def edge_compliance(
    radius: float, wall: float, length: float, poisson_ratio: float, boundary: str
) -> np.ndarray:
    """Compute the compliance of an edge to its loads, for each harmonic.

    Args:
        radius: Mean radius r, mm.
        wall: Wall t, mm.
        length: From the loaded edge to the plane of symmetry, clamp or free end, mm.
        poisson_ratio: Poisson's ratio ν.
        boundary: "between" (the plane of symmetry between two notches), "clamped" or "free"
            (the motions of a rigid ring held at the far edge).

    Returns:
        Displacement away from the ring and slope of the outward displacement along z, per unit of
        tension and of moment in N/mm and N with a Young's modulus of 1, shape (harmonics, 2, 2).
    """
    ratio = radius / length
    one = 1.0
    # Strains of the membrane come per 1/r, those of bending per 1/r².
    parts = xp.stack([one, wall**2 / (12.0 * radius**2)])
    material = xp.stack([one, one * poisson_ratio])
    slopes = xp.stack([one, ratio, ratio**2, ratio**3, ratio**4])
    factors = xp.einsum("a,b,c->abc", parts, material, slopes).ravel()
    constrained = _CONSTRAINTS[boundary]
    free = (~constrained[:, :, None] & ~constrained[:, None, :]).astype(float)
    by_power = (factors @ _energies().reshape(20, -1)).reshape(5, -1)
    stiffness = (_POWERS @ by_power).reshape(HARMONICS, 3 * _COUNT, 3 * _COUNT)
    stiffness = free * stiffness + xp.eye(3 * _COUNT) * constrained[:, :, None]
    edge = xp.stack([_edge()[:, 0] * one, _edge()[:, 1] * ratio], axis=-1)
    loads = xp.where(constrained[:, :, None], 0.0, edge[None])
    flexibility = xp.swapaxes(loads, 1, 2) @ xp.linalg.solve(stiffness, loads)
    # Displacements are of order r² per N/mm over E t length; slopes have one r less.
    unit = xp.stack([radius, one])
    scale = (1.0 - poisson_ratio**2) / (wall * length)
    compliance = flexibility * (scale * xp.outer(unit, unit)[None])
    return read_only(compliance)
