r"""The strip between two slots with the walls that it turns into, from the drawing.

A strip does not end at the tips of its slots: there it turns into the wall of a rigid piece, which
yields. Its rod goes on a little beyond the tip, turns at a right angle and runs along the wall.
That is the root rotation of a strip on an elastic body, proportional to $M / (E b t^2)$, at the
place where finite elements have it. The two walls of the strip are curved bars:

* at the angle φ from its middle a wall is twisted by $M\sin\varphi$ where it is bent by
  $M\cos\varphi$, which makes the strip more flexible by $\tan^2\varphi\,E I/(G J)$ of the wall, and
  the root by $c\tan^2\varphi\,t/t_w$;
* pulled across the tube, a wall straightens like an arch, clamped $\kappa\sqrt{t t_w}$
  beyond the tips;
* pushed sideways, both walls bend like the posts of a frame, clamped likewise; moments out of the
  plane move the walls against each other (`sideways.py`).

The shear areas of strip and root are 5/6 of the whole. The constants were fitted, all at once, to
the cells of finite elements in `tests/reference/fem_strip_cells.csv` and `fem_u_link_cells.csv`
(`benchmarks/fe`); `strip_validity` tells how far they hold.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    about_neutral_axis,
    build_rod,
    shifted,
)
from notchflex.mechanics.flexure.quadrature import RodQuadrature
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.flexure.roots.sideways import (
    ROUND,
    SHARP,
    Sideways,
    Walls,
    plane_compliance,
    turned_compliance,
    with_sideways,
)
from notchflex.mechanics.flexure.wrench_modes import wrench_modes
from notchflex.mechanics.material import FibreSection, NotchEnds
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from notchflex.robot import StripNotch, Tube, ULink

# How far a strip goes on beyond the tip of the slot, over its size (`_size`).
_BEYOND = 0.267
# The same for the run along the wall, at sharp and at round tips; and over the slot's radius.
_ALONG_SHARP, _ALONG_ROUND, _ALONG_RADIUS = 1.208, 1.016, 0.544
# How far a strip reaches round the end of a slot on each side, over the radius of the slot.
_ROUND_END = 0.662
# Second moment of a root over that of the strip at the tip, sharp or round, and its twisting c.
_BENDING_SHARP, _BENDING_ROUND, _TWIST = 2.098, 2.695, 2.243
# How far beyond the tips walls are clamped, over the root of the thicknesses of strip and wall.
_CLAMP, _CLAMP_SIDEWAYS = 0.818, 0.97
# Power of the strip's over the wall's thickness by which the lengths of the root grow.
_POWER = 0.152
# Shear of a body below a triangular notch: length over the notch's height, of the whole tube.
_WEDGE = 4.893
_SHEAR_AREA = 5.0 / 6.0
_STEEPEST = 0.95  # sin² of the angle at which a wall is at most met
_RIGID = 1e6  # area of a root that does not shear, over that of the strip


class RootedStrip(NamedTuple):
    """A strip between two slots of a tube.

    Attributes:
        thickness: Thickness t along the tube, mm.
        free_length: Length between the tips of the slots, mm.
        beyond: How far it goes on beyond the tips, mm.
        along: How far it then runs along the wall, mm.
        bending: Second moment of the root over that of the strip at the tip.
        sheared: Length of a tube that shears like the wall there, mm.
        middle: Height of its middle above the proximal face, mm.
        hand: 1 where the proximal wall is on the bend's side, -1 on the opposite one.
        sideways: Constants of the answer to loads out of the plane.
        width_factor: Width of the walls over that of the tube's walls there.
    """

    thickness: float
    free_length: float
    beyond: float
    along: float
    bending: float
    sheared: float
    middle: float
    hand: float
    sideways: Sideways
    width_factor: float = 1.0


def sharp_strip(notch: StripNotch, tube: Tube) -> RootedStrip:
    """Strip between triangular notches."""
    factor = notch.wall_width_in(tube) / (tube.outer_diameter - tube.inner_diameter)
    size = _size(notch.strip_thickness, tube, factor)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=2.0 * notch.depth - tube.outer_diameter,
        beyond=_BEYOND * size,
        along=_ALONG_SHARP * size,
        bending=_BENDING_SHARP,
        sheared=_WEDGE * notch.height,
        middle=notch.height + notch.rise,
        hand=-1.0,
        sideways=SHARP,
        width_factor=factor,
    )


def round_strip(notch: ULink, tube: Tube) -> RootedStrip:
    """Strip between slots with round ends."""
    size = _size(notch.strip_thickness, tube)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=notch.strip_length + 2.0 * _ROUND_END * notch.slot_radius,
        beyond=_BEYOND * size,
        along=_ALONG_ROUND * size + _ALONG_RADIUS * notch.slot_radius,
        bending=_BENDING_ROUND,
        sheared=0.0,
        middle=notch.height + 0.5 * notch.strip_thickness,
        hand=1.0 if notch.proximal_slot == "away" else -1.0,
        sideways=ROUND,
    )


def _walls(strip: RootedStrip, tube: Tube) -> Walls:
    """The strip's two walls."""
    return Walls(
        outer=tube.outer_radius,
        inner=tube.inner_radius,
        width=strip.width_factor * (tube.outer_radius - tube.inner_radius),
        thickness=strip.thickness,
        length=strip.free_length + 2.0 * strip.beyond,
    )


def _size(thickness: float, tube: Tube, width_factor: float = 1.0) -> float:
    """Thickness to which the lengths of a root are proportional, mm."""
    wall = width_factor * (tube.outer_radius - tube.inner_radius)
    return thickness * (thickness / wall) ** _POWER


def rooted_strip_rod(
    strip: RootedStrip,
    tube: Tube,
    distal: float,
    refinement: int = 0,
    *,
    direction_deg: float = 0.0,
    linear_kinematics: bool = False,
    poisson_ratio: float,
) -> Rod:
    """Build the rod of a strip with its roots.

    Args:
        strip: The strip.
        tube: The tube that it is cut into.
        distal: Height of the distal body's frame above the proximal face, mm.
        refinement: How many more modes and nodes than for usual loads.
        direction_deg: Side toward which a positive angle bends it, deg.
        linear_kinematics: Whether displacements are proportional to the strains.
        poisson_ratio: Poisson's ratio of the tube.

    Returns:
        The rod, from the proximal wall to the distal one.
    """
    pieces = [0.0, strip.along, strip.beyond, strip.free_length, strip.beyond, strip.along]
    ends = tuple(np.cumsum(pieces).tolist())
    more = refinement
    counts = (3 + more, 2 + more, 6 + 3 * more, 2 + more, 3 + more)
    points = RodQuadrature(ends, counts, counts)
    place = points.every
    course = _course(place, ends)
    section = _section(strip, tube, *course[:2], ends[-1], poisson_ratio)
    middle = np.array([0.0, 0.0, strip.middle])
    start, end = (_poses(strip, *_course(np.array([at]), ends)) for at in (0.0, ends[-1]))
    start, end = (Motion(one.rotation[0], one.translation[0]) for one in (start, end))
    poses = _poses(strip, *course)
    plane = plane_compliance(poses, points.weight, section, middle, poisson_ratio)
    turned = turned_compliance(_walls(strip, tube), plane, strip.sideways, poisson_ratio)
    section = with_sideways(section, points.weight, course[2], turned, poisson_ratio)
    moments, forces = 3 + 3 * refinement, 1 + 2 * refinement
    basis = wrench_modes(
        poses,
        2.0 * place / ends[-1] - 1.0,
        points.weight,
        section,
        middle,
        moments,
        forces,
        poisson_ratio,
    )
    onward = Motion(
        constant(np.concatenate([poses.rotation, end.rotation[None]])),
        constant(np.concatenate([poses.translation, end.translation[None]])),
    )
    axis = NeutralAxis(
        points,
        start,
        _between(end, shifted(z=distal)),
        _between(start, onward),
        np.tile(STRAIGHT, (len(place), 1)),
    )
    in_plane = moments + 2 * forces
    return build_rod(
        axis,
        section,
        StrainModes(basis, (in_plane, in_plane, basis.shape[-1])),
        direction_deg=direction_deg,
        linear_kinematics=linear_kinematics,
    )


def _course(
    place: Float[np.ndarray, " k"], ends: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places along the strip and above its middle, mm, and whether they lie on the wall."""
    half = 0.5 * ends[-1]
    beside = np.clip(place - half, ends[1] - half, half - ends[1])
    above = place - half - beside
    return beside, above, above != 0.0


def _poses(strip: RootedStrip, beside: ArrayLike, above: ArrayLike, on_wall: ArrayLike) -> Motion:
    """Poses along the free rod, z along it, y out of the plane, in the notch's frame."""
    x = -strip.hand * np.asarray(beside)
    place = np.stack([x, np.zeros_like(x), strip.middle + np.asarray(above)], axis=-1)
    about_y = np.where(on_wall, 0.0, -0.5 * np.pi * strip.hand)
    turns = rotation_about(constant(about_y[:, None] * np.array([0.0, 1.0, 0.0])))
    return Motion(turns, constant(place))


def _between(outer: Motion, inner: Motion) -> Motion:
    """The inner pose, or many, as seen from the outer one."""
    return Motion(outer.rotation.T @ inner.rotation, outer.point_inside(inner.translation))


def _section(
    strip: RootedStrip,
    tube: Tube,
    beside: np.ndarray,
    above: np.ndarray,
    length: float,
    poisson_ratio: float,
) -> FibreSection:
    """Sections of the strip, its walls as wide as the tube's there, and of its roots."""
    # Beyond the tips of the slots the walls keep the width that they have there.
    tip = 0.5 * strip.free_length
    at = np.minimum(np.abs(beside), tip)
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
    along_wall, root = above != 0.0, (above != 0.0) | (np.abs(beside) > tip)
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
    """Stretch of two walls by straightening as arches, times E over the force, 1/mm."""
    angle = (
        np.arcsin(min(tip / radius, np.sqrt(_STEEPEST)))
        + _CLAMP * np.sqrt(thickness * wall) / radius
    )
    spread = 0.5 + 0.25 * np.sin(2.0 * angle) / angle - (np.sin(angle) / angle) ** 2
    return float(radius**3 * 2.0 * angle * spread / (2.0 * thickness * wall**3 / 12.0))


def _frame(strip: RootedStrip, wall: float, width: np.ndarray) -> np.ndarray:
    """Sway of two walls as the posts of a frame, times E over force and free length, 1/mm²."""
    length = strip.free_length + 2.0 * _CLAMP_SIDEWAYS * np.sqrt(strip.thickness * wall)
    return length**3 / (12.0 * 2.0 * strip.thickness * width**3 / 12.0) / strip.free_length
