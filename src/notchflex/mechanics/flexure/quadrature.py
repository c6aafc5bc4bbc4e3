"""Quadrature nodes of a rod, and the integrals of its rotations and steps over them.

A rod consists of pieces on which its strains are smooth. Strains and resultants have their own
nodes, the pose has others, and points between neighbours of these integrate the rotation exactly.
A flexure evaluates its strains at all points (`every`) at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.polynomial.legendre import leggauss

from notchflex._jax import constant
from notchflex.mechanics.motion import Motion, outer_twists

# Gauss's points between neighbouring nodes of the rotation.
_BETWEEN = 4


@lru_cache(maxsize=64)
def _rule(count: int) -> tuple[Float[np.ndarray, " nodes"], Float[np.ndarray, " nodes"]]:
    """Return Gauss's nodes from -1 to 1 and their weights, cached."""
    rule = leggauss(count)
    for values in rule:
        values.setflags(write=False)
    return rule


@lru_cache(maxsize=64)
def _polynomials(count: int) -> Float[np.ndarray, "nodes nodes"]:
    """Return the coefficients of the Lagrange polynomials of Gauss's nodes from 0 to 1, cached."""
    points = 0.5 * (1.0 + _rule(count)[0])
    coefficients = np.linalg.inv(points[:, None] ** np.arange(count))
    coefficients.setflags(write=False)
    return coefficients


def gauss_nodes(
    ends: Sequence[float], per_interval: int | Sequence[int] = 3
) -> tuple[Float[np.ndarray, " nodes"], Float[np.ndarray, " nodes"]]:
    """Return Gauss's nodes and weights in every interval between neighbouring numbers.

    Args:
        ends: Ends of the intervals, rising.
        per_interval: Nodes in each; one number, or one per interval.

    Returns:
        Positions and weights.

    Example:
        >>> positions, weights = gauss_nodes([0.0, 1.0, 3.0])
        >>> print(f"{weights @ positions**2:.6f}")
        9.000000
    """
    half = 0.5 * np.diff(np.asarray(ends, float))
    if isinstance(per_interval, int):
        points, weight = _rule(per_interval)
        positions = np.asarray(ends[:-1])[:, None] + half[:, None] * (1.0 + points)
        return positions.ravel(), (half[:, None] * weight).ravel()
    rules = [_rule(count) for count in per_interval]
    positions = [low + h * (1.0 + x) for low, h, (x, _) in zip(ends, half, rules, strict=False)]
    weights = [h * w for h, (_, w) in zip(half, rules, strict=True)]
    return np.concatenate(positions), np.concatenate(weights)


@lru_cache(maxsize=64)
def rod_quadrature(
    ends: tuple[float, ...], nodes: tuple[int, ...], poses: tuple[int, ...]
) -> RodQuadrature:
    """Return the cached quadrature of a rod; notches that only differ by site share it."""
    return RodQuadrature(ends, nodes, poses)


def up_to(count: int, parts: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k nodes"]:
    """Integrate the Lagrange polynomials of Gauss's nodes on (0, 1) from 0 to given parts."""
    powers = np.arange(1, count + 1)
    integrals = np.asarray(parts)[:, None] ** powers / powers
    return integrals @ _polynomials(count)


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
    def at_nodes(self) -> tuple[Float[np.ndarray, " nodes"], Float[np.ndarray, " nodes"]]:
        """Nodes of the strains, and their weights, mm."""
        return gauss_nodes(self.ends, self.nodes)

    @cached_property
    def at_poses(self) -> tuple[Float[np.ndarray, " gauss"], Float[np.ndarray, " gauss"]]:
        """Nodes of the pose, and their weights, mm.

        Between pieces there is one more node, of weight 0: rotations are integrated from node to
        node, and strains may jump there.
        """
        pieces = [
            gauss_nodes(ends, count)
            for *ends, count in zip(self.ends[:-1], self.ends[1:], self.poses, strict=True)
        ]
        positions, lengths = pieces[0]
        for low, (more, stand_for) in zip(self.ends[1:], pieces[1:], strict=False):
            positions = np.concatenate([positions, [low], more])
            lengths = np.concatenate([lengths, [0.0], stand_for])
        return positions, lengths

    @cached_property
    def between(self) -> tuple[Float[np.ndarray, " fine"], Float[np.ndarray, " fine"]]:
        """Points between the neighbours of start, nodes of the pose and end, and their lengths."""
        return gauss_nodes([0.0, *self.at_poses[0], self.ends[-1]], _BETWEEN)

    @cached_property
    def before(self) -> tuple[Float[np.ndarray, " more"], Float[np.ndarray, " more"]]:
        """Points between the start, the nodes of the strains and the ends, and their lengths."""
        return gauss_nodes(self._stops, _BETWEEN)

    @property
    def _stops(self) -> list[float]:
        return sorted({0.0, *self.ends[1:-1], *self.at_nodes[0].tolist()})

    @cached_property
    def every(self) -> Float[np.ndarray, " every"]:
        """All points, in the order of the properties above."""
        parts = (self.at_nodes, self.at_poses, self.between, self.before)
        return np.concatenate([positions for positions, _ in parts])

    @property
    def weight(self) -> Float[np.ndarray, " every"]:
        """Weights of all points in an integral over the nodes of the strains."""
        own = self.at_nodes[1]
        return np.pad(own, (0, len(self.every) - len(own)))

    def fields(
        self,
        curve: Motion | None,
        basis: Float[np.ndarray, "every 6 modes"],
        reference: Float[np.ndarray, "every 6"] | None = None,
    ) -> dict[str, Any]:
        """Return the fields of a rod for its strains and its pose.

        Args:
            curve: Pose of the reference curve at every point, as leading axis; None for a point.
            basis: Strain at every point per unit of mode.
            reference: Strain of the free rod beyond that of the curve; none where not given.
        """
        free = np.zeros(basis.shape[:2]) if reference is None else reference
        hat = np.concatenate([free[..., None], basis], axis=-1)
        if curve is None:
            count = len(hat)
            twists = constant(hat)
            curve = Motion(constant([np.eye(3)] * count), constant(np.zeros((count, 3))))
        else:
            twists = outer_twists(curve, constant(hat))
        counts = [len(part[0]) for part in (self.at_nodes, self.at_poses, self.between)]
        _, at_poses, between, before = np.split(twists, np.cumsum(counts))
        turns = _grouped(between[:, :3], self.between[1])
        at_node = slice(counts[0])
        return {
            "length": constant(self.at_nodes[1]),
            "basis": constant(basis[at_node]),
            "turn": constant(np.cumsum(turns, axis=0)),
            "turn_pair": constant(_pairs(between[:, :3], self.between[1])),
            "step": constant(self.at_poses[1][:, None, None] * at_poses[:, 3:]),
            "node_turn": constant(self._to_nodes(_grouped(before[:, :3], self.before[1]))),
            "node_index": np.searchsorted(self.at_poses[0], self.at_nodes[0], side="right"),
            "node_reach": constant(self._reach()),
            "node_rotation": constant(curve.rotation[at_node]),
            "node_offset": constant(curve.translation[at_node]),
        }

    def _to_nodes(self, turns: Float[np.ndarray, "stops 3 hat"]) -> Any:
        """Sum the rotations between stops up to each node of the strains."""
        return np.cumsum(turns, axis=0)[np.searchsorted(self._stops, self.at_nodes[0]) - 1]

    def _reach(self) -> Float[np.ndarray, "nodes gauss"]:
        """Compute the fraction of each pose node's step before each node of the strains."""
        nodes = self.at_nodes[0]
        columns = []
        for low, high, count in zip(self.ends[:-1], self.ends[1:], self.poses, strict=True):
            part = np.clip((nodes - low) / (high - low), 0.0, 1.0)
            columns += [up_to(count, part) / (0.5 * _rule(count)[1]), np.zeros((len(nodes), 1))]
        return np.concatenate(columns[:-1], axis=1)


def _grouped(values: Float[np.ndarray, "fine ..."], lengths: Float[np.ndarray, " fine"]) -> Any:
    """Integrate over every run of points."""
    weighted = lengths.reshape(-1, *(1,) * (values.ndim - 1)) * values
    return weighted.reshape(-1, _BETWEEN, *values.shape[1:]).sum(axis=1)


def _pairs(
    turning: Float[np.ndarray, "fine 3 hat"], lengths: Float[np.ndarray, " fine"]
) -> Float[np.ndarray, "places 3 hat hat"]:
    """Compute the second term of the Magnus series on every run of points, for pairs of modes.

    It is half the integral of a(t) x a(s) over t < s, for a motion in the moving frame.
    """
    own = turning.reshape(-1, _BETWEEN, *turning.shape[1:])
    weights = lengths.reshape(-1, _BETWEEN)
    inner = up_to(_BETWEEN, 0.5 * (1.0 + _rule(_BETWEEN)[0]))
    so_far = weights.sum(axis=1)[:, None, None, None] * np.einsum("ij,rjch->rich", inner, own)
    crossed = np.cross(so_far[..., :, None], own[..., None, :], axisa=2, axisb=2, axisc=2)
    pairs = 0.5 * np.einsum("ri,richk->rchk", weights, crossed)
    return 0.5 * (pairs + np.swapaxes(pairs, -1, -2))
