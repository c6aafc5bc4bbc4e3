"""Sections of a strip between two slots, of its walls and of its roots."""

from __future__ import annotations

import dataclasses

import numpy as np

from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    about_neutral_axis,
)
from notchflex.mechanics.flexure.roots.rooted_strip import RootedStrip
from notchflex.mechanics.material import FibreSection, NotchEnds
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from notchflex.robot import Tube

# Twisting c of a root.
_TWIST = 2.243
# Distance beyond the tips at which walls are clamped, over the root of both thicknesses.
_CLAMP, _CLAMP_SIDEWAYS = 0.818, 0.97
_SHEAR_AREA = 5.0 / 6.0
_STEEPEST = 0.95  # largest sin² of the angle to a wall
_RIGID = 1e6  # area of a root that does not shear, over that of the strip


def strip_sections(
    strip: RootedStrip,
    tube: Tube,
    along: np.ndarray,
    above: np.ndarray,
    length: float,
    poisson_ratio: float,
) -> FibreSection:
    """Compute the sections of the strip (as wide as the tube's walls) and of its roots."""
    # Beyond the tips of the slots the width of the walls is constant.
    tip = 0.5 * strip.free_length
    at = np.minimum(np.abs(along), tip)
    outer = np.sqrt(tube.outer_radius**2 - at**2)
    inner = np.sqrt(np.maximum(tube.inner_radius**2 - at**2, 0.0))
    middle, width = 0.5 * (outer + inner), strip.width_factor * (outer - inner)
    walls = two_walls(width, strip.thickness, middle)
    ratio = 2.0 * (1.0 + poisson_ratio)  # E / G
    wall = strip.width_factor * (tube.outer_radius - tube.inner_radius)
    radius = 0.5 * (tube.outer_radius + tube.inner_radius)
    square = np.minimum((at / radius) ** 2, _STEEPEST)
    oblique = square / (1.0 - square)
    bar = two_walls(wall, strip.thickness, 0.0)
    twisting = ratio * float(bar.second_moment_weak / bar.torsion_constant)
    area = np.asarray(walls.area)
    along_wall, root = above != 0.0, (above != 0.0) | (np.abs(along) > tip)
    in_root = (1.0 + _TWIST * oblique * strip.thickness / wall) / strip.bending - 1.0
    arch = _arch(strip.thickness, wall, radius, tip) * area / strip.free_length
    frame = _frame(strip, wall, width) * area / ratio
    sheared = np.pi * (tube.outer_radius**2 - tube.inner_radius**2) * strip.along
    in_wall = sheared / max(strip.sheared, sheared / (_RIGID * area.min()))
    nought = np.zeros(len(at))
    ends = NotchEnds(
        weak=constant(np.where(root, in_root, twisting * oblique)),
        strong=constant(nought),
        axial=constant(
            np.where(along_wall, 0.0, _SHEAR_AREA * np.where(root, 1.0, 1.0 + arch) - 1.0)
        ),
        torsion=constant(nought),
        odd=constant(nought),
        even=constant(nought),
        material_share=constant(nought + 1.0),  # the root yields where the strip does
        sway=constant(np.where(root, 0.0, _SHEAR_AREA * frame)),
    )
    section = about_neutral_axis(
        walls, clamped_torsion_constant(walls, middle, length, poisson_ratio)
    )
    area = constant(np.where(along_wall, in_wall, _SHEAR_AREA * area))
    return dataclasses.replace(section, area=area, ends=ends)


def _arch(thickness: float, wall: float, radius: float, tip: float) -> float:
    """Compute the stretch of two walls that straighten as arches, times E over force, 1/mm."""
    angle = (
        np.arcsin(min(tip / radius, np.sqrt(_STEEPEST)))
        + _CLAMP * np.sqrt(thickness * wall) / radius
    )
    spread = 0.5 + 0.25 * np.sin(2.0 * angle) / angle - (np.sin(angle) / angle) ** 2
    return float(radius**3 * 2.0 * angle * spread / (2.0 * thickness * wall**3 / 12.0))


def _frame(strip: RootedStrip, wall: float, width: np.ndarray) -> np.ndarray:
    """Compute the sway of two walls as posts of a frame, times E over force and length, 1/mm²."""
    length = strip.free_length + 2.0 * _CLAMP_SIDEWAYS * np.sqrt(strip.thickness * wall)
    return length**3 / (12.0 * 2.0 * strip.thickness * width**3 / 12.0) / strip.free_length
