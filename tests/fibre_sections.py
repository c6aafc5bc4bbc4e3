"""One section of fibres, answered by a law, and the same cut into very fine fibres."""

from __future__ import annotations

import dataclasses

import numpy as np

import notchflex as nf
from notchflex._jax import jax
from notchflex.mechanics.chain import with_fibres
from notchflex.mechanics.flexure import rod
from notchflex.mechanics.material import FibreSection, NotchEnds, SectionLaw

TUBE = nf.Tube(1.62, 1.40)
ENDS = NotchEnds(weak=0.6, odd=0.2, even=0.1, warped=0.15, material_share=0.25)

PLAIN = FibreSection(
    area=0.125,
    second_moment_weak=5.8e-4,
    second_moment_strong=2.0e-2,
    torsion_constant=5.0e-4,
    shear_centre=0.7,
    edge_spine=0.1235,
    edge_near=0.177,
)
"""A section of wrist A as plain numbers, without ends and fibres."""

respond = jax.jit(lambda law, strain, section, memory: law.respond(strain, section, memory))
energy = jax.jit(lambda law, *state: law.stored_energy_density(*state)[0])


def tangent(law: SectionLaw, strain: np.ndarray, section: FibreSection) -> np.ndarray:
    """The change of the resultants with the strains."""
    slope = jax.jacfwd(lambda varied: law.respond(varied, section, ()).resultants)
    return np.asarray(slope(np.asarray(strain, float)))


def section(cut: str = "on-axis", ends: NotchEnds | None = None) -> FibreSection:
    notch = nf.ArcNotch(cut, 1.40, 0.8, uncut_length=1.2)
    made = with_fibres(rod(notch, TUBE), notch, TUBE).section
    return dataclasses.replace(jax.tree.map(lambda leaf: leaf[0], made), ends=ends)


def bending(curvature: float) -> np.ndarray:
    return np.array([0.0, curvature, 0.0, 0.0, 0.0, 0.0])


def moment(law: SectionLaw, curvature: float, own: FibreSection) -> float:
    return float(respond(law, bending(curvature), own, ()).resultants[1])


def fine_fibres(cut: str) -> tuple[np.ndarray, np.ndarray]:
    """Strips of the section between horizontal lines: arm from the centroid, area."""
    outer, inner, depth = 0.81, 0.70, 1.40
    if cut == "on-axis":
        half = np.arccos((depth - outer) / outer)
        angle = (np.arange(4000) + 0.5) / 4000 * half
        radius = inner + (np.arange(200) + 0.5) / 200 * (outer - inner)
        arm = (radius[:, None] * np.cos(angle)).ravel()
        cell = half / 4000 * (outer - inner) / 200
        area = (2.0 * cell * radius[:, None] * np.ones(4000)).ravel()
    else:
        plane = depth - outer
        height = plane + (np.arange(400_000) + 0.5) / 400_000 * (outer - plane)
        chords = [np.sqrt(np.maximum(r**2 - height**2, 0.0)) for r in (outer, inner)]
        arm, area = height, 2.0 * (chords[0] - chords[1]) * (outer - plane) / 400_000
    return arm - area @ arm / area.sum(), area
