"""Closed formulas of what a cut leaves, of materials, friction and fibres, written again.

Nothing here but torsion and shear centre of a cut section is the library's: a check that asked it
for its own centroid would agree with any error of that centroid. mm, N, MPa, rad.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from math import acos, cos, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

import notchflex as nf

# Pieces of a section, and the powers of the distance that fibres are held to, and how well.
_FINE, _POWERS, _OF_SECTION = 400, 13, 1e-6
_CUTS = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}


class Left(NamedTuple):
    """What the cut of an arc notch leaves of the tube.

    Attributes:
        area: mm^2.
        centroid: Distance of the neutral axis from the tube axis, toward the spine, mm.
        weak: Second moment of area of bending toward the cut, mm^4.
        strong: The same sideways.
        spine: Distance of the spine's surface from the neutral axis, mm.
        torsion: Torsion constant, mm^4.
        shear_centre: Its distance from the tube axis, mm.
    """

    area: float
    centroid: float
    weak: float
    strong: float
    spine: float
    torsion: float
    shear_centre: float


@lru_cache(maxsize=256)
def section_of(cut: str, outer: float, inner: float, depth: float) -> Left:
    """Return the section that a cut down to a depth (at the outer surface) leaves."""
    area = first = weak = strong = 0.0
    for radius, sign in ((outer, 1.0), (inner, -1.0)):
        if cut == "off-axis" and depth - outer >= radius:
            continue
        half = acos(max((depth - outer) / (outer if cut == "on-axis" else radius), -1.0))
        sine, cosine = sin(half), cos(half)
        if cut == "on-axis":
            area += sign * radius**2 * half
            first += sign * 2.0 / 3.0 * radius**3 * sine
            weak += sign * radius**4 / 4.0 * (half + sine * cosine)
            strong += sign * radius**4 / 4.0 * (half - sine * cosine)
        else:
            lens, rest = half - sine * cosine, 2.0 * sine**3 * cosine
            area += sign * radius**2 * lens
            first += sign * 2.0 / 3.0 * radius**3 * sine**3
            weak += sign * radius**4 / 4.0 * (lens + rest)
            strong += sign * radius**4 / 12.0 * (3.0 * lens - rest)
    made = _CUTS[cut](outer, inner, depth)
    centroid, spine = first / area, outer - first / area
    torsion, centre = float(made.torsion_constant), float(made.shear_centre)
    return Left(area, centroid, weak - first * centroid, strong, spine, torsion, centre)


def outer_depth(notch: nf.ArcNotch, tube: nf.Tube) -> float:
    """Depth at the outer surface of a cut with radial edges, read at another surface, mm."""
    if notch.cut == "off-axis" or notch.depth_at == "outer":
        return notch.depth
    middle = 0.5 * (tube.outer_radius + tube.inner_radius)
    read = {"mid-wall": middle, "inner": tube.inner_radius}[notch.depth_at]
    return tube.outer_radius * (1.0 + (notch.depth - tube.outer_radius) / read)


def left_by(notch: nf.ArcNotch, tube: nf.Tube) -> Left:
    """What the cut of an arc notch leaves of the tube."""
    return section_of(notch.cut, tube.outer_radius, tube.inner_radius, outer_depth(notch, tube))


@lru_cache(maxsize=16)
def nodes(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of Gauss and Legendre, kept: several hundred take a fifth of a second."""
    return leggauss(count)


def at_temperature(material: Any, load: float | None) -> Any:
    """Return a material as it is at the temperature of a load, or at its own.

    The stresses of both plateaus in tension rise by the slope, 6.5 MPa/K where none is given, and
    in compression by the ratio (Clausius and Clapeyron). Moduli and lengths of plateaus stay.
    """
    reference = getattr(material, "reference_temperature", None)
    if reference is None:
        return material
    own = reference if material.temperature is None else material.temperature
    slope = 6.5 if material.plateau_slope is None else material.plateau_slope
    rise = slope * ((own if load is None else load) - reference)
    strain, none = rise / material.elastic_modulus, {"temperature": None}
    if isinstance(material, nf.Superelastic):
        first, second = material.transition_strain + strain, material.plastic_strain + strain
        return replace(material, transition_strain=first, plastic_strain=second, **none)
    names = "plateau_stress", "unloading_stress", "transformation_strain"
    moved = {
        name: value + (strain if name.endswith("strain") else rise)
        for name in names
        if (value := getattr(material, name)) is not None
    }
    return replace(material, **moved, **none)


def stress(material: nf.Linear | nf.Superelastic, strain: np.ndarray) -> np.ndarray:
    """Stress of a fibre (Pacheco 2021, eq. 13), MPa."""
    if isinstance(material, nf.Linear):
        return material.elastic_modulus * strain
    size = np.abs(strain)
    first = np.minimum(size, material.transition_strain)
    second = np.clip(size, material.transition_strain, material.plastic_strain)
    third = np.maximum(size - material.plastic_strain, 1e-300)
    hardening = material.plastic_modulus * np.exp(material.plastic_exponent / third)
    flat = material.superelastic_modulus * (second - material.transition_strain)
    return np.sign(strain) * (material.elastic_modulus * first + flat + hardening)


def strain_of(material: nf.Linear | nf.Superelastic, value: float) -> float:
    """Return the strain that belongs to a stress: `stress`, solved for it; NaN where none does."""
    size, modulus = abs(value), material.elastic_modulus
    if isinstance(material, nf.Linear) or size <= modulus * material.transition_strain:
        return value / modulus
    first, second = material.transition_strain, material.plastic_strain
    low = modulus * first
    high = low + (second - first) * material.superelastic_modulus
    part = (size - high) / material.plastic_modulus
    if size <= high:
        strain = first + (size - low) / material.superelastic_modulus
    elif part < 1.0:
        strain = second + material.plastic_exponent / np.log(part)
    else:
        return np.nan
    return float(np.copysign(strain, value))


def bounds(friction: Any, turning: np.ndarray) -> np.ndarray:
    """Largest log ratios at all contacts by the law of friction, the fixed end left out."""
    if isinstance(friction, nf.Frictionless):
        return np.zeros(len(turning) - 1)
    if isinstance(friction, nf.Corner):
        return 2.0 * np.arctanh(friction.coefficient * np.tan(0.5 * turning[:-1]))
    if friction.wrap == "whole-before":
        whole = np.zeros_like(turning)
        whole[0::2] = turning[0::2] + turning[1::2]
        turning = whole
    return friction.coefficient * turning[:-1]


class Curve:
    """Stress over strain of a material without memory, MPa: straight pieces through points."""

    def __init__(self, material: nf.Nitinol | nf.StressStrain) -> None:
        if isinstance(material, nf.Nitinol):
            tension = _plateau(material, 1.0)
            compression = _plateau(material, material.compression_ratio)
        else:
            tension = material.in_tension
            compression = material.in_compression or tension
        self.strain = np.array([*(-np.array(compression[0][::-1])), 0.0, *tension[0]])
        self.stress = np.array([*(-np.array(compression[1][::-1])), 0.0, *tension[1]])

    def __call__(self, strain: np.ndarray) -> np.ndarray:
        """Stress at strains."""
        piece = np.clip(np.searchsorted(self.strain, strain), 1, len(self.strain) - 1)
        slope = (np.diff(self.stress) / np.diff(self.strain))[piece - 1]
        return self.stress[piece - 1] + slope * (strain - self.strain[piece - 1])


def _plateau(material: nf.Nitinol, ratio: float) -> tuple[list[float], list[float]]:
    """Points of the curve of loading: two on the plateau, and one beyond where it ends."""
    modulus, begin = material.elastic_modulus, ratio * material.plateau_stress
    at = begin / modulus
    ends = material.transformation_strain
    long = 1.0 if ends is None else ends - material.plateau_stress / modulus
    strains, stresses = [at, at + long], [begin, begin + material.plateau_modulus * long]
    if ends is not None:
        strains.append(strains[-1] + 1.0)
        stresses.append(stresses[-1] + modulus)
    return strains, stresses


def fibres(
    held: Any, i: int, notch: nf.ArcNotch | nf.RodGap, tube: nf.Tube
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Arms (mm, toward the spine) and areas of the solver's fibres of notch i, and problems.

    Which places stand for a section is the solver's choice; they must sum up powers of the distance
    as the section does; beside a ring it does not stay plane, and they do so up to the second.
    """
    arm, area = (np.asarray(part)[i, 0] for part in (held.arm, held.area))
    place, size = _pieces(notch, tube)
    reach = np.abs(place).max()
    off = max(
        abs(area @ (arm / reach) ** power - size @ (place / reach) ** power) / size.sum()
        for power in range(3 if notch.has_elastic_ends else _POWERS)
    )
    found = [f"notch {i + 1}: fibres are off the section by {off:.1e}"] if off > _OF_SECTION else []
    return arm, area, found


def round_section(notch: nf.RodGap) -> Left:
    """Return the section of a round or tubular backbone."""
    outer, inner = 0.5 * notch.diameter, 0.5 * notch.inner_diameter
    second = np.pi / 4.0 * (outer**4 - inner**4)
    area = np.pi * (outer**2 - inner**2)
    return Left(area, 0.0, second, second, outer, 2.0 * second, 0.0)


def _pieces(notch: nf.ArcNotch | nf.RodGap, tube: nf.Tube) -> tuple[np.ndarray, np.ndarray]:
    """Places from the neutral axis and areas of many pieces of a section."""
    points, weights = nodes(_FINE)
    if isinstance(notch, nf.RodGap):
        outer, inner = 0.5 * notch.diameter, 0.5 * notch.inner_diameter
        through, weighs = nodes(24)
        radius = 0.5 * (outer + inner) + 0.5 * (outer - inner) * through
        place = np.outer(radius, np.cos(0.5 * np.pi * (1.0 + points))).ravel()
        size = np.outer(radius * weighs, weights).ravel()
        return place, size * round_section(notch).area / size.sum()
    outer, inner, depth = tube.outer_radius, tube.inner_radius, outer_depth(notch, tube)
    if notch.cut == "on-axis":
        half = np.arccos((depth - outer) / outer)
        through, weighs = nodes(12)
        radius = 0.5 * (outer + inner) + 0.5 * (outer - inner) * through
        place = np.outer(radius, np.cos(0.5 * half * (1.0 + points))).ravel()
        size = np.outer(radius * weighs, weights).ravel()
    else:
        # Across the height, cut where the bore begins and ends.
        stops = [depth - outer, *[at for at in (-inner, inner) if at > depth - outer], outer]
        places, sizes = [], []
        for low, high in pairwise(stops):
            turn = 0.5 * np.pi * (1.0 + points)
            at = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(turn)
            chord = np.sqrt(np.maximum(outer**2 - at**2, 0.0))
            chord = chord - np.sqrt(np.maximum(inner**2 - at**2, 0.0))
            places.append(at)
            sizes.append((high - low) * chord * np.sin(turn) * weights)
        place, size = np.concatenate(places), np.concatenate(sizes)
    section = left_by(notch, tube)
    return place - section.centroid, size * section.area / size.sum()


class Memory(NamedTuple):
    """Transformed strains of fibres (notches, nodes, fibres): as reported, and before the step.

    Attributes:
        after: After the step.
        before: In the last state before that entered the history.
    """

    after: np.ndarray
    before: np.ndarray


def memory_of(path: nf.EquilibriumPath) -> Memory | None:
    """What the fibres of a material with hysteresis remember of a state; None without."""
    every = path.run.solved.memory.material
    if isinstance(every, tuple):
        return None
    last = path.prepared.state.unpack(path.run.between).memory.material
    return Memory(np.asarray(every[0]), np.asarray(last[0]))


def remembered(
    i: int,
    material: nf.Nitinol,
    strain: np.ndarray,
    past: np.ndarray,
    now: np.ndarray,
    near: float,
) -> list[str]:
    """Whether transformed strains lie between the curves of loading and unloading, and follow."""
    modulus, ratio = material.elastic_modulus, material.compression_ratio
    begin, back = material.plateau_stress / modulus, (material.unloading_stress or 0.0) / modulus
    rate = 1.0 - material.plateau_modulus / modulus
    ends = material.transformation_strain
    most = np.inf if ends is None else rate * (ends - begin)

    def curve(low: float, high: float) -> np.ndarray:
        grown = rate * (strain - np.clip(strain, -low, high))
        return np.clip(grown, -most, most)

    # Loading in tension while the strain grows, back in compression; and the other way round.
    least, largest = curve(ratio * back, begin), curve(ratio * begin, back)
    found = []
    if (now < least - near).any() or (now > largest + near).any():
        off = max((least - now).max(), (now - largest).max())
        found.append(f"notch {i + 1}: fibres remember strains off their curves by {off:.1e}")
    off = np.abs(np.clip(past, least, largest) - now).max()
    if off > near:
        found.append(f"notch {i + 1}: the memory of its fibres is off by {off:.1e}")
    return found
