"""Kinematics of a rod: pose from strains by quadrature, and derivatives of the pose by the modes.

Relative to the reference curve a rod rotates and steps. The rotation up to each of Gauss's nodes is
an integral of the strains, exactly linear in the modes q in the plane; in space it is integrated
from node to node by the Magnus series (up to its second term: Blanes, Casas, Oteo and Ros 2009,
eq. 42). The end is the sum of all steps, each rotated by the rotation at its node.

First and second derivatives of the pose by the modes are written out: derived by JAX they cost ten
times as much, to run and to compile.

A rod consists of pieces on which its strains are smooth. Strains and resultants have their own
nodes, the pose has others, and points between neighbours of these integrate the rotation exactly.
A flexure evaluates its strains at all points (`every`) at once.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import cached, is_traced, xp
from notchflex._jax import (
    constant,
    jax,
    jnp,
)
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.motion import (
    Motion,
    cross,
    left_slope,
    left_slope_change,
    outer_twists,
    rotation_about,
    sine_cosine,
    unskew,
)
from notchflex.mechanics.section import leggauss


class RodConfiguration(NamedTuple):
    """A rod relative to its curve; "places" are the nodes of the pose and then the end."""

    rotation: Float[Array, "places d d"]  # Rotation at every place
    # Change of that rotation per unit of mode, along the axes of the start
    turn: Float[Array, "places a modes"]
    step: Float[Array, "gauss d"]  # The rotated steps at the nodes
    stepped: Float[Array, "gauss d modes"]  # The rotated steps per unit of mode
    # Rotation vectors from place to place, their slopes by the modes, and the change of rotation by
    # these, along the axes of the start; None in the plane, where rotations commute
    from_place: tuple[Array, Array, Array] | None

    @property
    def end(self) -> Motion:
        """Pose of the end."""
        return Motion(self.rotation[-1], self.step.sum(axis=0))


def integrate_rod(rod: Rod, modes: Float[Array, " modes"]) -> RodConfiguration:
    """Integrate the rotations and steps of a rod for given modes."""
    hat = xp.concatenate([xp.ones(1), modes])
    from_place = None
    if rod.turn_pair is None:
        rotation, turn = _in_plane(rod.turn[:, 0] @ hat), rod.turn[..., 1:]
    else:
        turns, slope = _turns(rod, hat)
        rotation = _products(_rotations(turns))
        turning = rotations_before(rotation) @ left_slopes(turns) @ slope
        from_place, turn = (turns, slope, turning), xp.cumsum(turning, axis=0)
    stepped = _stepped(rod, rotation)
    return RodConfiguration(rotation, turn, stepped @ hat, stepped[..., 1:], from_place)


def free_pose(rod: Rod) -> Motion:
    """Return the pose of the distal body in the proximal frame, of a free rod in space."""
    # It equals `relative_pose` without modes, and omits terms that only the derivatives need.
    assert rod.turn_pair is not None
    turns = xp.diff(rod.turn[..., 0], axis=0, prepend=0.0) + rod.turn_pair[..., 0, 0]
    rotation = _products(_rotations(constant(turns)))
    end = Motion(rotation[-1], _stepped(rod, rotation)[..., 0].sum(axis=0))
    return Motion(rod.start_rotation, rod.start_offset).then(end).then(tail_pose(rod))


def _stepped(rod: Rod, rotation: Float[Array, "places d d"]) -> Float[Array, "gauss d hat"]:
    """Rotate the steps at the nodes, for (1, q)."""
    return (rotation[:-1, ..., None] * rod.step[:, None]).sum(axis=-2)


def _in_plane(angle: Float[Array, " places"]) -> Float[Array, "places 2 2"]:
    sine, cosine = sine_cosine(angle)
    return xp.stack([xp.stack([cosine, sine], -1), xp.stack([-sine, cosine], -1)], -2)


def _turns(
    rod: Rod, hat: Float[Array, " hat"]
) -> tuple[Float[Array, "places 3"], Float[Array, "places 3 modes"]]:
    """Compute the rotation vectors from place to place, and their slopes by the modes."""
    parts = xp.concatenate([rod.turn[:1], rod.turn[1:] - rod.turn[:-1]])
    by_pair = _by_pair(rod, hat)
    return (parts + by_pair) @ hat, parts[..., 1:] + 2.0 * by_pair[..., 1:]


def _by_pair(rod: Rod, hat: Float[Array, " hat"]) -> Float[Array, "places 3 hat"]:
    """Compute the second Magnus term from place to place, per unit of (1, modes)."""
    return xp.einsum("kcab,b->kca", rod.turn_pair, hat)


def rotation_error_estimate(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, ""]:
    """Estimate the error of the rotation of a rod's end, rad; 0 in the plane."""
    # The Magnus series is truncated after its second term. The next term is of the size of the
    # rotations from place to place times their second terms; a twentieth of the sum of these was
    # the error for a notch bent by 105 degrees, twisted and sideways (against more places).
    if rod.turn_pair is None:
        return jnp.zeros(())
    hat = jnp.concatenate([jnp.ones(1), modes])
    turns, _ = _turns(rod, hat)
    second = _by_pair(rod, hat) @ hat
    return 0.05 * jnp.sum(jnp.linalg.norm(turns, axis=-1) * jnp.linalg.norm(second, axis=-1))


def _rotations(turns: Float[Array, "places 3"]) -> Float[Array, "places 3 3"]:
    if not is_traced(turns):
        return rotation_about(turns)
    return jax.vmap(rotation_about)(turns)


def left_slopes(turns: Float[Array, "places 3"]) -> Float[Array, "places 3 3"]:
    """Return the left Jacobians of the exponential at rotation vectors."""
    if not is_traced(turns):
        return left_slope(turns)
    return jax.vmap(left_slope)(turns)


def _products(parts: Float[Array, "places 3 3"]) -> Float[Array, "places 3 3"]:
    """Multiply all rotations up to each."""
    return xp.stack(list(accumulate(parts, operator.matmul)))


def rotations_before(values: Float[Array, "places 3 3"]) -> Float[Array, "places 3 3"]:
    """Return the rotation at the place before each; the identity before the first."""
    return xp.concatenate([xp.eye(3)[None], values[:-1]])


def _small_motion(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Compute the end motion of small deflection: displacements proportional to the strains."""
    hat = xp.concatenate([xp.ones(1), modes])
    turn, moved = rod.turn[-1] @ hat, rod.step.sum(axis=0) @ hat
    rotation, end = rotation_about(turn), rod.curve_offset
    return Motion(rotation, end + cross(turn, end) + moved - rotation @ end)


def _end_motion(rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration) -> Motion:
    """Compute the motion from the end of the reference curve to that of the rod."""
    if rod.linear_kinematics is None:
        return own.end
    is_small = rod.linear_kinematics > 0.0
    pairs = zip(_small_motion(rod, modes), own.end, strict=True)
    return Motion(*(xp.where(is_small, small, large) for small, large in pairs))


def rod_end(rod: Rod, modes: Float[Array, " modes"]) -> Motion:
    """Return the pose of the rod's last section in the frame of its first."""
    return _end_motion(rod, modes, integrate_rod(rod, modes)).then(
        Motion(rod.curve_rotation, rod.curve_offset)
    )


def tail_pose(rod: Rod) -> Motion:
    """Return the pose of the distal body in the frame of the motion relative to the curve."""
    return Motion(rod.curve_rotation, rod.curve_offset).then(
        Motion(rod.end_rotation, rod.end_offset)
    )


def relative_pose(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration | None = None
) -> Motion:
    """Return the pose of the distal body in the proximal frame."""
    end_motion = _end_motion(rod, modes, integrate_rod(rod, modes) if own is None else own)
    return Motion(rod.start_rotation, rod.start_offset).then(end_motion).then(tail_pose(rod))


def twist_slope(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration
) -> Float[Array, "w modes"]:
    """Return the twist (angular, linear) of the distal body, in its own frame, per unit of mode."""
    end = own.rotation[-1]
    turn = own.turn[-1] if len(end) == 2 else end.T @ own.turn[-1]
    twist = jnp.concatenate([turn, end.T @ end_displacement(own)])
    if rod.linear_kinematics is not None:
        twist = jnp.where(rod.linear_kinematics > 0.0, small_twist(rod, modes), twist)
    return tail_pose(rod).twist_inside(twist)


def end_displacement(own: RodConfiguration) -> Float[Array, "d modes"]:
    """Return the displacement of the end per unit of mode, along the axes of the start."""
    return jnp.sum(own.stepped + _crossed(own.turn[:-1], own.step[..., None]), axis=0)


def _crossed(turn: Array, vector: Array) -> Array:
    """Cross rotations (places, a, modes) with vectors (places, d, 1 or modes)."""
    if turn.shape[1] == 1:
        return jnp.concatenate([turn * vector[:, 1:], -turn * vector[:, :1]], axis=1)
    return jnp.cross(turn, jnp.broadcast_to(vector, turn.shape), axis=1)


def small_twist(rod: Rod, modes: Float[Array, " modes"]) -> Float[Array, "w modes"]:
    """Return the twist of the end in its frame, per unit of mode, of a small deflection."""
    motion = _small_motion(rod, modes)
    slope: Motion = jax.jacfwd(lambda varied: _small_motion(rod, varied))(modes)
    turned = jnp.einsum("ji,jkm->ikm", motion.rotation, slope.rotation)
    turn = jax.vmap(unskew, in_axes=-1, out_axes=-1)(turned)
    return jnp.concatenate([turn, motion.rotation.T @ slope.translation])


def node_poses(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration | None = None
) -> Motion:
    """Return the poses of the sections at the nodes of the strains, in the proximal frame."""
    # Between the nodes of the rotation the Magnus terms are omitted, and polynomials interpolate
    # the steps: accurate enough for error estimates, not for the solution.
    own = integrate_rod(rod, modes) if own is None else own
    start = Motion(rod.start_rotation, rod.start_offset)
    turns = jnp.concatenate([jnp.zeros_like(rod.turn[:1]), rod.turn])
    rotation_vectors = (rod.node_turn - turns[rod.node_index]) @ jnp.concatenate(
        [jnp.ones(1), modes]
    )
    unturned = jnp.eye(len(own.rotation[0]))[None]
    before = jnp.concatenate([unturned, own.rotation])[rod.node_index]

    def at_node(turned: Array, turn: Array, moved: Array, free: Motion) -> Motion:
        return start.then(Motion(turned @ rotation_about(turn), moved)).then(free)

    free = Motion(rod.node_rotation, rod.node_offset)
    return jax.vmap(at_node)(before, rotation_vectors, rod.node_reach @ own.step, free)


# Gauss's points between neighbouring nodes of the rotation.
_BETWEEN = 4


def gauss_nodes(
    ends: Sequence[float] | Float[Array, " k"], per_interval: int | Sequence[int] = 3
) -> tuple[Float[Array, " nodes"], Float[Array, " nodes"]]:
    """Return Gauss's nodes and weights in every interval between neighbouring numbers."""
    half = 0.5 * xp.diff(xp.asarray(ends, float))
    if isinstance(per_interval, int):
        points, weight = leggauss(per_interval)
        positions = xp.asarray(ends[:-1])[:, None] + half[:, None] * (1.0 + points)
        return positions.ravel(), (half[:, None] * weight).ravel()
    rules = [leggauss(count) for count in per_interval]
    positions = [low + h * (1.0 + x) for low, h, (x, _) in zip(ends, half, rules, strict=False)]
    weights = [h * w for h, (_, w) in zip(half, rules, strict=True)]
    return xp.concatenate(positions), xp.concatenate(weights)


@cached(64)
def rod_quadrature(
    ends: tuple[float, ...], nodes: tuple[int, ...], poses: tuple[int, ...]
) -> RodQuadrature:
    """Return the cached quadrature of a rod; notches that only differ by site share it."""
    return RodQuadrature(ends, nodes, poses)


def legendre(at: Float[Array, " k"], count: int) -> Float[Array, "k count"]:
    """Return the first Legendre polynomials at points between -1 and 1."""
    values = [xp.ones_like(at), at]
    for degree in range(2, count):
        last, before = values[-1], values[-2]
        values.append(((2.0 * degree - 1.0) * at * last - (degree - 1.0) * before) / degree)
    return xp.stack(values[:count], axis=-1)


@lru_cache(maxsize=64)
def _projection(count: int) -> Float[Array, "count nodes"]:
    """Return the coefficients, of Legendre polynomials, of Lagrange's at Gauss's nodes."""
    points, weights = leggauss(count)
    return (xp.arange(count) + 0.5)[:, None] * (weights[:, None] * legendre(points, count)).T


def up_to(count: int, parts: Float[Array, " k"]) -> Float[Array, "k nodes"]:
    """Integrate the Lagrange polynomials of Gauss's nodes on (0, 1) from 0 to given parts."""
    values = legendre(2.0 * xp.asarray(parts) - 1.0, count + 1)
    higher = (values[:, 2:] - values[:, :-2]) / (2.0 * xp.arange(1, count) + 1.0)
    integrals = xp.concatenate([1.0 + values[:, 1:2], higher], axis=1)
    return 0.5 * integrals @ _projection(count)


_BEFORE = up_to(_BETWEEN, 0.5 * (1.0 + leggauss(_BETWEEN)[0]))


@dataclass(frozen=True)
class RodQuadrature:
    """Quadrature nodes along a rod.

    Attributes:
        ends: Ends of its pieces, from 0 to its length, mm.
        nodes: Gauss's nodes of strains and resultants on each piece.
        poses: Those of the pose.
    """

    ends: tuple[float, ...]
    nodes: tuple[int, ...]
    poses: tuple[int, ...]

    @cached_property
    def at_nodes(self) -> tuple[Float[Array, " nodes"], Float[Array, " nodes"]]:
        """Nodes of the strains, and their weights, mm."""
        return gauss_nodes(self.ends, self.nodes)

    @cached_property
    def at_poses(self) -> tuple[Float[Array, " gauss"], Float[Array, " gauss"]]:
        """Nodes of the pose, and their weights, mm."""
        # Between pieces there is one more node, of weight 0: rotations are integrated from node to
        # node, and strains may jump there.
        pieces = [
            gauss_nodes(ends, count)
            for *ends, count in zip(self.ends[:-1], self.ends[1:], self.poses, strict=True)
        ]
        positions, lengths = pieces[0]
        for low, (more, stand_for) in zip(self.ends[1:], pieces[1:], strict=False):
            positions = xp.concatenate([positions, xp.reshape(low, 1), more])
            lengths = xp.concatenate([lengths, np.zeros(1), stand_for])
        return positions, lengths

    @cached_property
    def between(self) -> tuple[Float[Array, " fine"], Float[Array, " fine"]]:
        """Points between the neighbours of start, nodes of the pose and end, and their lengths."""
        ends = xp.asarray(self.ends)
        return gauss_nodes(xp.concatenate([ends[:1], self.at_poses[0], ends[-1:]]), _BETWEEN)

    @cached_property
    def before(self) -> tuple[Float[Array, " more"], Float[Array, " more"]]:
        """Points between the start, the nodes of the strains and the ends, and their lengths."""
        return gauss_nodes(self._stops, _BETWEEN)

    @cached_property
    def _stops(self) -> Float[Array, " stops"]:
        """The start, the nodes of the strains, and the ends between pieces, rising."""
        nodes = xp.split(self.at_nodes[0], np.cumsum(self.nodes)[:-1])
        starts = xp.asarray(self.ends)[:-1, None]
        return xp.concatenate([part for pair in zip(starts, nodes, strict=True) for part in pair])

    @cached_property
    def unit(self) -> RodQuadrature:
        """The same with pieces of length 1: for what their lengths do not change."""
        return rod_quadrature(tuple(map(float, range(len(self.ends)))), self.nodes, self.poses)

    @cached_property
    def every(self) -> Float[Array, " every"]:
        """All points, in the order of the properties above."""
        parts = (self.at_nodes, self.at_poses, self.between, self.before)
        return xp.concatenate([positions for positions, _ in parts])

    @property
    def weight(self) -> Float[Array, " every"]:
        """Weights of all points in an integral over the nodes of the strains."""
        own = self.at_nodes[1]
        return xp.pad(own, (0, len(self.every) - len(own)))

    def fields(
        self,
        curve: Motion | None,
        basis: Float[Array, "every 6 modes"],
        reference: Float[Array, "every 6"] | None = None,
    ) -> dict[str, Any]:
        """Return the fields of a rod for its strains and its pose."""
        free = xp.zeros(basis.shape[:2]) if reference is None else reference
        hat = xp.concatenate([free[..., None], basis], axis=-1)
        if curve is None:
            count = len(hat)
            twists = constant(hat)
            curve = Motion(constant([xp.eye(3)] * count), constant(xp.zeros((count, 3))))
        else:
            twists = outer_twists(curve, constant(hat))
        counts = [len(part[0]) for part in (self.at_nodes, self.at_poses, self.between)]
        _, at_poses, between, before = xp.split(twists, xp.cumsum(counts))
        turns = _grouped(between[:, :3], self.between[1])
        at_node = slice(counts[0])
        unit = self.unit
        stop = np.searchsorted(unit._stops, unit.at_nodes[0]) - 1
        return {
            "length": constant(self.at_nodes[1]),
            "basis": constant(basis[at_node]),
            "turn": constant(xp.cumsum(turns, axis=0)),
            "turn_pair": constant(_pairs(between[:, :3], self.between[1])),
            "step": constant(self.at_poses[1][:, None, None] * at_poses[:, 3:]),
            "node_turn": constant(xp.cumsum(_grouped(before[:, :3], self.before[1]), axis=0)[stop]),
            "node_index": np.searchsorted(unit.at_poses[0], unit.at_nodes[0], side="right"),
            "node_reach": constant(unit._reach),
            "node_rotation": constant(curve.rotation[at_node]),
            "node_offset": constant(curve.translation[at_node]),
        }

    @cached_property
    def _reach(self) -> Float[Array, "nodes gauss"]:
        """Compute the fraction of each pose node's step before each node of the strains."""
        nodes = self.at_nodes[0]
        columns = []
        for low, high, count in zip(self.ends[:-1], self.ends[1:], self.poses, strict=True):
            part = xp.clip((nodes - low) / (high - low), 0.0, 1.0)
            columns += [up_to(count, part) / (0.5 * leggauss(count)[1]), xp.zeros((len(nodes), 1))]
        return xp.concatenate(columns[:-1], axis=1)


def _grouped(values: Float[Array, "fine ..."], lengths: Float[Array, " fine"]) -> Any:
    """Integrate over every run of points."""
    weighted = lengths.reshape(-1, *(1,) * (values.ndim - 1)) * values
    return weighted.reshape(-1, _BETWEEN, *values.shape[1:]).sum(axis=1)


def _pairs(
    turning: Float[Array, "fine 3 hat"], lengths: Float[Array, " fine"]
) -> Float[Array, "places 3 hat hat"]:
    """Compute the second term of the Magnus series on every run of points, for pairs of modes."""
    # It is half the integral of a(t) x a(s) over t < s, for a motion in the moving frame.
    modes = turning.shape[-1]
    rates, weights = turning.reshape(-1, _BETWEEN, 3 * modes), lengths.reshape(-1, _BETWEEN, 1)
    so_far = weights.sum(axis=1, keepdims=True) * (_BEFORE @ rates)
    products = (xp.swapaxes(weights * so_far, 1, 2) @ rates).reshape(-1, 3, modes, 3, modes)
    pairs = 0.5 * xp.stack(
        [products[:, k - 2, :, k - 1] - products[:, k - 1, :, k - 2] for k in range(3)], axis=1
    )
    return 0.5 * (pairs + xp.swapaxes(pairs, -1, -2))


# Geometric stiffness: change of the generalised forces of a wrench with the modes.


def geometric_stiffness(
    rod: Rod, modes: Float[Array, " modes"], own: RodConfiguration, wrench: Float[Array, " w"]
) -> Float[Array, "modes modes"]:
    """Compute the change of the generalised forces of a wrench with the modes."""
    # It is the derivative of twist_slope^T wrench for a wrench that moves with the body; rows are
    # the modes that it acts on. With F the force and M the moment about the end, along the axes of
    # the start, the generalised force is M . turn + F . (sum of the moved steps).
    axes = own.turn.shape[1]
    at_end = tail_pose(rod).wrench(wrench)
    end = own.rotation[-1]
    force = end @ at_end[axes:]
    arms = _arms(rod, own, force)
    turn = own.turn[:-1]
    # Second-order effect of two rotations on a step along the force, symmetrised.
    along = 0.5 * (own.step @ force)
    mixed = jnp.einsum("gci,gcj->ij", arms - along[:, None, None] * turn, turn)
    leaving = _moments(end_displacement(own)[None], force)[0].T @ own.turn[-1]
    change = mixed + mixed.T - leaving
    if axes == 3:
        change = change + _noncommuting_terms(rod, own, at_end)
    if rod.linear_kinematics is not None:
        small = jax.jacfwd(lambda varied: small_twist(rod, varied).T @ at_end)(modes)
        change = jnp.where(rod.linear_kinematics > 0.0, small, change)
    return change


def _arms(rod: Rod, own: RodConfiguration, force: Array) -> Float[Array, "gauss a modes"]:
    """Compute the moments of the force through each step, per unit of mode, about the start."""
    if len(force) == 3:
        return _moments(own.stepped, force)
    # The result is a scalar: rotating the force is cheaper than the steps of all modes.
    across = jnp.stack([-force[1], force[0]])
    across = jnp.einsum("gdc,d->gc", own.rotation[:-1], across)
    return jnp.einsum("gc,gci->gi", across, rod.step[..., 1:])[:, None]


def _moments(points: Array, force: Array) -> Float[Array, "places a modes"]:
    """Compute the moments of one force at points (places, d, modes) about the start."""
    if len(force) == 2:
        return points[:, 1:] * force[0] - points[:, :1] * force[1]
    return jnp.cross(points, jnp.broadcast_to(force[:, None], points.shape), axis=1)


def _noncommuting_terms(
    rod: Rod, own: RodConfiguration, at_end: Float[Array, " 6"]
) -> Float[Array, "modes modes"]:
    """Compute the terms of `geometric_stiffness` in space, where rotations do not commute."""
    # The slopes of the rotations change with the modes: with the rotations before, with the slope
    # of the exponential, and with the pairs of the Magnus series.
    assert rod.turn_pair is not None
    assert own.from_place is not None
    turns, slope, turning = own.from_place
    end = own.rotation[-1]
    moment, force = end @ at_end[:3], end @ at_end[3:]
    nodes = own.turn[:-1]
    # Contribution of each point to the wrench, then of all points from it on.
    shares = jnp.cross(own.step, jnp.broadcast_to(force, own.step.shape))
    shares = jnp.concatenate([shares, moment[None]])
    beyond = jnp.cumsum(shares[::-1], axis=0)[::-1]
    turned_before = jnp.concatenate([jnp.zeros_like(own.turn[:1]), own.turn[:-1]])
    lever = jnp.cross(turning, jnp.broadcast_to(beyond[..., None], turning.shape), axis=1)
    change = jnp.einsum("kci,kcj->ij", lever, turned_before)
    inside = jnp.einsum("kdc,kd->kc", rotations_before(own.rotation), beyond)
    bending = jax.vmap(left_slope_change)(turns, inside)
    change = change + jnp.einsum("kci,kcd,kdj->ij", slope, bending, slope)
    answers = jnp.einsum("kdc,kd->kc", left_slopes(turns), inside)
    change = change + 2.0 * jnp.einsum("kcij,kc->ij", rod.turn_pair[..., 1:, 1:], answers)
    # The end rotates the first node's wrench, and steps leave the plane of their rotations.
    last = own.turn[-1]
    change = change + jnp.einsum("ci,cj->ij", last, jnp.cross(last, moment[:, None], axis=0))
    by_force = jnp.einsum("gcj,c->gj", nodes, force)
    return change + jnp.einsum("gci,gc,gj->ij", nodes, own.step, by_force)
