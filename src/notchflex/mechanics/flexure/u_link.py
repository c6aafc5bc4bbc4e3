"""The link J of a robot with slots from two sides: a strip with two curved ends (Gao 2017).

The rod follows the strip's middle line from the wall piece on one side of the tube to that on the
other: curved end, straight part, curved end (eq. 6-13). Its section is that of two walls, as thick
as the strip there and as wide as the wall of the tube at that distance from the axis; the paper
prints b h for the area of both, which must be 2 b h.
"""

from __future__ import annotations

import numpy as np

from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    about_neutral_axis,
    between,
    build_rod,
    shifted,
)
from notchflex.mechanics.flexure.quadrature import rod_quadrature
from notchflex.mechanics.flexure.registry import Site, rod, section_fibres, validity_warnings
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.flexure.roots import (
    CheckedRange,
    left_ranges,
    rooted_strip_rod,
    round_strip,
    wall_ranges,
)
from notchflex.mechanics.flexure.u_link_geometry import Course, Link
from notchflex.mechanics.flexure.wrench_modes import wrench_modes
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from notchflex.mechanics.section.fibres import FibresAt, two_walls_fibres
from notchflex.robot import Tube, ULink

# Poisson's ratio of a robot file without one. It only affects the shape of the modes and the
# restraint of warping; the stiffness is that of the material.
POISSON_RATIO = 0.33


@rod.register
def _(notch: ULink, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    if site is not None:
        return rooted_strip_rod(
            round_strip(notch, tube),
            tube,
            notch.height,
            refinement,
            direction_deg=notch.direction_deg,
            poisson_ratio=site.poisson_ratio,
        )
    more = (3 + 3 * refinement, 1 + 2 * refinement, (6 + 3 * refinement, 6 + 3 * refinement))
    return u_link_rod(notch, tube, *more)


def u_link_rod(
    notch: ULink,
    tube: Tube,
    moment_modes: int = 3,
    force_modes: int = 1,
    nodes: tuple[int, int] = (6, 6),
    poisson_ratio: float = POISSON_RATIO,
) -> Rod:
    """Build the rod of a link.

    Args:
        notch: The link.
        tube: The tube that it is cut into.
        moment_modes: Modes of the moment in the plane, 3 or more, see `wrench_modes`.
        force_modes: Pairs of modes of the force in the plane, 1 or more.
        nodes: Gauss's nodes in each curved end, and in the straight part.
        poisson_ratio: Poisson's ratio for the shape of the modes.

    Returns:
        The rod, from the proximal wall piece to the distal one.

    Example:
        >>> u_link_rod(ULink(0.275, 0.70, 2.0, "away"), Tube(5.99, 4.0)).levels
        (5, 5, 9)
    """
    link = Link(notch.slot_radius, notch.strip_thickness, notch.strip_length)
    curved = link.length - link.strip_length
    ends = (0.0, 0.5 * curved, link.length - 0.5 * curved, link.length)
    counts = (nodes[0], nodes[1], nodes[0])
    # One node less moves the tip of 27 links by 4e-8 mm, modes left out by 1e-5 mm.
    quadrature = rod_quadrature(ends, counts, tuple(count - 1 for count in counts))
    position = quadrature.every
    course = link.course_at((*position.tolist(), 0.0, link.length))
    section = _section(link, tube, Course(*(values[:-2] for values in course)), poisson_ratio)
    # A slot cut from the side away from the bend leaves the wall on the bend's side, where the
    # link then begins; over the slot that follows stands its mirror image.
    hand = 1.0 if notch.proximal_slot == "away" else -1.0
    # The strip lies above its proximal slot, whose lower edge is the proximal face.
    middle = np.array([0.0, 0.0, 2.0 * notch.slot_radius + 0.5 * notch.strip_thickness])
    every = _poses(course, middle, hand)
    poses, start, end = (Motion(*(part[at] for part in every)) for at in (slice(-2), -2, -1))
    free = np.tile(STRAIGHT, (len(position), 1))
    free[:, 1] = hand * course.curvature[:-2]
    basis = wrench_modes(
        poses,
        2.0 * position / link.length - 1.0,
        quadrature.weight,
        section,
        middle,
        moment_modes,
        force_modes,
        poisson_ratio,
    )
    poses_to_end = Motion(*(constant(np.delete(part, -2, axis=0)) for part in every))
    # The distal body's frame: level with the strip's lower edge, on the tube axis.
    distal = between(end, shifted(z=2.0 * notch.slot_radius))
    axis = NeutralAxis(quadrature, start, distal, between(start, poses_to_end), free)
    in_plane = moment_modes + 2 * force_modes
    modes = StrainModes(basis, (in_plane, in_plane, basis.shape[-1]))
    return build_rod(axis, section, modes, direction_deg=notch.direction_deg)


def _poses(course: Course, middle: np.ndarray, hand: float) -> Motion:
    """Compute the poses of the free middle line: z along it, y out of the plane."""
    position = np.stack([-hand * course.along, 0.0 * course.along, course.above], axis=-1)
    about_y = hand * (course.heading - 0.5 * np.pi)
    turns = rotation_about(constant(about_y[:, None] * np.array([0.0, 1.0, 0.0])))
    return Motion(turns, constant(middle + position))


def _section(link: Link, tube: Tube, course: Course, poisson_ratio: float) -> FibreSection:
    """Compute the sections: two walls as wide as the tube's wall there, joined beyond the lumen."""
    outer = np.sqrt(tube.outer_radius**2 - course.along**2)
    inner = np.sqrt(np.maximum(tube.inner_radius**2 - course.along**2, 0.0))
    middle = 0.5 * (outer + inner)
    walls = two_walls(outer - inner, course.thickness, middle)
    torsion = clamped_torsion_constant(walls, middle, link.length, poisson_ratio)
    return about_neutral_axis(walls, torsion)


@section_fibres.register
def _(notch: ULink, tube: Tube) -> FibresAt:
    del notch, tube
    return two_walls_fibres


@validity_warnings.register
def _(notch: ULink, tube: Tube, site: Site) -> list[str]:
    del site
    if not notch.has_elastic_ends:  # a model of a paper
        return []
    thickness, length = notch.strip_thickness, notch.strip_length
    ranges = [
        CheckedRange("strip length / strip thickness", length / thickness, 1.7, 5.8),
        CheckedRange("strip length / outer diameter", length / tube.outer_diameter, 0.2, 0.5),
        CheckedRange("slot radius / strip thickness", notch.slot_radius / thickness, 0.2, 0.8),
    ]
    return left_ranges([*wall_ranges(thickness, tube), *ranges])
