r"""Strips between slots with their roots in the walls.

A strip does not end at the tips of its slots: there it passes into the wall of a rigid piece,
which deforms. What it adds to each end of the strip is

* the rotation of the root, as of a strip on an elastic body in proportion to M / (E b t²), about a
  place slightly beyond the tip and along the wall; the walls, curved bars twisted by M sin φ where
  they are bent by M cos φ, add to it by sin² φ t/b, a wall that is short round the tube by t/r;
* the bending and stretch of the arc of wall that the slot leaves, by its true sections up the slot;
* across the tube, each wall straightening like an arch, clamped κ b beyond the slot, and the wall
  beside the slot, over its height;
* round ends of slots: the strip thickens towards its root.

Rotation, its arms and the arc act as one hinge that is spread along a run of the rod up the wall.
In the strip, the walls are more flexible by tan² φ E I/(G J).

Turned about the strip's axis or the tube's, the strip's two walls, the distance c from the tube
axis, move in the plane against each other: one up and one down, or one to each side. By their
compliances $C_{zz}$, $C_{xx}$, $C_{xz}$ together in the plane (z along the tube, x along the
strip) that is

$$\frac1{C_{\text{strip}}} = \frac{c^2}{C_{zz}} + \alpha\frac tb\frac{G J}{L},\qquad
C_{\text{tube}} = \Bigl(\beta_0\frac{r_i}{r_o} C_{xx} + \beta_1\frac{l}{2 t c}
+ \tau\frac{h e^2}{G J_a}\Bigr)\frac1{c^2},\qquad
C_{\text{both}} = -\eta\,\frac{C_{xz}}{c^2}$$

with the torsion of both walls, the length l between the tips, and that of the arc beside a slot
about its centre of twist at e. A push sideways bends both walls like the posts of a frame of the
length 2L between the hinges, and by the push on the walls turns them about the tube:
$\sigma_0\,4L^3/(t b^3) + \sigma_1\,C_{\text{tube}}\,(c^2 - L^2)$.

The numbers were fitted, all at once, to the cells of finite elements in
`tests/reference/fem_strip_cells.csv` and `fem_u_link_cells.csv` (`benchmarks/fe`), the papers' own
counting five times; `validity_warnings` of a notch lists dimensions outside their range.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import plain_number, xp
from notchflex.mechanics.cuts import annular_segment
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
    gauss_on,
    rectangle_torsion_constant,
    two_walls,
    two_walls_fibres,
)
from notchflex.robot import StripNotch, Tube, ULink


class Ends(NamedTuple):
    """Numbers that differ between slots with sharp and with round ends."""

    turn: float  # of the root's rotation
    spread: float  # mean square over square of twice the mean of its places up the wall
    twist: float  # α, of the torsion of the strip's walls
    bent: float  # β₁, of the walls moved against each other along the strip
    arc: float  # τ, of the torsion of the arc beside a slot
    coupling: float  # η


ROUND = Ends(0.192, 1.0 / 3.0, 0.435, 3.85, 0.529, 0.695)
SHARP = Ends(0.385, 0.512, 0.663, 2.96, 0.0, 0.648)


class RootedStrip(NamedTuple):
    """A strip between two slots of a tube, mm."""

    thickness: float  # thickness t along the tube
    tip: float  # half the length between the slots, to where their ends begin to round
    radius: float  # of their ends
    half: float  # half the length in which the strip bends
    slot_end: float  # half the length between the very ends of the slots
    opening: float  # height of a slot
    arc: tuple[Any, Any, Any]  # up a slot: height above the strip's middle, end of slot; weights
    turn: float  # of the root's rotation
    ends: Ends
    middle: float  # height of its middle above the proximal face
    hand: float  # 1 where the proximal wall is on the bend's side, -1 on the opposite one
    wall: float  # width of its walls


_PART, _WEIGHT = gauss_on(0.0, 1.0, 8)  # up a slot


def sharp_strip(notch: StripNotch, tube: Tube) -> RootedStrip:
    """Describe the strip between triangular notches."""
    tip, thickness = notch.depth - tube.outer_radius, notch.strip_thickness
    height = notch.height
    return RootedStrip(
        thickness=thickness,
        tip=tip,
        radius=thickness,  # any: the strip ends where rounding would begin
        half=tip,
        slot_end=tip,
        opening=height,
        arc=(0.5 * thickness + height * _PART, tip - notch.depth * _PART, height * _WEIGHT),
        turn=SHARP.turn,
        ends=SHARP,
        middle=height + notch.rise,
        hand=-1.0,
        wall=0.5 * notch.wall_width_in(tube),
    )


def round_strip(notch: ULink, tube: Tube) -> RootedStrip:
    """Describe the strip between slots with round ends."""
    tip, radius, thickness = 0.5 * notch.strip_length, notch.slot_radius, notch.strip_thickness
    bulge = radius * np.sqrt(_PART * (2.0 - _PART))
    return RootedStrip(
        thickness=thickness,
        tip=tip,
        radius=radius,
        half=tip + 0.539 * radius,
        slot_end=tip + radius,
        opening=2.0 * radius,
        arc=(0.5 * thickness + radius * _PART, tip + bulge, radius * _WEIGHT),  # half of the slot
        turn=ROUND.turn + 0.357 * radius / thickness,
        ends=ROUND,
        middle=notch.height + 0.5 * thickness,
        hand=1.0 if notch.proximal_slot == "away" else -1.0,
        wall=tube.outer_radius - tube.inner_radius,
    )


class Hinge(NamedTuple):
    """What the end of a strip adds: a hinge spread evenly along a run up the wall, and a spring."""

    turn: Any  # E times the rotation by a moment, 1/mm³
    out: Any  # distance from the middle of the strip, mm
    up: Any  # length of the run, mm
    pulled: Any  # E times the compliance along the strip besides, of both ends, 1/mm
    radius: float  # of the middle of the tube's wall, mm
    twisted: Any  # E times that of the arc's torsion by a force sideways, of both ends, 1/mm


def hinge_of(strip: RootedStrip, tube: Tube, poisson_ratio: float) -> Hinge:
    """Compute what an end of a strip adds."""
    t, wall, ratio = strip.thickness, strip.wall, 2.0 * (1.0 + poisson_ratio)
    radius = 0.5 * (tube.outer_radius + tube.inner_radius)
    oblique = t / wall * (0.266 + 0.858 * (strip.half / radius) ** 2)
    root = 6.0 / (wall * t**2) * (strip.turn + 0.244 * t / radius + oblique)
    out, up = strip.half + 0.228 * t, 0.924 * t
    height, end, weight = strip.arc
    arc = annular_segment(tube.outer_radius, tube.inner_radius, tube.outer_radius + end)
    bend, place = weight / arc.second_moment_weak, xp.asarray(arc.centroid)
    turn = root + bend.sum()
    far = xp.sqrt((root * out**2 + (bend * place**2 + weight / arc.area).sum()) / turn)
    high = (root * out * up + (bend * height * place).sum()) / (turn * far)
    risen = strip.ends.spread * root * up**2 + (bend * height**2).sum() - turn * high**2 / 3.0
    # Pulled, both walls straighten as arches.
    reach = xp.minimum(strip.slot_end / radius, 0.98)
    angle = xp.arcsin(reach) + 0.11 * wall / radius
    spread = 0.5 + 0.25 * xp.sin(2.0 * angle) / angle - (xp.sin(angle) / angle) ** 2
    arch = 2.43 * 12.0 * radius**3 / (t * wall**3) * angle * spread
    beside = 1.47 * ratio * strip.opening * reach / wall**2
    twisted = 2.0 * ratio * (weight / arc.torsion_constant * arc.shear_centre**2).sum()
    return Hinge(turn, far, high, 2.0 * risen + arch + beside, radius, twisted)


def sideways(
    strip: RootedStrip,
    tube: Tube,
    hinge: Hinge,
    plane: Float[Array, "2 2"],
    poisson_ratio: float,
) -> tuple[Any, Any, Any, Any]:
    """Compute E times the compliance to moments about strip and tube, and of both, 1/mm³.

    The last one is that to a force sideways, without what those give, 1/mm.
    """
    rule, t, wall, out, up = strip.ends, strip.thickness, strip.wall, hinge.out, hinge.up
    square = hinge.radius**2
    torsion = 2.0 * plain_number(rectangle_torsion_constant(wall, t))
    twisted = rule.twist * t / wall * torsion / (2.0 * (1.0 + poisson_ratio)) / out
    about_strip = 1.0 / (square / plane[1, 1] + twisted)
    against = 1.59 * tube.inner_radius / tube.outer_radius * plane[0, 0]
    bent = rule.bent * strip.tip / (t * hinge.radius)
    about_tube = (against + bent + rule.arc * hinge.twisted) / square
    # Positive definite while it is below half of the root of the product; the cells have 0.32.
    limit = 0.49 * plain_number(xp.sqrt(about_strip * about_tube))
    both = plain_number(xp.clip(-rule.coupling * plane[0, 1] / square, -limit, limit))
    frame, push = 6.72 * out**3 / (t * wall**3), 2.85 * about_tube * (square - out**2)
    turning = 2.0 / 3.0 * about_tube * out**2 + about_strip * up**2 / 6.0 - both * out * up
    # The difference is positive in the cells; beyond them compliances have to stay so.
    return about_strip, about_tube, both, frame + plain_number(xp.maximum(push - turning, 0.0))


def with_sideways(
    section: FibreSection,
    length: Float[Array, " nodes"],
    on_wall: Float[Array, " nodes"],
    compliance: tuple[Any, Any, Any, Any],
    poisson_ratio: float,
) -> FibreSection:
    """Put the compliance to moments and forces out of the plane into the sections of a rod."""
    # Half of each into the strip and half, with what couples the two, into the runs along the wall.
    about_strip, about_tube, both, sway = compliance
    strip, tube = 0.5 * about_strip, 0.5 * about_tube
    wall = xp.where(on_wall, length, 0.0).sum()
    rest = xp.where(on_wall, 0.0, length).sum()
    block = xp.linalg.inv(xp.array([[strip, both], [both, tube]]) / wall)
    # About x and z of the section: strip and tube on a wall, tube and strip elsewhere.
    about_x = xp.where(on_wall, block[0, 0], rest / tube)
    about_z = xp.where(on_wall, block[1, 1], rest / strip)
    ratio = 2.0 * (1.0 + poisson_ratio)
    ends = dataclasses.replace(
        section.compliance,
        strong=section.second_moment_strong / about_x - 1.0,
        torsion=section.torsion_constant / ratio / about_z - 1.0,
        oblique=xp.where(on_wall, block[0, 1], 0.0),
        sway=xp.where(on_wall, _STIFF, sway / rest * section.area / ratio) - 1.0,
    )
    return dataclasses.replace(section, ends=ends)


# Of a section's compliance, where it is left out.
_STIFF = 1e-6


def walls_at(along: Array, tube: Tube) -> tuple[Array, Array]:
    """Return the width of the tube's walls where a strip is, mm, and the distance of their middles.

    Beyond the lumen they are one, and the middles those of its halves.
    """
    outer = xp.sqrt(tube.outer_radius**2 - along**2)
    inner = xp.sqrt(xp.maximum(tube.inner_radius**2 - along**2, 0.0))
    return outer - inner, 0.5 * (outer + inner)


def strip_sections(
    strip: RootedStrip,
    tube: Tube,
    hinge: Hinge,
    along: Array,
    on_wall: Array,
    poisson_ratio: float,
) -> FibreSection:
    """Compute the sections of the strip (as wide as the tube's walls) and of its roots."""
    # Beyond the tips of the slots the width of the walls is constant.
    inside = xp.minimum(xp.abs(along), strip.half)
    across, middle = walls_at(inside, tube)
    width = strip.wall / (tube.outer_radius - tube.inner_radius) * across
    rounded = xp.maximum(inside - strip.tip, 0.0)
    thickness = strip.thickness + strip.radius - xp.sqrt(strip.radius**2 - rounded**2)
    walls = two_walls(width, thickness, middle)
    ratio = 2.0 * (1.0 + poisson_ratio)  # E / G
    square = xp.minimum((inside / hinge.radius) ** 2, 0.95)  # sin² of the angle to a wall
    bar = two_walls(strip.wall, thickness, 0.0)
    twisting = ratio * xp.asarray(bar.second_moment_weak) / bar.torsion_constant
    area, bent = xp.asarray(walls.area), xp.abs(along) < strip.half
    # Between the strip and its hinges only shear and stretch are left; a hinge has none of them.
    turned = xp.where(on_wall, walls.second_moment_weak * hinge.turn / hinge.up, _STIFF)
    pulled = xp.where(bent, 1.0 + hinge.pulled * area / (2.0 * strip.half), 1.0)
    shear = 6.0 / 5.0  # over that of a stress which is even over the section
    ends = NotchEnds(
        weak=xp.where(bent, twisting * square / (1.0 - square), turned - 1.0),
        axial=xp.where(on_wall, _STIFF, pulled) - 1.0,
        push=xp.where(on_wall, _STIFF, shear) - 1.0,
        material_share=1.0,  # the root yields where the strip does
    )
    return dataclasses.replace(about_neutral_axis(walls), ends=ends)


def rooted_strip_rod(
    strip: RootedStrip,
    tube: Tube,
    distal: float,
    refinement: int,
    poisson_ratio: float,
    **options: Any,
) -> Rod:
    """Build the rod of a strip with its roots; the distal frame is `distal` mm above the face."""
    hinge = hinge_of(strip, tube, poisson_ratio)
    beyond = hinge.out - strip.half
    pieces = [0.0, hinge.up, beyond, 2.0 * strip.half, beyond, hinge.up]
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
    section = strip_sections(strip, tube, hinge, along[:-2], on_wall, poisson_ratio)
    # E times the compliance to forces across and along the tube at the middle, 1/mm.
    resultants = unit_forces(poses.pick(slice(-2)), middle)
    strain = strains_of(section, poisson_ratio, resultants)
    plane = xp.einsum("k,kic,kjc->ij", points.weight, resultants, strain)
    others = sideways(strip, tube, hinge, plane, poisson_ratio)
    section = with_sideways(section, points.weight, on_wall, others, poisson_ratio)
    modes = 3 + 3 * refinement, 1 + 2 * refinement
    return course_rod(points, poses, section, middle, modes, distal, poisson_ratio, **options)


@section_fibres.register
def _(notch: StripNotch | ULink, tube: Tube) -> FibresAt:
    return two_walls_fibres


STRIP_UNCHECKED = "the stiffness of the strip was not checked"


def wall_ranges(thickness: float, tube: Tube) -> list[Dimension]:
    """Return the checked ranges of a strip (mm) and the wall that it turns into."""
    inner, outer = tube.inner_radius, tube.outer_radius
    thin = "bending was found up to 3 % off, other compliances up to 18 %"
    return [
        ("inner / outer diameter", inner / outer, [(0.4, 0.8, thin)]),
        ("strip thickness / wall", thickness / (outer - inner), [(0.33, 1.2, STRIP_UNCHECKED)]),
    ]
