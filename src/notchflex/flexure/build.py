"""Helpers to build a rod: Gauss's nodes, strains beside a followed curve, fewer or more modes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax
from notchflex.flexure.rod import Rod
from notchflex.motion import Motion, adjoint

LEVELS = ("tendons", "plane", "space")
"""For which loads a chain is assembled: tendons alone, loads in the plane of bending, or any."""

_PER_NODE = (
    "length",
    "reference_strain",
    "basis",
    "followed_reference",
    "followed_basis",
    "node_rotation",
    "node_offset",
)


def gauss_nodes(
    ends: Sequence[float], per_interval: int = 3
) -> tuple[Float[np.ndarray, " nodes"], Float[np.ndarray, " nodes"]]:
    """Gauss's nodes in every interval between neighbouring numbers, and what each stands for.

    Args:
        ends: Ends of the intervals, rising.
        per_interval: Nodes in each.

    Returns:
        Places and weights.

    Example:
        >>> places, weights = gauss_nodes([0.0, 1.0, 3.0])
        >>> print(f"{weights @ places**2:.6f}")
        9.000000
    """
    points, weights = np.polynomial.legendre.leggauss(per_interval)
    low, high = np.asarray(ends[:-1], float)[:, None], np.asarray(ends[1:], float)[:, None]
    half = 0.5 * (high - low)
    return (low + half * (1.0 + points)).ravel(), (half * weights).ravel()


def followed(
    poses: Sequence[Motion], strains: Float[np.ndarray, "nodes 6 ..."]
) -> Float[np.ndarray, "nodes 6 ..."]:
    """Strains at the nodes carried into the frame where the followed curve starts.

    Args:
        poses: Pose of the followed curve at each node.
        strains: Strain, or strain per unit of mode, at each node.
    """
    return np.stack([adjoint(pose) @ strain for pose, strain in zip(poses, strains, strict=True)])


def with_level(rod: Rod, level: str) -> Rod:
    """Keep the modes that a level of loads needs; a rod of constant strain keeps one node."""
    modes = rod.levels[LEVELS.index(level)]
    kept = dataclasses.replace(
        rod,
        basis=rod.basis[..., :modes],
        followed_basis=rod.followed_basis[..., :modes],
        idle=rod.idle[..., :modes],
    )
    per_node = [getattr(kept, name) for name in _PER_NODE[1:]]
    sections = jax.tree.leaves(kept.section)
    if all(np.all(leaf == leaf[:1]) for leaf in (*per_node, *sections)):
        kept = _at_nodes(kept, np.array([0]), constant([rod.length.sum()]), 1)
    return kept


def stack(rods: Sequence[Rod]) -> Rod:
    """Put flexures together as leading axis, the smaller ones filled up."""
    modes = max(rod.modes for rod in rods)
    per_interval = max(rod.nodes_per_interval for rod in rods)
    intervals = max(rod.length.shape[0] // rod.nodes_per_interval for rod in rods)
    levels = tuple(max(rod.levels[i] for rod in rods) for i in range(3))
    filled = [
        eqx.tree_at(
            lambda rod: rod.idle,
            _filled(rod, modes, per_interval, intervals * per_interval, levels),
            constant(np.arange(modes) >= rod.modes),
        )
        for rod in rods
    ]
    together = jax.tree.map(lambda *leaves: constant(np.stack(leaves)), *filled)
    unused = {name: None for name in ("small", "chord") if not getattr(together, name).any()}
    return dataclasses.replace(together, **unused)


def _filled(rod: Rod, modes: int, per_interval: int, nodes: int, levels: tuple[int, ...]) -> Rod:
    if rod.nodes_per_interval < per_interval:  # one node of constant strain becomes several
        _, parts = gauss_nodes([0.0, 1.0], per_interval)
        index = np.repeat(np.arange(rod.length.shape[0]), per_interval)
        rod = _at_nodes(rod, index, (rod.length[:, None] * parts).ravel(), per_interval)
    count = rod.length.shape[0]
    index = np.minimum(np.arange(nodes), count - 1)
    rod = _at_nodes(rod, index, rod.length[index] * (np.arange(nodes) < count), per_interval)
    added = ((0, 0), (0, 0), (0, modes - rod.modes))
    return dataclasses.replace(
        rod,
        basis=np.pad(rod.basis, added),
        followed_basis=np.pad(rod.followed_basis, added),
        idle=np.zeros(modes),
        levels=levels,
    )


def _at_nodes(
    rod: Rod, index: np.ndarray, length: Float[Array, " nodes"], per_interval: int
) -> Rod:
    """The rod at other nodes, each with the properties of one that it had."""
    values = {name: getattr(rod, name)[index] for name in _PER_NODE[1:]}
    return dataclasses.replace(
        rod,
        **values,
        length=length,
        section=jax.tree.map(lambda leaf: leaf[index], rod.section),
        nodes_per_interval=per_interval,
    )
