"""What the rings beside an arc notch add to its compliance, computed anew: `ends_of(robot, i)`.

The equations are those of docs/from_the_drawing.md. The ring is a cylindrical shell whose
displacements are polynomials through Chebyshev's points along the tube; what is held at its far
edge is taken out by the null space of those conditions.
"""

from __future__ import annotations

from functools import lru_cache
from math import acos, cos, cosh, exp, pi, sin, sinh, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.legendre import leggauss
from scipy.linalg import null_space

import notchflex as nf

from .sections import Left, nodes, outer_depth, section_of

_DEGREE, _HARMONICS = 18, 41
_RELAXED = 0.833
_BETWEEN, _BRAZIER = (0.207, 1.69), 0.97
_SPECIMEN, _BRAZIER_OF_SPECIMEN = (0.465, 1.51), 0.74
_POINTS, _HALVES = leggauss(_DEGREE + 2)


class Ends(NamedTuple):
    """Lengths of an arc notch with its rings, and how it flattens.

    Attributes:
        weak: Length h + δ of the bending, mm.
        strong: That of the bending sideways.
        torsion: Length of free torsion.
        coupling: b_c, mm².
        shear_centre: Distance of the shear centre from the tube axis, mm.
        push: Compliance of the shear in the plane times Young's modulus, 1/mm.
        sway: The same sideways.
        odd: α/2, 1/rad.
        even: β/2, 1/rad².
    """

    weak: float
    strong: float
    torsion: float
    coupling: float
    shear_centre: float
    push: float
    sway: float
    odd: float
    even: float


class Ring(NamedTuple):
    """An uncut ring: what holds its far edge, and its length c, mm."""

    held: str
    length: float


def rings(robot: nf.Robot, length: np.ndarray, i: int) -> tuple[Ring, Ring]:
    """The rings before and behind a notch, by the lengths of the bodies, mm."""
    last = i == len(robot.notches) - 1
    before = Ring("clamped" if i == 0 else "between", float(length[i]))
    return before, Ring("free" if last else "between", float(length[i + 1]))


@lru_cache(maxsize=512)
def ends_of(notch: nf.ArcNotch, tube: nf.Tube, poisson: float, sides: tuple[Ring, Ring]) -> Ends:
    """Compute the ends of an arc notch."""
    outer, inner, depth = tube.outer_radius, tube.inner_radius, outer_depth(notch, tube)
    section = section_of(notch.cut, outer, inner, depth)
    radius, wall, height = 0.5 * (outer + inner), outer - inner, notch.height
    second, strong = section.weak, section.strong
    half = section.area / (2.0 * radius * wall)
    arc = section_of("on-axis", outer, inner, outer * (1.0 + cos(half)))
    loads = _edge_loads(radius, wall, half, arc)
    energy = np.zeros((3, 3))
    bends = 0.0
    for side in sides:
        if side.length:
            energy += _energy(loads, radius, wall, side, poisson)
            bends += (0.5 if side.held == "between" else 1.0) * side.length
    moment = 0.25 * pi * (outer**4 - inner**4)
    bends /= moment
    weak = height + arc.weak * (energy[0, 0] - bends)
    sideways = height + arc.strong * (energy[1, 1] - bends)
    coupling = arc.weak * (energy[0, 2] - bends * arc.centroid)
    # Flattening.
    outer_angle = acos((depth - outer) / outer)
    a = outer_angle if notch.cut == "on-axis" else acos(min((depth - outer) / radius, 1 - 1e-9))
    at, of = 0.5 * a * (1.0 + _POINTS), 0.5 * a * _HALVES
    shape = (sin(a) ** 2 + np.sin(at) ** 2) / 2
    shape = shape + sin(a) / a * (cos(a) - np.cos(at) - at * np.sin(at))
    phi = 2 * wall * radius**3 / second * abs(of @ shape)
    brazier = 48 * (1 - poisson**2) * radius**7 / (wall * second) * (of @ shape**2)
    alone = all(side.held == "clamped" for side in sides)
    (k0, c1), share = (_SPECIMEN, _BRAZIER_OF_SPECIMEN) if alone else (_BETWEEN, _BRAZIER)
    k = np.mean([k0 * (1 - exp(-((side.length / (c1 * radius)) ** 2))) for side in sides])
    alpha = radius * phi * (3 * poisson * height + k * outer_angle**3 * radius**2 / wall) / weak**2
    beta = share * brazier * height / weak**3
    # Torsion.
    diameter, width = 2 * outer, 2 * half * radius
    sine = sin(half) - half * cos(half)
    warping = 2 / 3 * wall * radius**5 * (half**3 - 6 * sine**2 / (half - sin(half) * cos(half)))
    warping += width**3 * wall**3 / 144
    rate = sqrt(section.torsion / (2 * (1 + poisson)) / warping)
    spring = 0.004 * diameter * (wall / diameter) ** -1.98 * exp(0.16 * width / diameter)
    cotangent = cosh(rate * height / 2) / sinh(rate * height / 2)
    torsion = height + wall * (3.11 - 1.60 * half) - 2 / (rate * (cotangent + spring * rate))
    off = section.shear_centre * (1 + 0.027 * width / (height + 0.72 * width))

    def shifted(factor: float, powers: tuple, length: float, second_moment: float) -> float:
        t, b, ell, c = powers
        mean = np.mean([(side.length / diameter) ** c for side in sides])
        rest = (wall / diameter) ** t * (width / diameter) ** b * (length / diameter) ** ell
        return length**3 / (12 * second_moment) + factor * rest * mean / diameter

    return Ends(
        weak=weak,
        strong=sideways,
        torsion=torsion,
        coupling=coupling,
        shear_centre=off,
        push=shifted(1.37, (-1.80, -2.10, 1.0, 0.30), weak, second),
        sway=shifted(2.35, (-1.17, -0.84, 1.31, 0.06), sideways, strong),
        odd=alpha / 2,
        even=beta / 2,
    )


def _edge_loads(radius: float, wall: float, half: float, arc: Left) -> np.ndarray:
    """Harmonics of (N, −M) of bending, bending sideways and tension, (3, harmonics, 2)."""
    points, weights = nodes(200)
    at, of = half * points, half * weights
    through, weighs = nodes(3)
    through, weighs = 0.5 * wall * through, 0.5 * wall * weighs
    stresses = (
        ((radius + through) * np.cos(at)[:, None] - arc.centroid) / arc.weak,
        (radius + through) * np.sin(at)[:, None] / arc.strong,
        np.ones((len(at), len(through))) / arc.area,
    )
    n = np.arange(_HARMONICS)[:, None]
    found = []
    for number, stress in enumerate(stresses):
        ring = stress * (1.0 + through / radius)
        force, moment = ring @ weighs, (ring * through) @ weighs
        along = np.sin(n * at) if number == 1 else np.cos(n * at)
        norm = np.where(n[:, 0] == 0, 2 * pi, pi)
        found.append(np.stack([along @ (of * force), -along @ (of * moment)], axis=-1))
        found[-1] /= norm[:, None]
    return np.array(found)


def _energy(
    loads: np.ndarray, radius: float, wall: float, side: Ring, poisson: float
) -> np.ndarray:
    """Energies of pairs of edge loads in one ring, Young's modulus 1, with the relaxation."""
    length = side.length * (0.5 if side.held == "between" else 1.0)
    flexible = _flexibilities(radius, wall, length, side.held, poisson)
    n = np.arange(_HARMONICS)
    weights = radius * pi * np.where(n == 0, 2.0, 1.0) * np.where(n < 2, 1.0, _RELAXED)
    return np.einsum("n,ani,nij,bnj->ab", weights, loads, flexible, loads)


@lru_cache(maxsize=256)
def _flexibilities(
    radius: float, wall: float, length: float, held: str, poisson: float
) -> np.ndarray:
    """Axial displacement and slope of the loaded edge per edge load of every harmonic."""
    place = 0.5 * length * (1.0 + _POINTS)
    value, slope, bend = _table(np.append(place, [0.0, length]), length)
    zero = np.zeros_like(value)
    plane = np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    membrane = wall / (1 - poisson**2) * plane
    bending = wall**2 / 12 * membrane
    of = 0.5 * length * _HALVES
    # The loaded edge is at 0, the far one at the length.
    none = 0.0 * value[-2]
    edge = np.stack([np.r_[value[-2], none, none], np.r_[none, none, slope[-2]]], axis=-1)
    found = []
    for n in range(_HARMONICS):
        strains = [
            [slope, zero, zero],
            [zero, n * value / radius, value / radius],
            [-n * value / radius, slope, zero],
            [zero, zero, -bend],
            [zero, n * value / radius**2, n**2 * value / radius**2],
            [
                n * value / (2 * radius**2),
                1.5 * slope / radius,
                2 * n * slope / radius,
            ],
        ]
        rows = np.array([np.concatenate(row, axis=-1)[:-2] for row in strains])
        stresses = np.concatenate(
            [
                np.tensordot(membrane, rows[:3], 1),
                np.tensordot(bending, rows[3:], 1),
            ]
        )
        stiffness = np.tensordot(rows, of[:, None] * stresses, ((0, 1), (0, 1)))
        allowed = null_space(_conditions(held, n, value[-1], slope[-1]))
        inside = allowed.T @ edge
        found.append(inside.T @ np.linalg.solve(allowed.T @ stiffness @ allowed, inside))
    return np.array(found)


def _conditions(held: str, n: int, value: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """What is nil at the far edge, as rows over the polynomials of u, v and w."""
    none = np.zeros_like(value)
    u, v, w = np.r_[value, none, none], np.r_[none, value, none], np.r_[none, none, value]
    turned = np.r_[none, none, slope]
    if held == "clamped":
        rows = [u, v, w, turned]
    elif held == "between":
        rows = [u, turned] + ([v] if n == 1 else [])
    else:
        rows = {0: [u], 1: [u, w]}.get(n, [])
    if n == 0:
        rows += list(np.kron([[0, 1, 0]], np.eye(len(value))))  # no torsion
    return np.array(rows) if rows else np.zeros((1, 3 * len(value)))


def _table(place: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Chebyshev's polynomials along the ring and two derivatives, (places, polynomials)."""
    every = [Chebyshev.basis(k, domain=[0.0, length]) for k in range(_DEGREE + 1)]
    return tuple(  # type: ignore[return-value]
        np.stack([one.deriv(order)(place) if order else one(place) for one in every], axis=-1)
        for order in range(3)
    )
