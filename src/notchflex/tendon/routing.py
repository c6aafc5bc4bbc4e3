"""From the tendons of a robot file to the groups that the chain walks with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant
from notchflex.flexure import Rod, fibre_stretch
from notchflex.motion import Motion
from notchflex.robot import Tendon
from notchflex.tendon.crossing import TendonGroup
from notchflex.tendon.straight import Straight
from notchflex.tendon.wall_arc import WallArc


def route(
    tendons: Sequence[Tendon],
    rods: Rod,
    free: Motion,
    body_length: Float[Array, " bodies"],
) -> tuple[TendonGroup, ...]:
    """Group the tendons by the way they run and lay them through the chain.

    Args:
        tendons: Descriptions, base to tip end bodies counted from 1.
        rods: All flexures of the chain.
        free: Relative poses of all flexures in the free robot.
        body_length: Axial length of the rigid pieces, base first, mm.

    Returns:
        One group per kind of path in use.
    """
    groups = []
    for path, lay in _LAYING.items():
        numbers = tuple(i for i, tendon in enumerate(tendons) if tendon.path == path)
        if numbers:
            chosen = [tendons[i] for i in numbers]
            groups.append(lay(numbers, chosen, rods, free, body_length))
    return tuple(groups)


def _masks(
    numbers: tuple[int, ...], tendons: Sequence[Tendon], bodies: Float[Array, " bodies"]
) -> dict[str, Any]:
    """Where each tendon is: flexures as rows, tendons as columns."""
    count = bodies.shape[0] - 1
    end = np.array([tendon.end_body or count for tendon in tendons])
    body = np.arange(1, count + 1)[:, None]
    present = (body <= end).astype(float)
    return {
        "numbers": numbers,
        "present": present,
        "visits": present,
        "ends": (body == end).astype(float),
        "body_length": present * bodies[1:, None],
    }


def _on_tube(tendons: Sequence[Tendon]) -> Float[Array, "t 3"]:
    """Where the tendons cross a section of the tube, mm from its axis."""
    radius = np.array([tendon.radius for tendon in tendons], float)
    direction = np.deg2rad(np.array([tendon.direction_deg for tendon in tendons], float))
    return constant(
        np.stack([radius * np.cos(direction), radius * np.sin(direction), 0.0 * radius], axis=-1)
    )


def _lay_wall_arc(
    numbers: tuple[int, ...],
    tendons: Sequence[Tendon],
    rods: Rod,
    free: Motion,
    body_length: Float[Array, " bodies"],
) -> WallArc:
    del free
    across = (
        np.einsum("nab,tb->nta", rods.end_rotation, _on_tube(tendons)) + rods.end_offset[:, None]
    )[..., :2]
    return WallArc(
        **_masks(numbers, tendons, body_length),
        natural_gap=np.einsum(
            "ntc,nic,ni->nt", fibre_stretch(across), rods.reference_strain, rods.length
        ),
        across=across,
    )


def _lay_straight(
    numbers: tuple[int, ...],
    tendons: Sequence[Tendon],
    rods: Rod,
    free: Motion,
    body_length: Float[Array, " bodies"],
) -> Straight:
    del rods
    place = _on_tube(tendons)
    count = body_length.shape[0] - 1
    channel = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (count, *place.shape))
    entry = np.broadcast_to(place, channel.shape)
    leaves = place + channel * body_length[:-1, None, None]
    arrives = np.einsum("nab,tb->nta", free.rotation, place) + free.translation[:, None]
    return Straight(
        **_masks(numbers, tendons, body_length),
        natural_gap=np.linalg.norm(arrives - leaves, axis=-1),
        entry=constant(entry),
        exit=constant(entry + channel * body_length[1:, None, None]),
        channel=constant(channel),
        base_exit=constant(entry + channel * body_length[0]),
        base_channel=constant(channel),
    )


_LAYING: dict[str, Callable[..., TendonGroup]] = {
    "wall-arc": _lay_wall_arc,
    "straight": _lay_straight,
}
