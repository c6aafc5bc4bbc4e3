"""A row of flexures that bend in one plane, with what that plane knows of them and no more."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import IN_PLANE, PLANE

_TWISTS = ("reference_strain", "basis")
_TURNS = ("turn", "node_turn")
_POINTS = ("start_offset", "curve_offset", "end_offset", "node_offset")
_ROTATIONS = ("start_rotation", "curve_rotation", "end_rotation", "node_rotation")


def flattened(rods: Rod, frame: Float[np.ndarray, "3 3"]) -> Rod:
    """Rods of space as rods of the plane that their robot stays in.

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
    """The components of points or forces in the plane."""
    return constant(np.asarray(points)[..., IN_PLANE])


def planar_rotations(rotations: Float[Array, "*shape 3 3"]) -> Float[Array, "*shape 2 2"]:
    """What rotations do in the plane."""
    return constant(np.asarray(rotations)[..., IN_PLANE, :][..., IN_PLANE])
