"""Closed-form sections of a notched tube (York 2015; Pacheco 2021 uses the sector)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class PlaneSection(NamedTuple):
    """Area [mm2], centroid toward the spine [mm], second moment about the centroid [mm4]."""

    area: float
    centroid: float
    second_moment: float


def sector(outer_diameter: float, inner_diameter: float, depth: float) -> PlaneSection:
    """Annular sector left by an on-axis laser cut of `depth` (all lengths mm)."""
    ro, ri = outer_diameter / 2, inner_diameter / 2
    a = np.arccos((depth - ro) / ro)
    area = a * (ro**2 - ri**2)
    centroid = 2 * np.sin(a) / (3 * a) * (ro**3 - ri**3) / (ro**2 - ri**2)
    about_axis = (ro**4 - ri**4) / 4 * (a + np.sin(a) * np.cos(a))
    return PlaneSection(area, centroid, about_axis - area * centroid**2)


def segment(outer_diameter: float, inner_diameter: float, depth: float) -> PlaneSection:
    """Annular segment left by an off-axis (chord) cut of `depth` (all lengths mm)."""
    d = depth - outer_diameter / 2

    def disc(r: float) -> np.ndarray:
        # Area, first and second moment of the part of a disc beyond the chord at d.
        a = np.arccos(np.clip(d / r, -1.0, 1.0))
        s, c = np.sin(a), np.cos(a)
        return np.array(
            [
                r**2 * (a - s * c),
                2 / 3 * r**3 * s**3,
                r**4 / 4 * (a - s * c + 2 * s**3 * c),
            ]
        )

    area, first, second = disc(outer_diameter / 2) - disc(inner_diameter / 2)
    return PlaneSection(area, first / area, second - first**2 / area)
