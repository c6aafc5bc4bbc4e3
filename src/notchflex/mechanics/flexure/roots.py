r"""Strips between slots with their roots in the walls.

A strip does not end at the tips of its slots: there it passes into the wall of a rigid piece,
which deforms. Its rod continues slightly beyond the tip, turns at a right angle and runs along the
wall. This models the root rotation of a strip on an elastic body, proportional to M / (E b t^2), at
the position found by finite elements. The two walls of the strip are curved bars:

* at the angle φ from its middle a wall is twisted by M sin φ where it is bent by M cos φ, which
  makes the strip more flexible by tan² φ E I/(G J) of the wall, and the root by c tan² φ t/t_w;
* pulled across the tube, a wall straightens like an arch, clamped κ √(t t_w) beyond the tips;
* pushed sideways, both walls bend like the posts of a frame, clamped likewise; moments out of the
  plane move the walls against each other.

Turned about the strip's axis or the tube's, the strip's two walls, the distance c from the tube
axis, move in the plane against each other: one up and one down, or one to each side. By their
compliances $C_{zz}$, $C_{xx}$, $C_{xz}$ together in the plane (z along the tube, x along the
strip) that is

$$\frac1{C_{\text{strip}}} = \gamma\frac{c^2}{C_{zz}} + \alpha\frac{2\,G J_w}{L},\qquad
C_{\text{tube}} = \Bigl(\beta_0+\beta_1\frac{r_i}{r_o}\Bigr)\frac{C_{xx}}{c^2},\qquad
C_{\text{both}} = -\eta\,\frac{C_{xz}}{c^2},$$

where the walls, of the torsion constant $J_w$ and the length L, are twisted besides.

The numbers were fitted, all at once, to the cells of finite elements in
`tests/reference/fem_strip_cells.csv` and `fem_u_link_cells.csv` (`benchmarks/fe`), the papers' link
counting four times; `validity_warnings` of a notch lists dimensions outside their range.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import plain_number, xp
from notchflex.mechanics.ends import Dimension
from notchflex.mechanics.flexure.notch_rod import (
    RodQuadrature,
    about_neutral_axis,
    course_poses,
    course_rod,
    strains_of,
    unit_forces,
)
from notchflex.mechanics.flexure.rod import Rod, section_fibres
from notchflex.mechanics.material import FibreSection, NotchEnds
from notchflex.mechanics.section import (
    FibresAt,
    clamped_torsion_constant,
    rectangle_torsion_constant,
    two_walls,
    two_walls_fibres,
)
from notchflex.robot import StripNotch, Tube, ULink


class Sideways(NamedTuple):
    """Numbers of the answer to loads out of the plane, for sharp or for round ends of slots."""

    against: float  # γ, of the walls moved against each other along the tube
    twist: float  # α, of their torsion
    across: tuple[float, float]  # β₀ and β₁, of the walls moved against each other along the strip
    coupling: float  # η


ROUND = Sideways(0.9841, 0.6533, (0.9868, 1.4764), 0.7012)
SHARP = Sideways(0.9841, 1.1015, (0.6014, 0.8737), 0.6053)


class RootedStrip(NamedTuple):
    """A strip between two slots of a tube, mm."""

    thickness: float  # thickness t along the tube
    free_length: float  # length between the tips of the slots
    beyond: float  # length beyond the tips
    along: float  # length along the wall
    bending: float  # second moment of the root over that of the strip at the tip
    sheared: float  # length of a tube that shears like the wall there
    middle: float  # height of its middle above the proximal face
    hand: float  # 1 where the proximal wall is on the bend's side, -1 on the opposite one
    sideways: Sideways
    wall: float  # width of its walls
    width_factor: float = 1.0  # the same over that of the tube's walls


def sharp_strip(notch: StripNotch, tube: Tube) -> RootedStrip:
    """Describe the strip between triangular notches."""
    factor = notch.wall_width_in(tube) / (tube.outer_diameter - tube.inner_diameter)
    wall = factor * (tube.outer_radius - tube.inner_radius)
    size = _size(notch.strip_thickness, wall)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=2.0 * notch.depth - tube.outer_diameter,
        beyond=0.267 * size,
        along=1.208 * size,
        bending=2.098,
        sheared=4.893 * notch.height,  # of the body below a triangular notch
        middle=notch.height + notch.rise,
        hand=-1.0,
        sideways=SHARP,
        wall=wall,
        width_factor=factor,
    )


def round_strip(notch: ULink, tube: Tube) -> RootedStrip:
    """Describe the strip between slots with round ends."""
    wall = tube.outer_radius - tube.inner_radius
    size = _size(notch.strip_thickness, wall)
    return RootedStrip(
        thickness=notch.strip_thickness,
        free_length=notch.strip_length + 2.0 * 0.662 * notch.slot_radius,
        beyond=0.267 * size,
        along=1.016 * size + 0.544 * notch.slot_radius,
        bending=2.695,
        sheared=0.0,
        middle=notch.height + 0.5 * notch.strip_thickness,
        hand=1.0 if notch.proximal_slot == "away" else -1.0,
        sideways=ROUND,
        wall=wall,
    )


def _size(thickness: float, wall: float) -> float:
    """Compute the thickness to which the lengths of a root are proportional, mm."""
    return thickness * (thickness / wall) ** 0.152


def turned_compliance(
    strip: RootedStrip, tube: Tube, plane: Float[Array, "2 2"], poisson_ratio: float
) -> tuple[Any, Any, Any]:
    """Compute E times the compliance to moments about strip and tube, and of both, 1/mm³."""
    rule, outer, inner = strip.sideways, tube.outer_radius, tube.inner_radius
    arm = 0.25 * (outer + inner) ** 2
    torsion = 2.0 * plain_number(rectangle_torsion_constant(strip.wall, strip.thickness))
    length = strip.free_length + 2.0 * strip.beyond
    twisted = rule.twist * torsion / (2.0 * (1.0 + poisson_ratio)) / length
    about_strip = 1.0 / (rule.against * arm / plane[1, 1] + twisted)
    about_tube = (rule.across[0] + rule.across[1] * inner / outer) * plane[0, 0] / arm
    # Positive definite while it is below half of the root of the product; the cells have 0.29.
    limit = 0.49 * plain_number(xp.sqrt(about_strip * about_tube))
    coupling = plain_number(xp.clip(-rule.coupling * plane[0, 1] / arm, -limit, limit))
    return about_strip, about_tube, coupling


def with_sideways(
    section: FibreSection,
    length: Float[Array, " nodes"],
    on_wall: Float[Array, " nodes"],
    turned: tuple[Any, Any, Any],
    poisson_ratio: float,
) -> FibreSection:
    """Put the compliance to moments out of the plane into the sections of a rod."""
    # Half of each into the strip and half, with what couples the two, into the runs along the wall.
    strip, tube, both = 0.5 * turned[0], 0.5 * turned[1], turned[2]
    wall = xp.where(on_wall, length, 0.0).sum()
    rest = xp.where(on_wall, 0.0, length).sum()
    block = xp.linalg.inv(xp.array([[strip, both], [both, tube]]) / wall)
    # About x and z of the section: strip and tube on a wall, tube and strip elsewhere.
    about_x = xp.where(on_wall, block[0, 0], rest / tube)
    about_z = xp.where(on_wall, block[1, 1], rest / strip)
    torsion = section.torsion_constant / (2.0 * (1.0 + poisson_ratio))
    ends = dataclasses.replace(
        section.compliance,
        strong=section.second_moment_strong / about_x - 1.0,
        torsion=torsion / about_z - 1.0,
        oblique=xp.where(on_wall, block[0, 1], 0.0),
    )
    return dataclasses.replace(section, ends=ends)


def strip_sections(
    strip: RootedStrip,
    tube: Tube,
    along: Array,
    on_wall: Array,
    length: float,
    poisson_ratio: float,
) -> FibreSection:
    """Compute the sections of the strip (as wide as the tube's walls) and of its roots."""
    # Beyond the tips of the slots the width of the walls is constant.
    tip, wall, thickness = 0.5 * strip.free_length, strip.wall, strip.thickness
    inside = xp.minimum(xp.abs(along), tip)
    outer = xp.sqrt(tube.outer_radius**2 - inside**2)
    inner = xp.sqrt(xp.maximum(tube.inner_radius**2 - inside**2, 0.0))
    middle, width = 0.5 * (outer + inner), strip.width_factor * (outer - inner)
    walls = two_walls(width, thickness, middle)
    ratio = 2.0 * (1.0 + poisson_ratio)  # E / G
    radius = 0.5 * (tube.outer_radius + tube.inner_radius)
    square = xp.minimum((inside / radius) ** 2, 0.95)  # sin² of the angle to a wall
    oblique = square / (1.0 - square)
    bar = two_walls(wall, thickness, 0.0)
    twisting = ratio * plain_number(bar.second_moment_weak / bar.torsion_constant)
    area, root = xp.asarray(walls.area), on_wall | (xp.abs(along) > tip)
    in_root = (1.0 + 2.243 * oblique * thickness / wall) / strip.bending - 1.0
    # Pulled, both walls straighten as arches: the stretch, times E over force, is 1/mm.
    reach = xp.arcsin(xp.minimum(tip / radius, xp.sqrt(0.95)))
    angle = reach + 0.818 * xp.sqrt(thickness * wall) / radius
    spread = 0.5 + 0.25 * xp.sin(2.0 * angle) / angle - (xp.sin(angle) / angle) ** 2
    stretch = radius**3 * 2.0 * angle * spread / (2.0 * thickness * wall**3 / 12.0)
    arch = plain_number(stretch) * area / strip.free_length
    # Both walls sway as posts of a frame.
    post = strip.free_length + 2.0 * 0.97 * xp.sqrt(thickness * wall)
    frame = post**3 / (12.0 * 2.0 * thickness * width**3 / 12.0) / strip.free_length * area / ratio
    sheared = np.pi * (tube.outer_radius**2 - tube.inner_radius**2) * strip.along
    # A root that does not shear has a million times the area of the strip.
    in_wall = sheared / xp.maximum(strip.sheared, sheared / (1e6 * area.min()))
    shear_area = 5.0 / 6.0
    ends = NotchEnds(
        weak=xp.where(root, in_root, twisting * oblique),
        axial=xp.where(on_wall, 0.0, shear_area * xp.where(root, 1.0, 1.0 + arch) - 1.0),
        material_share=1.0,  # the root yields where the strip does
        sway=xp.where(root, 0.0, shear_area * frame),
    )
    section = about_neutral_axis(
        walls, clamped_torsion_constant(walls, middle, length, poisson_ratio)
    )
    return dataclasses.replace(
        section, area=xp.where(on_wall, in_wall, shear_area * area), ends=ends
    )


def rooted_strip_rod(
    strip: RootedStrip,
    tube: Tube,
    distal: float,
    refinement: int,
    poisson_ratio: float,
    **options: Any,
) -> Rod:
    """Build the rod of a strip with its roots; the distal frame is `distal` mm above the face."""
    pieces = [0.0, strip.along, strip.beyond, strip.free_length, strip.beyond, strip.along]
    ends = tuple(xp.cumsum(xp.stack(pieces)))
    length, more = ends[-1], refinement
    counts = (3 + more, 2 + more, 6 + 3 * more, 2 + more, 3 + more)
    points = RodQuadrature(ends, counts, counts)
    # Along the strip and above its middle; the last two positions are the start and the end.
    position, half = xp.append(points.positions, xp.stack([0.0 * length, length])), 0.5 * length
    along = xp.clip(position - half, ends[1] - half, half - ends[1])
    above = position - half - along
    heading = xp.where(above != 0.0, 0.5 * np.pi, 0.0)
    middle = xp.array([0.0, 0.0, strip.middle])
    poses = course_poses(along, above, heading, middle, strip.hand)
    on_wall = above[:-2] != 0.0
    section = strip_sections(strip, tube, along[:-2], on_wall, length, poisson_ratio)
    # E times the compliance to forces across and along the tube at the middle, 1/mm.
    resultants = unit_forces(poses.pick(slice(-2)), middle)
    strain = strains_of(section, poisson_ratio, resultants)
    plane = xp.einsum("k,kic,kjc->ij", points.weight, resultants, strain)
    turned = turned_compliance(strip, tube, plane, poisson_ratio)
    section = with_sideways(section, points.weight, on_wall, turned, poisson_ratio)
    modes = 3 + 3 * refinement, 1 + 2 * refinement
    return course_rod(points, poses, section, middle, modes, distal, poisson_ratio, **options)


@section_fibres.register
def _(notch: StripNotch | ULink, tube: Tube) -> FibresAt:
    del notch, tube
    return two_walls_fibres


STRIP_UNCHECKED = "the stiffness of the strip was not checked"


def wall_ranges(thickness: float, tube: Tube) -> list[Dimension]:
    """Return the checked ranges of a strip (mm) and the wall that it turns into."""
    inner, outer = tube.inner_radius, tube.outer_radius
    thin = "bending was found up to 5 % off, shear across the strip up to 18 %"
    return [
        ("inner / outer diameter", inner / outer, [(0.4, 0.77, thin)]),
        ("strip thickness / wall", thickness / (outer - inner), [(0.35, 1.0, STRIP_UNCHECKED)]),
    ]
