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
import re
from collections.abc import Sequence
from functools import singledispatch
from typing import Any, NamedTuple

from jaxtyping import Array, Float, Int

from notchflex._arrays import decide, xp
from notchflex._imports import unregistered
from notchflex._jax import Pytree, constant, jax, static
from notchflex.mechanics.material import NotchEnds
from notchflex.mechanics.material.law import FibreSection
from notchflex.mechanics.motion import IN_PLANE, PLANE
from notchflex.mechanics.ring import Side
from notchflex.mechanics.section import FibresAt
from notchflex.robot import Tube

Modes = Float[Array, " modes"]
"""Amplitude of each strain mode."""


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
    turn_pair: Float[Array, "*n gaps 3 hat hat"] | None
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


_AXES = {
    field.name: "".join(re.findall("'(.*)'", str(field.type))).split()[1:]
    for field in dataclasses.fields(Rod)
}
"""Axes of the arrays of a rod, behind the leading one, as their types name them."""


def _selected(rod: Rod, selection: dict[str, Any]) -> Rod:
    """Select entries along named axes of all arrays."""
    chosen = {
        name: getattr(rod, name)[(..., *(selection.get(axis, slice(None)) for axis in axes))]
        for name, axes in _AXES.items()
        if getattr(rod, name) is not None and not selection.keys().isdisjoint(axes)
    }
    return dataclasses.replace(rod, **chosen)


def flattened(rods: Rod, frame: Float[Array, "3 3"]) -> Rod:
    """Reduce spatial rods to the x-z plane of a frame, which their robot stays in."""
    # They have no modes that leave the plane: twists keep three components and points two.
    turned = dataclasses.replace(
        rods,
        start_rotation=frame.T @ rods.start_rotation,
        start_offset=rods.start_offset @ frame,
        end_rotation=rods.end_rotation @ frame,
        turn_pair=None,
    )
    return _selected(turned, {"d": IN_PLANE, "w": PLANE, "a": slice(1, 2)})


LEVELS = ("tendons", "plane", "space")
"""Loads that a chain is assembled for: tendons alone, loads in the plane of bending, or any."""

MAX_REFINEMENT = 3
"""Largest number of refinements of the modes of a flexure."""


def with_level(rod: Rod, level: str) -> Rod:
    """Keep the modes that a level of loads needs; constant strains keep one node."""
    modes = rod.levels[LEVELS.index(level)]
    rod = _selected(rod, {"modes": slice(modes), "hat": slice(modes + 1)})
    arrays = (rod.reference_strain, rod.basis, *jax.tree.leaves(rod.section))
    if not decide(xp.all(xp.stack([xp.all(leaf == leaf[:1]) for leaf in arrays]))):
        return rod
    count = len(rod.length)
    middle = slice(count // 2, count // 2 + 1)
    return dataclasses.replace(
        _selected(rod, {"nodes": middle}),
        section=jax.tree.map(lambda leaf: leaf[middle], rod.section),
        length=constant([rod.length.sum()]),
    )


def stack(rods: Sequence[Rod]) -> Rod:
    """Stack flexures along a leading axis, padding the smaller ones."""
    modes = max(rod.modes for rod in rods)
    nodes = max(rod.length.shape[0] for rod in rods)
    poses = max(rod.step.shape[0] for rod in rods)
    levels = tuple(max(rod.levels[i] for rod in rods) for i in range(3))
    have_ends = any(rod.section.ends is not None for rod in rods)

    def filled(rod: Rod) -> Rod:
        """Pad a rod with modes, nodes of weight zero, zero steps, and rigid ends if others bend."""
        more, further = modes - rod.modes, poses - rod.step.shape[0]
        section, count = rod.section, rod.length.shape[0]
        if have_ends and section.ends is None:
            rigid = jax.tree.map(lambda _: xp.zeros(count), NotchEnds())
            section = dataclasses.replace(section, ends=rigid)
        index = xp.minimum(xp.arange(nodes), count - 1)
        reached = xp.minimum(xp.arange(poses + 1), poses - further)
        longer = _selected(rod, {"nodes": index, "places": reached})
        added = {"modes": more, "hat": more, "gauss": further, "gaps": further}
        padded = {
            name: xp.pad(getattr(longer, name), [(0, added.get(axis, 0)) for axis in axes])
            for name, axes in _AXES.items()
            if not added.keys().isdisjoint(axes) and getattr(longer, name) is not None
        }
        padded["padding_mask"] = constant(xp.arange(modes) >= rod.modes)
        return dataclasses.replace(
            longer,
            **padded,
            length=longer.length * (xp.arange(nodes) < count),
            section=jax.tree.map(lambda leaf: leaf[index], section),
            levels=levels,
        )

    stacked: Rod = jax.tree.map(lambda *leaves: xp.stack(leaves), *map(filled, rods))
    unused: dict[str, Any] = {
        name: None
        for name in ("linear_kinematics", "chord", "stop_flexibility")
        if not decide(xp.any(getattr(stacked, name)))
    }
    return dataclasses.replace(stacked, **unused)


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
    """Rod of one notch."""
    raise unregistered("rod", notch, "flexure", "rod")


def rod_at(site: Site | None, notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Make the rod of a notch where it stands."""
    # Kinds whose ends are rigid need not know of sites.
    return rod(notch, tube, refinement) if site is None else rod(notch, tube, refinement, site)


@singledispatch
def section_fibres(notch: Any, tube: Tube) -> FibresAt:
    """Fibres about any axis, a function of the distances of the edges (mm) and their number."""
    raise unregistered("section of fibres", notch, "flexure", "section_fibres")


@singledispatch
def validity_warnings(notch: Any, tube: Tube, site: Site) -> list[str]:
    """List in sentences the dimensions for which the law of elastic ends was not checked."""
    return []


@singledispatch
def law_error(notch: Any, tube: Tube, site: Site, yields: bool) -> float:
    """Return the relative error (SD) of the stiffness of a notch with elastic ends.

    Args:
        notch: The notch.
        tube: Its tube.
        site: What surrounds it.
        yields: Whether its material is one of fibres.
    """
    # Strips and links: root mean square over cells that were computed when the law stood.
    return 0.027
