"""Truncation and padding of the modes of a rod, and stacking of rods."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from jaxtyping import Array

from notchflex._jax import constant, jax
from notchflex.mechanics.flexure.rod import Rod
from notchflex.mechanics.material import NotchEnds

LEVELS = ("tendons", "plane", "space")
"""Loads that a chain is assembled for: tendons alone, loads in the plane of bending, or any."""

MAX_REFINEMENT = 3
"""Largest number of refinements of the modes of a flexure."""

_HAT = ("turn", "step", "node_turn")
_AT_NODES = (
    "reference_strain",
    "basis",
    "node_turn",
    "node_index",
    "node_reach",
    "node_rotation",
    "node_offset",
)


def with_level(rod: Rod, level: str) -> Rod:
    """Keep the modes that a level of loads needs; constant strains keep one node."""
    modes = rod.levels[LEVELS.index(level)]
    kept: dict[str, Any] = {name: getattr(rod, name)[..., : modes + 1] for name in _HAT}
    kept |= {"basis": rod.basis[..., :modes], "padding_mask": rod.padding_mask[..., :modes]}
    if rod.turn_pair is not None:
        kept["turn_pair"] = rod.turn_pair[..., : modes + 1, : modes + 1]
    arrays = (rod.reference_strain, kept["basis"], *jax.tree.leaves(rod.section))
    if all((leaf == leaf[:1]).all() for leaf in arrays):
        # The one node in the middle.
        middle = slice(len(rod.length) // 2, len(rod.length) // 2 + 1)
        kept |= {name: kept.get(name, getattr(rod, name))[middle] for name in _AT_NODES}
        kept["section"] = jax.tree.map(lambda leaf: leaf[middle], rod.section)
        kept["length"] = constant([rod.length.sum()])
    return dataclasses.replace(rod, **kept)


def stack(rods: Sequence[Rod]) -> Rod:
    """Stack flexures along a leading axis, padding the smaller ones."""
    modes = max(rod.modes for rod in rods)
    nodes = max(rod.length.shape[0] for rod in rods)
    poses = max(rod.step.shape[0] for rod in rods)
    levels = tuple(max(rod.levels[i] for rod in rods) for i in range(3))
    if any(rod.section.ends is not None for rod in rods):
        rods = [_with_ends(rod) for rod in rods]
    filled = [_filled(rod, modes, nodes, poses, levels) for rod in rods]
    unused: dict[str, Any] = {
        name: None
        for name in ("linear_kinematics", "chord", "stop_flexibility")
        if not any(np.any(getattr(rod, name)) for rod in filled)
    }
    used = [dataclasses.replace(rod, **unused) if unused else rod for rod in filled]
    together: Rod = jax.tree.map(lambda *leaves: _stacked(np.stack(leaves)), *used)
    return together


def _with_ends(rod: Rod) -> Rod:
    """Return the rod with ends, rigid ones where it has none."""
    if rod.section.ends is not None:
        return rod
    ends = NotchEnds.rigid(rod.section.area)
    return dataclasses.replace(rod, section=dataclasses.replace(rod.section, ends=ends))


def _stacked(values: np.ndarray) -> Array:
    """Convert to floats, except integers, which are indices."""
    return cast("Array", values) if values.dtype.kind == "i" else constant(values)


def _filled(rod: Rod, modes: int, nodes: int, poses: int, levels: tuple[int, ...]) -> Rod:
    """Pad a rod with modes, nodes of weight zero, and zero steps."""
    more, further = modes - rod.modes, poses - rod.step.shape[0]
    count = rod.length.shape[0]
    if (more, further, count, levels) == (0, 0, nodes, rod.levels):
        return rod
    index = np.minimum(np.arange(nodes), count - 1)
    at_end = np.minimum(np.arange(poses + 1), rod.step.shape[0])

    def wider(values: Array, axes: int = 1) -> Array:
        return constant(np.pad(values, [(0, 0)] * (values.ndim - axes) + [(0, more)] * axes))

    def longer(values: Array) -> Array:
        return constant(np.pad(values, [(0, further)] + [(0, 0)] * (values.ndim - 1)))

    pair = None if rod.turn_pair is None else longer(wider(rod.turn_pair, 2))
    reach = np.pad(rod.node_reach[index], ((0, 0), (0, further)))
    return dataclasses.replace(
        rod,
        length=rod.length[index] * (np.arange(nodes) < count),
        reference_strain=rod.reference_strain[index],
        basis=wider(rod.basis)[index],
        turn=wider(rod.turn)[at_end],
        turn_pair=pair,
        step=longer(wider(rod.step)),
        node_turn=wider(rod.node_turn)[index],
        node_index=rod.node_index[index],
        node_reach=reach,
        node_rotation=rod.node_rotation[index],
        node_offset=rod.node_offset[index],
        section=jax.tree.map(lambda leaf: leaf[index], rod.section),
        padding_mask=constant(np.arange(modes) >= rod.modes),
        levels=levels,
    )
