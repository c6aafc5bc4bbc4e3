"""Strips between slots with their roots in the walls: rods, and ranges of validity."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

from notchflex._arrays import plain_number, xp
from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    about_neutral_axis,
    between,
    build_rod,
    shifted,
    wrench_modes,
)
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.flexure.rod_kinematics import RodQuadrature
from notchflex.mechanics.material import FibreSection, NotchEnds
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.section import (
    clamped_torsion_constant,
    rectangle_torsion_constant,
    two_walls,
)
from notchflex.robot import StripNotch, Tube, ULink

# The strip between two slots with the walls that it turns into: compliances and sections.
#
# Turned about the strip's axis or the tube's, the strip's two walls, the distance c from the tube
# axis, move in the plane against each other: one up and one down, or one to each side. By their
# compliances $C_{zz}$, $C_{xx}$, $C_{xz}$ together in the plane (z along the tube, x along the
# strip) that is
#
# $$\frac1{C_{\text{strip}}} = \gamma\frac{c^2}{C_{zz}} + \alpha\frac{2\,G J_w}{L},\qquad
# C_{\text{tube}} = \Bigl(\beta_0+\beta_1\frac{r_i}{r_o}\Bigr)\frac{C_{xx}}{c^2},\qquad
# C_{\text{both}} = -\eta\,\frac{C_{xz}}{c^2},$$
#
# where the walls, of the torsion constant $J_w$ and the length L, are twisted besides. The
# constants were fitted to the cells of finite elements that `rooted_strip` names, the papers' link
# counting four times. Half of each is put into the strip and half, with what couples the two, into
# the runs along the walls: that stays positive definite while the coupling is below half of the
# root of the product; the cells have 0.29 at most, and more than 0.49 is not taken.
#
# A strip does not end at the tips of its slots: there it passes into the wall of a rigid piece,
# which deforms. Its rod continues slightly beyond the tip, turns at a right angle and runs along
# the wall. This models the root rotation of a strip on an elastic body, proportional to $M / (E b
# t^2)$, at the position found by finite elements. The two walls of the strip are curved bars:
#
# * at the angle φ from its middle a wall is twisted by $M\sin\varphi$ where it is bent by
#   $M\cos\varphi$, which makes the strip more flexible by $\tan^2\varphi\,E I/(G J)$ of the wall,
#   and the root by $c\tan^2\varphi\,t/t_w$;
# * pulled across the tube, a wall straightens like an arch, clamped $\kappa\sqrt{t t_w}$
#   beyond the tips;
# * pushed sideways, both walls bend like the posts of a frame, clamped likewise; moments out of the
#   plane move the walls against each other.
#
# The shear areas of strip and root are 5/6 of the whole. The constants were fitted, all at once, to
# the cells of finite elements in `tests/reference/fem_strip_cells.csv` and `fem_u_link_cells.csv`
# (`benchmarks/fe`); `validity_warnings` of a notch lists dimensions outside their range.


class Sideways(NamedTuple):
    """Constants of the rule, for sharp or for round ends of slots."""

    against: float  # γ, of the walls moved against each other along the tube
    twist: float  # α, of their torsion
    across: tuple[float, float]  # β₀ and β₁, of the walls moved against each other along the strip
    coupling: float  # η


ROUND = Sideways(0.9841, 0.6533, (0.9868, 1.4764), 0.7012)
SHARP = Sideways(0.9841, 1.1015, (0.6014, 0.8737), 0.6053)
# Shares of the compliances to moments about the strip and the tube that lie in the walls.
_ON_WALLS = (0.5, 0.5)
# Most of the coupling, over the root of the product of what it couples.
_MAX_COUPLING = 0.49


class Walls(NamedTuple):
    """The two walls of a strip."""

    outer: float  # Outer radius of the tube, mm
    inner: float  # Inner radius, mm
    width: float  # Width of each wall, mm
    thickness: float  # Thickness of the strip, mm
    length: float  # Length over which they are twisted, mm


def plane_compliance(
    poses: Motion,
    length: Float[Array, " nodes"],
    section: FibreSection,
    middle: Float[Array, " 3"],
    poisson_ratio: float,
) -> Float[Array, "2 2"]:
    """Compute E times the compliance to forces across and along the tube at the middle."""
    ratio, ends = 2.0 * (1.0 + poisson_ratio), section.ends
    assert ends is not None
    bending = (1.0 + xp.asarray(ends.weak)) / xp.asarray(section.second_moment_weak)
    along = (1.0 + xp.asarray(ends.axial)) / xp.asarray(section.area)
    across = ratio * (1.0 + xp.asarray(ends.push)) / xp.asarray(section.area)
    lever = xp.asarray(poses.translation) - middle
    # Of unit forces along x and z: moments about y, then the forces in the frames of the sections.
    moment = xp.stack([-lever[:, 2], lever[:, 0]], axis=-1)
    force = xp.asarray(poses.rotation)[:, [0, 2]]
    parts = (bending, moment), (across, force[..., 0]), (along, force[..., 2])
    products = [xp.einsum("k,ki,kj->ij", length * soft, by, by) for soft, by in parts]
    return xp.sum(xp.stack(products), axis=0)


def turned_compliance(
    walls: Walls, plane: Float[Array, "2 2"], rule: Sideways, poisson_ratio: float
) -> tuple[float, float, float]:
    """Compute E times the compliance to moments about the strip and the tube, and of both."""
    arm = 0.25 * (walls.outer + walls.inner) ** 2
    torsion = 2.0 * plain_number(rectangle_torsion_constant(walls.width, walls.thickness))
    twisted = rule.twist * torsion / (2.0 * (1.0 + poisson_ratio)) / walls.length
    strip = 1.0 / (rule.against * arm / plane[1, 1] + twisted)
    tube = (rule.across[0] + rule.across[1] * walls.inner / walls.outer) * plane[0, 0] / arm
    limit = _MAX_COUPLING * plain_number(xp.sqrt(strip * tube))
    return strip, tube, plain_number(xp.clip(-rule.coupling * plane[0, 1] / arm, -limit, limit))


def with_sideways(
    section: FibreSection,
    length: Float[Array, " nodes"],
    on_wall: Float[Array, " nodes"],
    turned: tuple[float, float, float],
    poisson_ratio: float,
) -> FibreSection:
    """Put the compliance to moments out of the plane into the sections of a rod."""
    strip, tube, both = turned
    assert section.ends is not None
    wall = xp.where(on_wall, length, 0.0).sum()
    rest = xp.where(on_wall, 0.0, length).sum()
    of_strip, of_tube = _ON_WALLS
    block = xp.linalg.inv(xp.array([[of_strip * strip, both], [both, of_tube * tube]]) / wall)
    # About x and z of the section: strip and tube on a wall, tube and strip elsewhere.
    about_x = xp.where(on_wall, block[0, 0], rest / ((1.0 - of_tube) * tube))
    about_z = xp.where(on_wall, block[1, 1], rest / ((1.0 - of_strip) * strip))
    torsion = xp.asarray(section.torsion_constant) / (2.0 * (1.0 + poisson_ratio))
    ends = dataclasses.replace(
        section.ends,
        strong=constant(xp.asarray(section.second_moment_strong) / about_x - 1.0),
        torsion=constant(torsion / about_z - 1.0),
        oblique=constant(xp.where(on_wall, block[0, 1], 0.0)),
    )
    return dataclasses.replace(section, ends=ends)


# Length of a strip beyond the tip of the slot, over its size (`_size`).
_BEYOND = 0.267
# The same for the run along the wall, at sharp and at round tips; and over the slot's radius.
_ALONG_SHARP, _ALONG_ROUND, _ALONG_RADIUS = 1.208, 1.016, 0.544
# Length of a strip round the end of a slot on each side, over the radius of the slot.
_ROUND_END = 0.662
# Second moment of a root over that of the strip at the tip, sharp or round.
_BENDING_SHARP, _BENDING_ROUND = 2.098, 2.695
# Power of the strip's over the wall's thickness by which the lengths of the root grow.
_POWER = 0.152
# Shear of a body below a triangular notch: length over the notch's height, of the whole tube.
_WEDGE = 4.893


class RootedStrip(NamedTuple):
    """A strip between two slots of a tube."""

    thickness: float  # Thickness t along the tube, mm
    free_length: float  # Length between the tips of the slots, mm
    beyond: float  # Length beyond the tips, mm
    along: float  # Length along the wall, mm
    bending: float  # Second moment of the root over that of the strip at the tip
    sheared: float  # Length of a tube that shears like the wall there, mm
    middle: float  # Height of its middle above the proximal face, mm
    hand: float  # 1 where the proximal wall is on the bend's side, -1 on the opposite one
    sideways: Sideways  # Constants of the answer to loads out of the plane
    width_factor: float = 1.0  # Width of the walls over that of the tube's walls there


def sharp_strip(notch: StripNotch, tube: Tube) -> RootedStrip:
    """Describe the strip between triangular notches."""
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
    """Describe the strip between slots with round ends."""
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


def _size(thickness: float, tube: Tube, width_factor: float = 1.0) -> float:
    """Compute the thickness to which the lengths of a root are proportional, mm."""
    wall = width_factor * (tube.outer_radius - tube.inner_radius)
    return thickness * (thickness / wall) ** _POWER


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
    along: Array,
    above: Array,
    length: float,
    poisson_ratio: float,
) -> FibreSection:
    """Compute the sections of the strip (as wide as the tube's walls) and of its roots."""
    # Beyond the tips of the slots the width of the walls is constant.
    tip = 0.5 * strip.free_length
    at = xp.minimum(xp.abs(along), tip)
    outer = xp.sqrt(tube.outer_radius**2 - at**2)
    inner = xp.sqrt(xp.maximum(tube.inner_radius**2 - at**2, 0.0))
    middle, width = 0.5 * (outer + inner), strip.width_factor * (outer - inner)
    walls = two_walls(width, strip.thickness, middle)
    ratio = 2.0 * (1.0 + poisson_ratio)  # E / G
    wall = strip.width_factor * (tube.outer_radius - tube.inner_radius)
    radius = 0.5 * (tube.outer_radius + tube.inner_radius)
    square = xp.minimum((at / radius) ** 2, _STEEPEST)
    oblique = square / (1.0 - square)
    bar = two_walls(wall, strip.thickness, 0.0)
    twisting = ratio * plain_number(bar.second_moment_weak / bar.torsion_constant)
    area = xp.asarray(walls.area)
    along_wall, root = above != 0.0, (above != 0.0) | (xp.abs(along) > tip)
    in_root = (1.0 + _TWIST * oblique * strip.thickness / wall) / strip.bending - 1.0
    arch = _arch(strip.thickness, wall, radius, tip) * area / strip.free_length
    frame = _frame(strip, wall, width) * area / ratio
    sheared = np.pi * (tube.outer_radius**2 - tube.inner_radius**2) * strip.along
    in_wall = sheared / xp.maximum(strip.sheared, sheared / (_RIGID * area.min()))
    nought = xp.zeros(len(at))
    ends = NotchEnds(
        weak=constant(xp.where(root, in_root, twisting * oblique)),
        strong=constant(nought),
        axial=constant(
            xp.where(along_wall, 0.0, _SHEAR_AREA * xp.where(root, 1.0, 1.0 + arch) - 1.0)
        ),
        torsion=constant(nought),
        odd=constant(nought),
        even=constant(nought),
        material_share=constant(nought + 1.0),  # the root yields where the strip does
        sway=constant(xp.where(root, 0.0, _SHEAR_AREA * frame)),
    )
    section = about_neutral_axis(
        walls, clamped_torsion_constant(walls, middle, length, poisson_ratio)
    )
    area = constant(xp.where(along_wall, in_wall, _SHEAR_AREA * area))
    return dataclasses.replace(section, area=area, ends=ends)


def _arch(thickness: float, wall: float, radius: float, tip: float) -> float:
    """Compute the stretch of two walls that straighten as arches, times E over force, 1/mm."""
    angle = (
        xp.arcsin(xp.minimum(tip / radius, xp.sqrt(_STEEPEST)))
        + _CLAMP * xp.sqrt(thickness * wall) / radius
    )
    spread = 0.5 + 0.25 * xp.sin(2.0 * angle) / angle - (xp.sin(angle) / angle) ** 2
    return plain_number(radius**3 * 2.0 * angle * spread / (2.0 * thickness * wall**3 / 12.0))


def _frame(strip: RootedStrip, wall: float, width: Array) -> Array:
    """Compute the sway of two walls as posts of a frame, times E over force and length, 1/mm²."""
    length = strip.free_length + 2.0 * _CLAMP_SIDEWAYS * xp.sqrt(strip.thickness * wall)
    return length**3 / (12.0 * 2.0 * strip.thickness * width**3 / 12.0) / strip.free_length


# Rod of a strip with its roots, from the proximal wall to the distal one.


def _walls(strip: RootedStrip, tube: Tube) -> Walls:
    """Return the strip's two walls."""
    return Walls(
        outer=tube.outer_radius,
        inner=tube.inner_radius,
        width=strip.width_factor * (tube.outer_radius - tube.inner_radius),
        thickness=strip.thickness,
        length=strip.free_length + 2.0 * strip.beyond,
    )


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
    """Build the rod of a strip with its roots."""
    pieces = [0.0, strip.along, strip.beyond, strip.free_length, strip.beyond, strip.along]
    ends = tuple(xp.cumsum(xp.stack(pieces)))
    more = refinement
    counts = (3 + more, 2 + more, 6 + 3 * more, 2 + more, 3 + more)
    points = RodQuadrature(ends, counts, counts)
    position = points.every
    course = _course(position, ends)
    section = strip_sections(strip, tube, *course[:2], ends[-1], poisson_ratio)
    middle = xp.array([0.0, 0.0, strip.middle])
    start, end = (_poses(strip, *_course(xp.array([at]), ends)) for at in (0.0, ends[-1]))
    start, end = (Motion(one.rotation[0], one.translation[0]) for one in (start, end))
    poses = _poses(strip, *course)
    plane = plane_compliance(poses, points.weight, section, middle, poisson_ratio)
    turned = turned_compliance(_walls(strip, tube), plane, strip.sideways, poisson_ratio)
    section = with_sideways(section, points.weight, course[2], turned, poisson_ratio)
    moments, forces = 3 + 3 * refinement, 1 + 2 * refinement
    basis = wrench_modes(
        poses,
        2.0 * position / ends[-1] - 1.0,
        points.weight,
        section,
        middle,
        moments,
        forces,
        poisson_ratio,
    )
    poses_to_end = Motion(
        constant(xp.concatenate([poses.rotation, end.rotation[None]])),
        constant(xp.concatenate([poses.translation, end.translation[None]])),
    )
    axis = NeutralAxis(
        points,
        start,
        between(end, shifted(z=distal)),
        between(start, poses_to_end),
        xp.tile(STRAIGHT, (len(position), 1)),
    )
    in_plane = moments + 2 * forces
    return build_rod(
        axis,
        section,
        StrainModes(basis, (in_plane, in_plane, basis.shape[-1])),
        direction_deg=direction_deg,
        linear_kinematics=linear_kinematics,
    )


def _course(position: Float[Array, " k"], ends: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Return positions along the strip and above its middle, mm, and a mask of the walls."""
    half = 0.5 * ends[-1]
    along = xp.clip(position - half, ends[1] - half, half - ends[1])
    above = position - half - along
    return along, above, above != 0.0


def _poses(strip: RootedStrip, along: ArrayLike, above: ArrayLike, on_wall: ArrayLike) -> Motion:
    """Compute poses along the free rod: z along it, y out of the plane."""
    x = -strip.hand * xp.asarray(along)
    position = xp.stack([x, xp.zeros_like(x), strip.middle + xp.asarray(above)], axis=-1)
    about_y = xp.where(on_wall, 0.0, -0.5 * np.pi * strip.hand)
    turns = rotation_about(constant(about_y[:, None] * xp.array([0.0, 1.0, 0.0])))
    return Motion(turns, constant(position))


# Checked ranges of the dimensions of a notch, and those that it leaves.

_UNCHECKED = ": the stiffness of the strip was not checked"
_THIN = ": bending was found up to 5 % off, shear across the strip up to 18 %"


class CheckedRange(NamedTuple):
    """A dimension of a notch, with its range checked against finite elements."""

    dimension: str  # Name of the dimension
    value: float  # Its value
    low: float  # Smallest value that was checked
    high: float  # Largest value that was checked
    beyond: str = _UNCHECKED  # Note on values outside, the end of a sentence


def left_ranges(ranges: Iterable[CheckedRange]) -> list[str]:
    """Return a sentence for each range that is left: the number, its bound and what is known."""
    sentences: list[str] = []
    for dimension, value, low, high, beyond in ranges:
        if not low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9):
            side, bound = ("below", low) if value < low else ("above", high)
            sentences.append(f"{dimension} is {value:.3g}, {side} {bound:g}{beyond}")
    return sentences


def wall_ranges(thickness: float, tube: Tube) -> list[CheckedRange]:
    """Return the ranges of a strip [mm] and the wall that it turns into."""
    wall = tube.outer_radius - tube.inner_radius
    return [
        CheckedRange(
            "inner / outer diameter", tube.inner_radius / tube.outer_radius, 0.4, 0.77, _THIN
        ),
        CheckedRange("strip thickness / wall", thickness / wall, 0.35, 1.0),
    ]
