"""Fibres of arc notches, judged: their places, their curve of stress, and what they remember."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from acting import State
from shells import nodes, outer_depth

import notchflex as nf

# Pieces of a section, and the powers of the distance that fibres are held to, and how well.
_FINE, _POWERS, _OF_SECTION = 400, 13, 1e-6


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


def fibres(state: State, i: int, section: nf.Section) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Arms (mm, toward the spine) and areas of the solver's fibres of notch i, and problems.

    Which places stand for a section is the solver's choice; they must sum up powers of the distance
    as the section does.
    """
    held = state.fibres
    arm, area = (np.asarray(part)[i, 0] for part in (held.arm, held.area))
    place, size = _pieces(state.robot.notches[i], state.robot.tube, section)
    reach = np.abs(place).max()
    off = max(
        abs(area @ (arm / reach) ** power - size @ (place / reach) ** power) / size.sum()
        for power in range(_POWERS)
    )
    found = [f"notch {i + 1}: fibres are off the section by {off:.1e}"] if off > _OF_SECTION else []
    return arm, area, found


def _pieces(
    notch: nf.ArcNotch, tube: nf.Tube, section: nf.Section
) -> tuple[np.ndarray, np.ndarray]:
    """Places from the neutral axis and areas of many pieces of a section."""
    outer, inner, depth = tube.outer_radius, tube.inner_radius, outer_depth(notch, tube)
    points, weights = nodes(_FINE)
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
    size = size * float(section.area) / size.sum()
    return place - float(section.centroid), size


class Memory(NamedTuple):
    """Transformed strains of fibres (notches, nodes, fibres): as reported, and before the step.

    Attributes:
        after: After the step.
        before: In the last state before that entered the history.
    """

    after: np.ndarray
    before: np.ndarray


def memory_of(path: nf.EquilibriumPath, step: int) -> Memory | None:
    """What the fibres of a material with hysteresis remember in a step; None without."""
    every = path.run.solved.memory.material
    if isinstance(every, tuple):
        return None
    last = path.prepared.state.unpack(path.run.between).memory.material
    return Memory(np.asarray(every[step]), np.asarray(last[step]))


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
