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
from collections.abc import Sequence
from functools import singledispatch
from typing import Any, NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._arrays import decide, xp
from notchflex._jax import (
    Pytree,
    constant,
    jax,
    static,
)
from notchflex._packages import unregistered
from notchflex.mechanics.material import NotchEnds
from notchflex.mechanics.material.law import FibreSection
from notchflex.mechanics.motion import IN_PLANE, PLANE
from notchflex.mechanics.ring import Side
from notchflex.mechanics.section import FibresAt
from notchflex.robot import Tube

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


def flattened(rods: Rod, frame: Float[Array, "3 3"]) -> Rod:
    """Reduce spatial rods to the plane that their robot stays in."""
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
    kept |= {name: own(name)[..., IN_PLANE, :][..., IN_PLANE] for name in _ROTATIONS}
    return dataclasses.replace(rods, **kept, turn_pair=None)


def planar_points(points: Float[Array, "*shape 3"]) -> Float[Array, "*shape 2"]:
    """Return the components of points or forces in the plane."""
    return constant(xp.asarray(points)[..., IN_PLANE])


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
    if decide(xp.all(xp.stack([xp.all(leaf == leaf[:1]) for leaf in arrays]))):
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
    stacked: Rod = jax.tree.map(lambda *leaves: xp.stack(leaves), *filled)
    unused: dict[str, Any] = {
        name: None
        for name in ("linear_kinematics", "chord", "stop_flexibility")
        if not decide(xp.any(getattr(stacked, name)))
    }
    return dataclasses.replace(stacked, **unused)


def _with_ends(rod: Rod) -> Rod:
    """Return the rod with ends, rigid ones where it has none."""
    rigid = xp.zeros(xp.shape(rod.section.area))
    ends = (
        jax.tree.map(lambda _: rigid, NotchEnds()) if rod.section.ends is None else rod.section.ends
    )
    return dataclasses.replace(rod, section=dataclasses.replace(rod.section, ends=ends))


def _filled(rod: Rod, modes: int, nodes: int, poses: int, levels: tuple[int, ...]) -> Rod:
    """Pad a rod with modes, nodes of weight zero, and zero steps."""
    more, further = modes - rod.modes, poses - rod.step.shape[0]
    count = rod.length.shape[0]
    if (more, further, count, levels) == (0, 0, nodes, rod.levels):
        return rod
    index = xp.minimum(xp.arange(nodes), count - 1)
    at_end = xp.minimum(xp.arange(poses + 1), rod.step.shape[0])

    def wider(values: Array, axes: int = 1) -> Array:
        return constant(xp.pad(values, [(0, 0)] * (values.ndim - axes) + [(0, more)] * axes))

    def longer(values: Array) -> Array:
        return constant(xp.pad(values, [(0, further)] + [(0, 0)] * (values.ndim - 1)))

    pair = None if rod.turn_pair is None else longer(wider(rod.turn_pair, 2))
    reach = xp.pad(rod.node_reach[index], ((0, 0), (0, further)))
    return dataclasses.replace(
        rod,
        length=rod.length[index] * (xp.arange(nodes) < count),
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
        padding_mask=constant(xp.arange(modes) >= rod.modes),
        levels=levels,
    )


# From the description of a notch to its rod.
#
# A notch shape lives in a file of its own in this folder and registers itself for its description;
# the package imports every file of the folder, so no list is kept.


class Site(NamedTuple):
    """What surrounds a notch whose ends are elastic.

    Attributes:
        proximal: The ring toward the base.
        distal: The ring toward the tip.
        poisson_ratio: Poisson's ratio of the tube.
    """

    proximal: Side
    distal: Side
    poisson_ratio: float


@singledispatch
def rod(notch: Any, tube: Tube, refinement: int = 0, site: Site | None = None) -> Rod:
    """Rod of one notch.

    Args:
        notch: A notch description, such as `notchflex.ArcNotch(...)`.
        tube: The tube it is cut into.
        refinement: 0 has the modes that serve for usual loads; 1, 2 ... has more.
        site: What surrounds it, where its ends are elastic (`Notch.has_elastic_ends`).

    Returns:
        The rod, in mm and rad.

    Raises:
        TypeError: There is no rod for this kind of description.
    """
    del tube, refinement, site
    raise unregistered("rod", notch, "flexure", "rod")


def rod_at(site: Site | None, notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Make the rod of a notch where it stands."""
    # Kinds whose ends are rigid need not know of sites.
    return rod(notch, tube, refinement) if site is None else rod(notch, tube, refinement, site)


@singledispatch
def section_fibres(notch: Any, tube: Tube) -> FibresAt:
    """Fibres of the sections of a notch, for materials that sum up stresses.

    Args:
        notch: A notch description.
        tube: The tube it is cut into.

    Returns:
        The fibres about any axis, as a function of the distances of the edges of the section
        from its neutral axis (`edge_near`, `edge_spine`), mm, and of their number.

    Raises:
        TypeError: The fibres of this kind of notch are not stated.
    """
    del tube
    raise unregistered("section of fibres", notch, "flexure", "section_fibres")


@singledispatch
def validity_warnings(notch: Any, tube: Tube, site: Site) -> list[str]:
    """List where the law of a notch with elastic ends was not checked.

    Args:
        notch: A notch description.
        tube: The tube it is cut into.
        site: What surrounds it.

    Returns:
        A sentence for each dimension outside the range that finite elements cover.
    """
    del notch, tube, site
    return []
