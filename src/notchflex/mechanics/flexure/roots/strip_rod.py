"""Rod of a strip with its roots, from the proximal wall to the distal one."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.flexure.notch_rod import (
    STRAIGHT,
    NeutralAxis,
    StrainModes,
    between,
    build_rod,
    shifted,
)
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.flexure.rod_kinematics import RodQuadrature
from notchflex.mechanics.flexure.roots.rooted_strip import (
    RootedStrip,
    Walls,
    plane_compliance,
    strip_sections,
    turned_compliance,
    with_sideways,
)
from notchflex.mechanics.flexure.wrench_modes import wrench_modes
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.robot import Tube


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


def _course(
    position: Float[np.ndarray, " k"], ends: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
