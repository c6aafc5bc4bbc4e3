"""The strip of a triangular-notched robot: a straight beam across the tube (Liu 2022).

Two opposite notches leave a strip of the tube's two walls across its axis. It is clamped at one
wall, in the proximal body; at the opposite wall, where the pulled cable passes, its free end
carries the distal body. In the plane of bending it neither stretches nor shears, as in the paper
(eq. 8-18); the curvature is a polynomial along it. Sideways it bends about its strong axis and
twists, with warping prevented at its ends.

Shear is omitted sideways too. The two walls deform there like a frame, so this strip is too stiff
against sideways forces, though not against sideways moments and torques.
"""

from __future__ import annotations

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.mechanics.ends import Dimension, left_ranges
from notchflex.mechanics.flexure.notch_rod import (
    NeutralAxis,
    RodQuadrature,
    about_neutral_axis,
    build_rod,
    legendre_modes,
)
from notchflex.mechanics.flexure.rod import Rod, Site, rod, validity_warnings
from notchflex.mechanics.flexure.roots import (
    STRIP_UNCHECKED,
    rooted_strip_rod,
    sharp_strip,
    wall_ranges,
)
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from notchflex.robot import StripNotch, Tube

# Rod frame in the notch's frame: z along the strip toward the bend, x toward the base, same y.
_LYING = xp.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


@rod.register
def _(notch: StripNotch, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    if site is not None:
        return rooted_strip_rod(
            sharp_strip(notch, tube),
            tube,
            notch.height + notch.rise,
            refinement,
            site.poisson_ratio,
            direction_deg=notch.direction_deg,
            linear_kinematics=notch.deflection == "small",
        )
    return strip_rod(notch, tube, 5 + refinement, 10 + 3 * refinement, refinement)


def strip_rod(
    notch: StripNotch,
    tube: Tube,
    bending_modes: int = 5,
    nodes: int = 10,
    more_sideways: int = 0,
) -> Rod:
    """Build the rod of a strip."""
    length = notch.strip_length_in(tube)
    points = RodQuadrature((0.0, length), (nodes,), (nodes,))
    modes = legendre_modes(points, bending_modes, 3 + more_sideways, 2 + more_sideways)
    along = xp.append(points.positions, length)
    axis = NeutralAxis(
        points,
        start=Motion(constant(_LYING), constant([-0.5 * length, 0.0, notch.height])),
        end=Motion(constant(_LYING.T), constant([0.0, 0.0, -0.5 * length])),
        curve=Motion(
            xp.tile(xp.eye(3), (len(along), 1, 1)), along[:, None] * xp.array([0.0, 0.0, 1.0])
        ),
    )
    # Both walls, their middles where the wall of the tube has its own.
    middle = 0.5 * (tube.outer_radius + tube.inner_radius)
    walls = two_walls(0.5 * notch.wall_width_in(tube), notch.strip_thickness, middle)
    return build_rod(
        axis,
        about_neutral_axis(walls, clamped_torsion_constant(walls, middle, length)),
        modes,
        direction_deg=notch.direction_deg,
        linear_kinematics=notch.deflection == "small",
        has_chord=True,
    )


@validity_warnings.register
def _(notch: StripNotch, tube: Tube, site: Site) -> list[str]:
    thickness, outer = notch.strip_thickness, tube.outer_diameter
    overlap = 2.0 * notch.depth - outer
    slanting = (
        "the body between two pairs is a slanting bar, which bends too; pairs that adjoin were "
        "found 2.1 times as flexible"
    )
    thick = "with 0.27 the strip was found up to 11 % too stiff, 25 % sideways"
    ratio, what = notch.uncut_length / notch.height, STRIP_UNCHECKED
    ranges: list[Dimension] = [
        ("strip thickness / outer diameter", thickness / outer, [(0.07, 0.22, thick)]),
        ("overlap of the cuts / outer diameter", overlap / outer, [(0.24, 0.54, what)]),
        ("height / outer diameter", notch.height / outer, [(0.2, 0.5, what)]),
        ("uncut length / height", ratio, [(0.7, float("inf"), slanting)]),
    ]
    return left_ranges(wall_ranges(thickness, tube) + ranges)
