"""From the tendons of a robot file to the groups that the chain walks with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import constant
from notchflex.errors import InputError
from notchflex.mechanics.flexure import Rod, fibre_stretch
from notchflex.mechanics.motion import Motion
from notchflex.mechanics.tendon.crossing import TendonGroup
from notchflex.mechanics.tendon.openings import Passage, passages
from notchflex.mechanics.tendon.straight import Straight
from notchflex.mechanics.tendon.wall_arc import WallArc
from notchflex.robot import Tendon
from notchflex.robot.kinds import Notch

_PULLS = {"straight": "gap", "straight-dead": "dead", "straight-follower": "follower"}


class RoutingContext(NamedTuple):
    """What tendons are laid through.

    Attributes:
        notches: Every notch, base to tip.
        outer_radius: Outer radius of the tube, mm.
        rods: All flexures of the chain.
        free: Relative poses of all flexures in the free robot.
        body_length: Length of the rigid pieces on the tube axis, base first, mm.
        turns_with_chord: Whether tendons turn with the chords of the flexures.
    """

    notches: Sequence[Notch]
    outer_radius: float
    rods: Rod
    free: Motion
    body_length: Float[Array, " bodies"]
    turns_with_chord: bool


class RoutedTendons(NamedTuple):
    """Tendons laid through a robot.

    Attributes:
        groups: One group per kind of path in use.
        place: Where every tendon crosses a section of the tube, mm from its axis.
        base_length: Length of every tendon inside the base, mm.
    """

    groups: tuple[TendonGroup, ...]
    place: Float[Array, "t 3"]
    base_length: Float[Array, " t"]


def route(tendons: Sequence[Tendon], ground: RoutingContext) -> RoutedTendons:
    """Group the tendons by the way they run and lay them through the chain.

    Raises:
        InputError: A tendon ends in a body that has no wall on its side.
    """
    line = passages(
        ground.notches,
        ground.body_length,
        [tendon.direction_deg for tendon in tendons],
        ground.outer_radius,
        [tendon.radius for tendon in tendons],
    )
    groups: list[TendonGroup] = []
    for path in ("wall-arc", *_PULLS):
        numbers = tuple(i for i, tendon in enumerate(tendons) if tendon.path == path)
        if numbers:
            chosen = [tendons[i] for i in numbers]
            some: Any = (values[..., np.array(numbers)] for values in line)
            own = Passage(*some)
            masks = _masks(numbers, chosen, own)
            lay = _wall_arc if path == "wall-arc" else _straight
            groups.append(lay(masks, chosen, own, ground, path))
    return RoutedTendons(tuple(groups), _on_tube(tendons), constant(line.base_leaves))


def _masks(numbers: tuple[int, ...], tendons: Sequence[Tendon], line: Passage) -> dict[str, Any]:
    """Where each tendon is: flexures as rows, tendons as columns."""
    count = line.visits.shape[0]
    end = xp.array([tendon.end_body or count for tendon in tendons])
    body = xp.arange(1, count + 1)[:, None]
    present = (body <= end).astype(float)
    visits = present * line.visits
    ends = (body == end).astype(float)
    for column, number in enumerate(numbers):
        if not (ends * visits)[:, column].any():
            on_its_side = ", ".join(str(j + 1) for j in xp.flatnonzero(line.visits[:, column]))
            raise InputError.UNSUPPORTED(
                f"tendon[{number + 1}].end_body has no wall on the tendon's side; "
                f"the bodies there are {on_its_side}"
            )
    return {
        "numbers": numbers,
        "present": present,
        "visits": visits,
        "ends": ends,
        "back": xp.where(visits > 0.0, line.back, 1),
        # A cable may end at an edge beyond the axial length of the last piece.
        "body_length": visits * xp.maximum(line.leaves - line.enters, 0.0),
    }


def _on_tube(tendons: Sequence[Tendon]) -> Float[Array, "t 3"]:
    """Where the tendons cross a section of the tube, mm from its axis."""
    radius = xp.array([tendon.radius for tendon in tendons], float)
    direction = xp.deg2rad(xp.array([tendon.direction_deg for tendon in tendons], float))
    return constant(
        xp.stack([radius * xp.cos(direction), radius * xp.sin(direction), 0.0 * radius], axis=-1)
    )


def _wall_arc(
    masks: dict[str, Any],
    tendons: Sequence[Tendon],
    line: Passage,
    ground: RoutingContext,
    path: str,
) -> WallArc:
    del line, path
    rods = ground.rods
    across = (
        xp.einsum("nab,tb->nta", rods.end_rotation, _on_tube(tendons)) + rods.end_offset[:, None]
    )[..., :2]
    return WallArc(
        **masks,
        natural_gap=xp.einsum(
            "ntc,nic,ni->nt", fibre_stretch(across), rods.reference_strain, rods.length
        ),
        across=across,
    )


def _straight(
    masks: dict[str, Any],
    tendons: Sequence[Tendon],
    line: Passage,
    ground: RoutingContext,
    path: str,
) -> Straight:
    along = xp.array([0.0, 0.0, 1.0])
    place = xp.asarray(_on_tube(tendons))
    entry = place + line.enters[..., None] * along
    leave = place + line.leaves[..., None] * along
    # Every straight span in the free robot; 0 where a tendon passes by.
    point, across = place + xp.asarray(line.base_leaves)[:, None] * along, list[Any]()
    spans = zip(masks["visits"], entry, leave, *ground.free, strict=True)
    for visits, enters, leaves, rotation, translation in spans:
        point = (point - translation) @ rotation
        across.append(enters - point)
        point = xp.where(visits[:, None] > 0.0, leaves, point)
    return Straight(
        **masks,
        natural_gap=constant(masks["visits"] * xp.linalg.norm(xp.stack(across), axis=-1)),
        leaves=constant(place + line.left[..., None] * along),
        enters=constant(entry),
        along=constant(xp.broadcast_to(along, entry.shape)),
        pulls=_PULLS[path],
        turns_with_chord=ground.turns_with_chord,
    )
