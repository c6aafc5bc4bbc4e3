"""Tendons: their way through the bodies, with lengths, turning angles and pulls."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._arrays import xp
from notchflex._jax import Pytree, constant, jax, jnp, static
from notchflex.errors import InputError
from notchflex.mechanics.flexure import FlexureState, Rod, fibre_slope, fibre_stretch, of_rod
from notchflex.mechanics.motion import Motion, moment_of, wrench_at
from notchflex.robot import Tendon
from notchflex.robot.kinds import Notch, openings_along

# How a group of tendons crosses one gap: its way as a function of where the two bodies are.
#
# A span leads from the body that the tendon visited last, its anchor, to the next one that it
# visits. All that it does depends on the pose of the one seen from the other (or, along the wall of
# a bent notch, on that notch's strains alone); tension, friction and balance are the chain's
# business.


OfTendons = Float[Array, " t"]
PerTendon = Float[Array, "*n t"]
Points = Float[Array, "*n t d"]
Vectors = Float[Array, "*s d"]


class Crossing(NamedTuple):
    """A group of t tendons or contacts over one gap (mm, rad)."""

    length: OfTendons  # Length of the way across the gap; of a contact its gap, >= 0 if solved
    # Moment and force on the distal body per unit of a force that lengthens the way, about and
    # along its frame; its opposite acts on the anchor. None for a group that does not act on bodies
    wrench: Float[Array, "t w"] | None
    # Change of the length per unit of mode; None for a group that acts on bodies
    slope: Float[Array, "t modes"] | None
    # Turning angle of a tendon at the edge of the body before, and of the distal body, >= 0
    turning: Any = None

    @property
    def gap(self) -> OfTendons:
        """Gap of a contact."""
        return self.length


class CrossingGroup(Pytree, ABC):
    """Tendons or contacts of one kind: each leads from an anchor, a body before, to a body."""

    # Arrays carry the flexures as leading axis, then the tendons.

    # Whether its pull is a force on the bodies (and poses are needed), or acts on the modes of each
    # flexure alone
    acts_on_bodies: ClassVar[bool]
    # How many bodies before the distal one its anchor is, 1 where it skips none
    back: Int[Array, "*n t"]

    @property
    def fibre(self) -> Float[Array, "*n t 2"] | None:
        """Where it crosses a rod's section, mm from its neutral axis; None where it does not."""
        return None

    @abstractmethod
    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Cross one gap (of a group without its leading axis)."""


class AlongFibres(CrossingGroup):
    """Those that run along a rod, as fibres of it."""

    acts_on_bodies = False

    natural_gap: PerTendon  # Length of its way across the gap in the free robot
    across: Float[Array, "*n t 2"]  # Where it crosses the rod's section, from the neutral axis, mm

    @property
    def fibre(self) -> Float[Array, "*n t 2"]:
        """Where it crosses a rod's section, mm from its neutral axis."""
        return self.across

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Return the length of the fibres."""
        weights = of_rod(rod, fibre_stretch(self.across))
        length = self.natural_gap + (rod.length @ flexure.strain) @ weights.T
        return Crossing(length, wrench=None, slope=fibre_slope(rod, weights))


def fibre_lengths(
    rods: Rod, across: Float[Array, "n t 2"], strain: Float[Array, "n nodes w"]
) -> Float[Array, "n t"]:
    """Return the lengths that fibres have by the strains of their rods, mm."""
    weights = of_rod(rods, fibre_stretch(xp.asarray(across)))
    return xp.einsum("ntc,nic,ni->nt", weights, strain, rods.length)


class TendonGroup(CrossingGroup):
    """Tendons of one kind of path."""

    numbers: tuple[int, ...] = static()  # Which tendons of the robot these are, from 0
    present: PerTendon  # 1 where the tendon crosses this gap
    visits: PerTendon  # 1 where it passes through (or ends in) the distal body
    ends: PerTendon  # 1 where it is fixed in the distal body
    body_length: PerTendon  # Length of tendon inside the distal body
    natural_gap: PerTendon  # Length of its way across the gap in the free robot

    @property
    def by_modes(self) -> bool:
        """Whether the way depends on the modes of the flexure, beside the bodies' poses."""
        return not self.acts_on_bodies

    @property
    def runs(self) -> PerTendon:
        """1 where the tendon has a span that ends at the distal body."""
        return self.visits


def guarded_norm(
    vector: Vectors,
    slope: Vectors | None = None,
    rounding: float = 0.0,
) -> Float[Array, "*s"]:
    """Return the length of vectors, with a stated derivative where it is 0."""
    squared = jnp.sum(vector * vector, axis=-1)
    zero = squared == 0.0
    length = jnp.where(zero, 0.0, jnp.sqrt(jnp.where(zero, 1.0, squared)))
    if slope is None:
        return length
    along, stop = jnp.sum(vector * slope, axis=-1), jax.lax.stop_gradient
    return jnp.where(squared <= rounding**2, stop(length) + (along - stop(along)), length)


def direction(vector: Vectors) -> Vectors:
    """Return unit vectors; 0 for vectors that are 0."""
    length = guarded_norm(vector)
    return vector / jnp.where(length == 0.0, 1.0, length)[..., None]


# Direction of the tube, in the frames of its bodies.
TUBE_AXIS = xp.array([0.0, 0.0, 1.0])

# A tendon pulled straight from the edge of one body to the edge of the next it visits.
#
# It may skip bodies. The pull between two bodies is a force along the straight span on each of
# them; cutting beam and tendon in a gap shows that contact forces need not be summed
# (physics of both Gao 2017 and Liu 2022).
#
# Liu 2022 also reads the pull as a dead load or a follower: it then stands along the channel of
# the proximal or the distal body, on the same point, while the way and its turning stay as they
# are. That is a reading of a paper; it is not a tendon whose work is tension times length.


class Straight(TendonGroup):
    """Tendons straight across the gaps."""

    acts_on_bodies = True

    leaves: Points  # Where the tendon leaves its anchor, in the anchor's frame, mm
    enters: Points  # Where it enters the distal body, in that body's frame, mm
    along: Points  # Unit direction of its channels, in the frames of the bodies
    # That of the channel it leaves, in the anchor's frame; None where all have one direction
    along_left: Points | None
    # Along what it pulls: the "gap", or the channel of the body before ("dead") or behind
    # ("follower")
    pulls: str = static()
    # Whether it turns at the distal body by the turn of the flexure's chord rather than that of the
    # body (the reading of Liu 2022), behind a strip; other notches have no chord
    turns_with_chord: bool = static()

    @property
    def by_modes(self) -> bool:
        """Only where the chord of the flexure tells how the tendon turns."""
        return self.turns_with_chord

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Straight span from the anchor to the entry of the distal body."""
        assert anchors is not None  # acts_on_bodies asks for it
        chord = rod.chord if self.turns_with_chord else None

        def span(anchor: Motion, leaves: Array, enters: Array, channel: Array, left: Any) -> Any:
            reach = enters - anchor.point_inside(leaves)
            length = guarded_norm(reach)
            gap = reach * (1.0 / jnp.where(length == 0.0, 1.0, length))
            before = (channel if left is None else left) @ anchor.rotation
            onward = channel
            if chord is not None:
                pose, turn = flexure.pose, flexure.chord_turn
                assert pose is not None
                assert turn is not None
                goes_on = (turn @ (pose.rotation @ before)) @ pose.rotation
                onward = jnp.where(chord > 0.0, goes_on, channel)
            pulled = {"gap": gap, "dead": before, "follower": channel}[self.pulls]
            # A pull turns the distal body toward the tendon's side.
            axis = direction(moment_of(channel, enters))
            turns = turning(before, gap, axis), turning(gap, onward, axis)
            return length, wrench_at(enters, pulled), jnp.stack(turns)

        points = self.leaves, self.enters, self.along, self.along_left
        length, wrench, turns = jax.vmap(span)(anchors, *points)
        return Crossing(length, wrench, slope=None, turning=turns)


def turning(before: Vectors, after: Vectors, axis: Float[Array, " a"]) -> Float[Array, ""]:
    """Return the angle between two unit directions, exact for small angles."""
    # A straight tendon turns with any rotation, to whichever side; its slope here is that of the
    # rotation that its own pull causes. With it the first step from rest knows the friction. A span
    # without length has no direction (its vector is 0) and turns nothing, with slope 0.
    across, cosine = moment_of(before, after), jnp.sum(before * after)
    nowhere = jnp.all(across == 0.0) & (cosine == 0.0)
    # Products of unit vectors that are parallel are off 0 by less than 1e-15.
    sine = guarded_norm(across, jnp.where(nowhere, 0.0, axis), 1e-15)
    return jnp.atan2(sine, jnp.where(nowhere, 1.0, cosine))


# A tendon that follows the wall of the bent tube: Pacheco's l = h - theta (r_i + ybar).
#
# Across a gap it lies on the arc concentric with the neutral axis, so its length and turning are
# functions of that notch's own modes. It follows the wall over every notch up to its end body,
# whichever way the notch faces.


class WallArc(AlongFibres, TendonGroup):
    """Tendons along the wall."""

    @property
    def runs(self) -> PerTendon:
        """Over every notch up to its end."""
        return self.present

    def cross(self, rod: Rod, flexure: FlexureState, anchors: Motion | None) -> Crossing:
        """Return the length and turning on the wall arc; half the turning at each edge."""
        bend = jnp.broadcast_to(flexure.bend, (len(self.across), len(flexure.bend)))
        # Unit axes about which the tendons bend the rod: the slope of the turning at rest.
        x, y = self.across[:, 0], self.across[:, 1]
        pulls = direction(jnp.stack([x] if bend.shape[1] == 1 else [-y, x], axis=-1))
        half_turning = 0.5 * guarded_norm(bend, pulls)
        turning = jnp.stack([half_turning, half_turning], axis=-1)
        return super().cross(rod, flexure, anchors)._replace(turning=turning)


# Where a line along the wall leaves one rigid piece of the tube and enters the next.
#
# A tendon is such a line, and so are the edges of the notches. What a notch opens, on which side,
# its description knows (`Notch.openings`).


class Passage(NamedTuple):
    """One line along the wall over n flexures (mm, in the frames of the bodies behind them)."""

    visits: Float[Array, " n"]  # 1 where the body behind the flexure has wall on that side
    on_side: Float[Array, " n"]  # 1 where the opening is on that very side, not all round
    # How many bodies before that one it visited the last one, its anchor; 1 where it does not visit
    back: Int[Array, " n"]
    left: Float[Array, " n"]  # Where it left the anchor, along the tube in the anchor's frame
    enters: Float[Array, " n"]  # Where the line enters that body, along the tube
    leaves: Float[Array, " n"]  # Where it leaves that body again
    base_leaves: Float[Array, ""]  # Where it leaves the base


def passage(
    notches: Sequence[Notch],
    body_length: Float[Array, " bodies"],
    direction_deg: float,
    outer_radius: float = 0.0,
    radius: float | None = None,
) -> Passage:
    """Follow a line along the wall."""
    count = len(notches)
    visits, on_side, back = xp.zeros(count), xp.zeros(count), xp.ones(count, int)
    left: list[Any] = [0.0] * count
    enters: list[Any] = [0.0] * count
    leaves, last = list(body_length), 0
    for body, opening in openings_along(notches, direction_deg):
        inside = 0.0
        if radius is not None:
            inside = opening.inside(direction_deg, outer_radius, radius)
        visits[body - 1] = 1.0
        enters[body - 1] = opening.enters + inside * opening.enters_rise
        on_side[body - 1] = opening.faces(direction_deg)
        leaves[last] += opening.leaves + inside * opening.leaves_rise
        back[body - 1], left[body - 1] = body - last, leaves[last]
        last = body
    along = map(constant, (left, enters, leaves[1:], leaves[0]))
    return Passage(visits, on_side, back, *along)


def passages(
    notches: Sequence[Notch],
    body_length: Float[Array, " bodies"],
    directions_deg: Sequence[float],
    outer_radius: float = 0.0,
    radii: Sequence[float] | None = None,
) -> Passage:
    """Follow several lines; they are the last axis."""
    distances = [None] * len(directions_deg) if radii is None else radii
    lines = [
        passage(notches, body_length, direction, outer_radius, radius)
        for direction, radius in zip(directions_deg, distances, strict=True)
    ]
    return Passage(*(xp.stack(values, axis=-1) for values in zip(*lines, strict=True)))


# From the tendons of a robot file to the groups that the chain walks with.

_PULLS = {"straight": "gap", "straight-dead": "dead", "straight-follower": "follower"}


def route(
    tendons: Sequence[Tendon],
    notches: Sequence[Notch],
    outer_radius: float,
    rods: Rod,
    free: Motion,
    body_length: Float[Array, " bodies"],
    *,
    turns_with_chord: bool,
) -> tuple[tuple[TendonGroup, ...], Float[Array, "t 3"], OfTendons]:
    """Group the tendons by the way they run and lay them through the chain."""
    # `free` holds the relative poses of all flexures in the free robot. Also returned is where each
    # tendon crosses a section of the tube, mm from its axis, and its length in the base, mm.
    directions, radii = zip(*((each.direction_deg, each.radius) for each in tendons), strict=True)
    lines = passages(notches, body_length, directions, outer_radius, radii)
    place = on_tube(radii, directions)
    holes = holes_of(tendons, place, rods, body_length)
    groups: list[TendonGroup] = []
    for path in ("wall-arc", *_PULLS):
        numbers = tuple(i for i, tendon in enumerate(tendons) if tendon.path == path)
        if not numbers:
            continue
        columns = np.array(numbers)
        line = Passage(*(values[..., columns] for values in lines))
        masks = _masks(numbers, [tendons[i] for i in numbers], line)
        if path == "wall-arc":
            across = xp.einsum("nab,tb->nta", rods.end_rotation, place[columns])
            across = (across + rods.end_offset[:, None])[..., :2]
            gap = fibre_lengths(rods, across, rods.reference_strain)
            groups.append(WallArc(**masks, natural_gap=gap, across=across))
        else:
            groups.append(
                _straight(
                    masks,
                    place[columns],
                    line,
                    free,
                    holes and Holes(*(part[:, columns] for part in holes)),
                    pulls=_PULLS[path],
                    turns_with_chord=turns_with_chord,
                )
            )
    return tuple(groups), place, lines.base_leaves


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


def on_tube(radii: Any, directions_deg: Any) -> Float[Array, "t 3"]:
    """Return points of a section of the tube by their polar coordinates, mm from its axis."""
    angle = xp.radians(constant(directions_deg))
    return constant(radii)[:, None] * xp.stack([xp.cos(angle), xp.sin(angle), 0.0 * angle], axis=-1)


class Holes(NamedTuple):
    """Holes of tendons through all bodies, base first, in the frames of the bodies."""

    enters: Float[Array, "bodies t 3"]  # Where they begin in a section of the tube, mm
    leaves: Float[Array, "bodies t 3"]  # Where they end in another, mm
    along: Float[Array, "bodies t 3"]  # Their unit directions


def holes_of(
    tendons: Sequence[Tendon], place: Array, rods: Rod, body_length: Array
) -> Holes | None:
    """Lay holes where tendons say for each disk; None where all are parallel to the tube."""
    if all(tendon.holes is None for tendon in tendons):
        return None
    bodies = range(len(body_length))
    middle, ends = xp.stack([place for _ in bodies]), list[int]()
    for number, tendon in enumerate(tendons):
        ends.append(tendon.end_body or bodies[-1])
        if tendon.holes is not None:  # the base has the place, as numbers may be traced
            disks = on_tube(*(xp.array(values[1:]) for values in tendon.holes))
            beyond = xp.broadcast_to(disks[-1], (bodies[-1] - len(disks), 3))
            own = xp.concatenate([place[None, number], disks, beyond])
            middle = xp.where((xp.arange(len(tendons)) == number)[:, None], own[:, None], middle)
    rise = xp.sum(rods.length, axis=-1) + 0.5 * (body_length[1:] + body_length[:-1])
    spans = xp.diff(middle, axis=0) + rise[:, None, None] * TUBE_AXIS
    spans = spans / xp.linalg.norm(spans, axis=-1)[..., None]
    # A hole halves the angle between the spans on both sides of its disk. Where a tendon ends it
    # goes on along the last span; in the base it is parallel to the tube.
    goes_on = (xp.arange(1, len(bodies))[:, None] < xp.array(ends))[..., None]
    both = spans + goes_on * xp.concatenate([spans[1:], spans[-1:]])
    both = xp.concatenate([xp.broadcast_to(TUBE_AXIS, both[:1].shape), both])
    aside = 0.5 * body_length[:, None, None] * (both / both[..., 2:] - TUBE_AXIS)
    along = both / xp.linalg.norm(both, axis=-1)[..., None]
    return Holes(middle - aside, middle + aside, along)


def _straight(
    masks: dict[str, Any],
    place: Array,
    line: Passage,
    free: Motion,
    holes: Holes | None,
    **options: Any,
) -> Straight:
    shape = (len(line.enters) + 1, *place.shape)
    parallel = Holes(*(xp.broadcast_to(part, shape) for part in (place, place, TUBE_AXIS)))
    enters, leaves, along = holes or parallel
    entry = enters[1:] + line.enters[..., None] * TUBE_AXIS
    leave = leaves[1:] + line.leaves[..., None] * TUBE_AXIS
    # Every straight span in the free robot; 0 where a tendon passes by.
    point, across = leaves[0] + line.base_leaves[:, None] * TUBE_AXIS, list[Any]()
    for visits, inward, outward, rotation, translation in zip(
        masks["visits"], entry, leave, *free, strict=True
    ):
        point = (point - translation) @ rotation
        across.append(inward - point)
        point = xp.where(visits[:, None] > 0.0, outward, point)
    # A hole that leans is longer than its disk is thick.
    masks["body_length"] = masks["body_length"] / along[1:, :, 2]
    return Straight(
        **masks,
        **options,
        natural_gap=masks["visits"] * xp.linalg.norm(xp.stack(across), axis=-1),
        # Tendons with holes of their own skip no body.
        leaves=leaves[:-1] + line.left[..., None] * TUBE_AXIS,
        enters=entry,
        along=along[1:],
        along_left=None if holes is None else along[:-1],
    )
