"""Discretised flexure: a short rod along the neutral axis of a notch with a few strain modes.

The strain of node k is `reference_strain[k] + basis[k] @ q`; strains are (curvature about x, y, z
of the rod, shear along x, y, stretch along z), the stretch being 1 without strain.

The pose is integrated relative to a reference curve r(s): the free rod itself, so that only the
change by the load is integrated, or a point. With the pose g(s) r(s), g follows the twist
Ad_r (strain - strain of the curve). That twist is linear in (1, q); only its rotations up to
Gauss's nodes and its steps at them are stored (`rod_kinematics.py`).
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import constant
from notchflex._pytree import Pytree, static
from notchflex.mechanics.material.fibre_section import FibreSection
from notchflex.mechanics.motion import IN_PLANE, PLANE

_TWISTS = ("reference_strain", "basis")
_TURNS = ("turn", "node_turn")
_POINTS = ("start_offset", "curve_offset", "end_offset", "node_offset")
_ROTATIONS = ("start_rotation", "curve_rotation", "end_rotation", "node_rotation")


class Rod(Pytree):
    """One flexure, or with a leading axis all flexures of a chain. Units mm, rad.

    Attributes:
        start_rotation: Rotation from the rod's first section to the proximal body.
        start_offset: Start of the rod, in the frame of the proximal body: for a single notch from
            its proximal face on the tube axis; the chain adds the body's length.
        curve_rotation: Rotation from the end of the reference curve to its start.
        curve_offset: End of that curve, in the frame of its start.
        end_rotation: Rotation from the distal body to the rod's last section.
        end_offset: Origin of the distal body's frame, in the frame of the rod's last section.
        length: Quadrature weight of each node along the neutral axis.
        reference_strain: Strain at each node of the free, cut tube.
        basis: Strain at each node for a unit of each mode.
        turn: Integral of the rotation relative to the curve, from the rod's start to each of
            Gauss's nodes and, last, to its end, for (1, q): in the frame of the rod's start.
        turn_pair: Second Magnus term between neighbouring ones of these points, for pairs of
            (1, q); None in the plane, where rotations commute.
        step: Step relative to the curve of each of Gauss's nodes, for (1, q).
        node_turn: As `turn`, to each node of the strains.
        node_index: Number of points of the rotation before each node of the strains.
        node_reach: Fraction of each step before each node of the strains, 0 to 1.
        node_rotation: Rotation from the reference curve at each node to its start.
        node_offset: Position of the reference curve at each node, in the frame of its start.
        section: Cross-section at each node.
        closure: Position (x, y) from the neutral axis of the fibre between the edges of a notch
            with a solid spine: its length is zero when they touch.
        has_closure: 1 where there is such a fibre, 0 where the notch closes otherwise.
        stop_flexibility: Flexibility of the closed notch over that of the open one; 0 is a rigid
            stop, None where all are rigid.
        linear_kinematics: 1 where displacements are proportional to the strains (small deflection);
            None where no flexure of a chain uses it.
        chord: 1 where the angle of the chord from start to end is computed (Liu 2022); None
            likewise.
        padding_mask: 1 for modes that only pad the arrays, because another notch has more.
        levels: Numbers of modes for tendons alone, loads in the plane of bending, and in space.
    """

    start_rotation: Float[Array, "*n d d"]
    start_offset: Float[Array, "*n d"]
    curve_rotation: Float[Array, "*n d d"]
    curve_offset: Float[Array, "*n d"]
    end_rotation: Float[Array, "*n d d"]
    end_offset: Float[Array, "*n d"]
    length: Float[Array, "*n nodes"]
    reference_strain: Float[Array, "*n nodes w"]
    basis: Float[Array, "*n nodes w modes"]
    turn: Float[Array, "*n places a hat"]
    turn_pair: Float[Array, "*n places 3 hat hat"] | None
    step: Float[Array, "*n gauss d hat"]
    node_turn: Float[Array, "*n nodes a hat"]
    node_index: Int[Array, "*n nodes"]
    node_reach: Float[Array, "*n nodes gauss"]
    node_rotation: Float[Array, "*n nodes d d"]
    node_offset: Float[Array, "*n nodes d"]
    section: FibreSection
    closure: Float[Array, "*n 2"]
    has_closure: Float[Array, "*n"]
    stop_flexibility: Float[Array, "*n"] | None
    linear_kinematics: Float[Array, "*n"] | None
    chord: Float[Array, "*n"] | None
    padding_mask: Float[Array, "*n modes"]
    levels: tuple[int, int, int] = static()

    @property
    def modes(self) -> int:
        """Number of strain modes of a flexure."""
        return self.basis.shape[-1]


def flattened(rods: Rod, frame: Float[np.ndarray, "3 3"]) -> Rod:
    """Reduce spatial rods to the plane that their robot stays in.

    Args:
        rods: All flexures of a chain, with no modes that leave the plane.
        frame: Rotation from a frame whose x and z span the plane to that of the bodies.

    Returns:
        The rods with twists of three components and points of two, in that frame.
    """
    turned = {
        "start_rotation": frame.T @ rods.start_rotation,
        "start_offset": rods.start_offset @ frame,
        "end_rotation": rods.end_rotation @ frame,
    }

    def own(name: str) -> Array:
        return constant(turned[name]) if name in turned else getattr(rods, name)

    kept = {name: constant(getattr(rods, name)[:, :, PLANE]) for name in _TWISTS}
    kept |= {name: constant(getattr(rods, name)[:, :, 1:2]) for name in _TURNS}
    kept["step"] = constant(rods.step[:, :, IN_PLANE])
    kept |= {name: planar_points(own(name)) for name in _POINTS}
    kept |= {name: planar_rotations(own(name)) for name in _ROTATIONS}
    return dataclasses.replace(rods, **kept, turn_pair=None)


def planar_points(points: Float[Array, "*shape 3"]) -> Float[Array, "*shape 2"]:
    """Return the components of points or forces in the plane."""
    return constant(np.asarray(points)[..., IN_PLANE])


def planar_rotations(rotations: Float[Array, "*shape 3 3"]) -> Float[Array, "*shape 2 2"]:
    """Return the components of rotations in the plane."""
    return constant(np.asarray(rotations)[..., IN_PLANE, :][..., IN_PLANE])
