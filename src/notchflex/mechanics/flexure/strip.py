"""The strip of a triangular-notched robot: a straight beam across the tube (Liu 2022).

Two opposite notches leave a strip of the tube's two walls across its axis. It is clamped at one
wall, in the proximal body, and at the opposite wall, where the pulled cable passes, its free end
carries the distal body. In the plane of bending it neither stretches nor shears, as in the paper
(eq. 8-18); the curvature is a polynomial along it. Sideways it bends about its strong axis and
twists, with its ends held against warping.

Shear is left out sideways too. There two walls that the lumen parts give way like a frame, so that
this strip is too stiff against sideways forces, though not against sideways moments and torques.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import ArrayLike

from notchflex._jax import constant, jax
from notchflex.mechanics.flexure.quadrature import RodQuadrature
from notchflex.mechanics.flexure.registry import rod
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.material import FibreSection
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.section import clamped_torsion_constant, two_walls
from notchflex.robot import StripNotch, Tube

# Polynomials of the sideways curvature and of the twist.
_SIDEWAYS, _TWIST = 3, 2
# Rod frame on the notch's: z along the strip toward the bend, x toward the base, y as it is.
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


@rod.register
def _(notch: StripNotch, tube: Tube, refinement: int = 0) -> Rod:
    return strip_rod(notch, tube, 5 + refinement, 10 + 3 * refinement, refinement)


def strip_rod(
    notch: StripNotch,
    tube: Tube,
    bending_modes: int = 5,
    nodes: int = 10,
    more_sideways: int = 0,
) -> Rod:
    """Build the rod of a strip.

    Args:
        notch: The notch.
        tube: The tube that it is cut into.
        bending_modes: Legendre polynomials of the curvature in the plane of bending.
        nodes: Gauss's nodes along the strip.
        more_sideways: Polynomials of sideways bending and of twist beyond the usual ones.

    Returns:
        The rod, from the clamp to the free end.

    Example:
        >>> strip_rod(StripNotch(height=3.5, strip_thickness=1.5, depth=6.9), Tube(10, 6)).levels
        (5, 5, 10)
    """
    length = notch.strip_length_in(tube)
    places = RodQuadrature((0.0, length), (nodes,), (nodes,))
    basis = _modes(2.0 * places.every / length - 1.0, bending_modes, more_sideways) / length
    along = Motion(
        constant(np.tile(np.eye(3), (len(places.every), 1, 1))),
        constant(places.every[:, None] * np.array([0.0, 0.0, 1.0])),
    )
    turned = rotation_about(constant([0.0, 0.0, np.radians(notch.direction_deg)]))
    return Rod(
        start_rotation=constant(turned @ _LYING),
        start_offset=constant(turned @ np.array([-0.5 * length, 0.0, notch.height])),
        curve_rotation=constant(np.eye(3)),
        curve_offset=constant([0.0, 0.0, length]),
        end_rotation=constant((turned @ _LYING).T),
        end_offset=constant([0.0, 0.0, -0.5 * length]),
        **places.fields(along, basis),
        reference_strain=constant(np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (nodes, 1))),
        section=_section(notch, tube, nodes),
        closure=constant(np.zeros(2)),
        has_closure=constant(0.0),
        linear_kinematics=constant(float(notch.deflection == "small")),
        chord=constant(1.0),
        padding_mask=constant(np.zeros(basis.shape[-1])),
        levels=(bending_modes, bending_modes, basis.shape[-1]),
    )


def _modes(place: np.ndarray, bending_modes: int, more_sideways: int) -> np.ndarray:
    """Strain per mode times the length, at places from -1 to 1: (nodes, 6, modes)."""
    sideways, twist = _SIDEWAYS + more_sideways, _TWIST + more_sideways
    modes = np.zeros((len(place), 6, bending_modes + sideways + twist))
    first = 0
    for component, count in ((1, bending_modes), (0, sideways), (2, twist)):
        modes[:, component, first : first + count] = legvander(place, count - 1)
        first += count
    return modes


def _section(notch: StripNotch, tube: Tube, nodes: int) -> FibreSection:
    """Both walls, their middles where the wall of the tube has its own; alike at all nodes."""
    middle = 0.5 * (tube.outer_radius + tube.inner_radius)
    walls = two_walls(0.5 * notch.wall_width_in(tube), notch.strip_thickness, middle)
    torsion = clamped_torsion_constant(walls, middle, notch.strip_length_in(tube))

    def at_all(value: ArrayLike) -> jax.Array:
        return constant(np.full(nodes, value))

    return FibreSection(
        area=at_all(walls.area),
        second_moment_weak=at_all(walls.second_moment_weak),
        second_moment_strong=at_all(walls.second_moment_strong),
        torsion_constant=at_all(torsion),
        shear_centre=at_all(walls.shear_centre),
        edge_spine=at_all(walls.edge_spine),
        edge_near=at_all(walls.edge_near),
    )
