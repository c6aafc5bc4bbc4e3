"""From the description of a robot to the arrays of its chain."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._arrays import cached, xp
from notchflex._jax import constant, jax
from notchflex.mechanics.chain.arrays import Chain
from notchflex.mechanics.chain.flexures import FlexureOf, flexure
from notchflex.mechanics.chain.mass import body_lengths, body_masses
from notchflex.mechanics.chain.plane import bending_normal, tendons_in_plane
from notchflex.mechanics.chain.sites import sites_of
from notchflex.mechanics.contact import ContactGroup, build_contacts
from notchflex.mechanics.flexure import (
    Rod,
    Site,
    fibre_stretch,
    flattened,
    stack,
)
from notchflex.mechanics.flexure.rod import planar_points
from notchflex.mechanics.friction import friction_law
from notchflex.mechanics.material import SectionLaw, section_law
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.tendon import RoutedTendons, RoutingContext, TendonGroup, route
from notchflex.robot import Robot, Tendon, Tube
from notchflex.robot.kinds import Friction, Material, Notch
from notchflex.robot.part import unchecked

_UP = xp.array([0.0, 0.0, 1.0])


def assemble(
    robot: Robot,
    level: str = "tendons",
    *,
    loaded: bool = False,
    follows: bool = True,
    refinement: int = 0,
    flat: bool = True,
    flexures: FlexureOf | None = None,
) -> Chain:
    """Turn the description of a robot into the arrays of its chain.

    Args:
        robot: The description.
        level: For which loads: "tendons" alone, loads in the "plane" of bending, or in "space".
            Higher levels keep more modes.
        loaded: Whether loads other than the tendons' act.
        follows: Whether any of them may turn with a body.
        refinement: Number of refinements of the modes beyond those for usual loads.
        flat: Whether a robot that stays in a plane under such loads gets a planar chain.
        flexures: Replaces `flexure`, which builds the flexures of the notches.

    Returns:
        Its chain.

    Example:
        >>> from notchflex import load_robot
        >>> assemble(load_robot("pacheco2021-a")).flexures
        5
    """
    template = chain_template(robot, level, refinement, flexures)
    rods, routed, body_length = template.rods, template.routed_tendons, template.body_length
    body_mass, body_centre = body_masses(robot, rods)
    section = rods.section.stiffened(template.stiffness_factor[:, None])
    tendons = robot.tendon
    chain = Chain(
        rods=dataclasses.replace(rods, section=section),
        groups=routed.groups,
        contact_pairs=template.contact_pairs,
        axial_stiffness=constant([tendon.axial_stiffness for tendon in tendons]),
        free_length=routed.base_length + constant([tendon.free_length for tendon in tendons]),
        body_length=body_length,
        body_mass=constant(body_mass),
        body_centre=constant(body_centre),
        frame=None,
        notch_frame=template.notch_frame,
        tendon_entry=routed.place,
        contacts=_contacts(routed.groups, len(tendons)),
        level=level,
        loaded=loaded,
        follows=loaded and follows,  # unloaded chains are of one form
        refinement=refinement,
        window=max(
            (int(xp.max(part.back)) for part in (*routed.groups, *template.contact_pairs)),
            default=1,
        ),
        **laws(robot.material, template),
        **laws(robot.friction, template),
    )
    normal = bending_normal(robot)
    if not flat or level == "space" or normal is None or not tendons_in_plane(robot):
        return chain
    return _flat(chain, xp.stack([xp.cross(normal, _UP), normal, _UP], axis=1))


def laws(part: Material | Friction, template: ChainTemplate) -> dict[str, Any]:
    """Return the fields of a chain that follow from its material, or from its friction.

    Args:
        part: The material or the friction.
        template: Template of the robot's chain.
    """
    if isinstance(part, Friction):
        return {"friction": friction_law(part)}
    law = section_law(part)
    elastic = _elastic(template.distinct_rods, law)[template.rod_index]
    elastic = template.stiffness_factor[:, None, None] * elastic
    stiffness = (elastic * np.eye(elastic.shape[-1])).sum(axis=-1)
    stop = template.rods.stop_flexibility
    linear = law.is_linear and not template.distinct_rods.section.softens
    contact_stiffness = 1.0 / xp.sum(template.contact_motion / stiffness, axis=-1)
    return {
        "law": law,
        "stiffness": constant(stiffness),
        "elastic": constant(elastic) if linear else None,
        "contact_stiffness": constant(contact_stiffness),
        "contact_flexibility": None if stop is None else constant(stop / contact_stiffness),
        "closing_force": constant(xp.mean(contact_stiffness * template.height)),
        "stroke_stiffness": constant(xp.mean(contact_stiffness) / len(contact_stiffness)),
    }


class ChainTemplate(NamedTuple):
    """The part of a chain that depends only on the shape of the robot.

    Attributes:
        distinct_rods: The flexures, without repetitions.
        rod_index: Index of every notch's flexure among them.
        rods: All flexures.
        routed_tendons: The tendons.
        contact_pairs: The contacts.
        body_length: Length of each body on the tube axis, mm.
        notch_frame: Rotation from the frame of every notch to the tube.
        height: Length of the neutral axis of every flexure, mm.
        contact_motion: Square of the motion of each notch's contact by every mode, mm^2.
        stiffness_factor: Factor on the stiffness of each notch, which the rods are without.
    """

    distinct_rods: Rod
    rod_index: Int[np.ndarray, " n"]
    rods: Rod
    routed_tendons: RoutedTendons
    contact_pairs: tuple[ContactGroup, ...]
    body_length: Array
    notch_frame: Array
    height: Float[np.ndarray, " n"]
    contact_motion: Float[np.ndarray, "n modes"]
    stiffness_factor: Float[np.ndarray, " n"]


def chain_template(
    robot: Robot, level: str, refinement: int, flexures: FlexureOf | None = None
) -> ChainTemplate:
    """Build the template of a robot's chain; for the arguments see `assemble`."""
    chord, fibres = robot.friction.turns_with_chord, robot.material.by_fibres
    sites = sites_of(robot)
    build = _cached_template if flexures is None else partial(_build_template, flexures=flexures)
    return build(robot.tube, robot.notches, sites, robot.tendon, level, refinement, chord, fibres)


def _build_template(
    tube: Tube,
    notches: tuple[Notch, ...],
    sites: tuple[Site | None, ...],
    tendons: tuple[Tendon, ...],
    level: str,
    refinement: int,
    turns_with_chord: bool,
    by_fibres: bool,
    flexures: FlexureOf = flexure,
) -> ChainTemplate:
    # Notches that are equal but for their factor are built once.
    factor = xp.array([notch.stiffness_factor for notch in notches])
    plain = {id(notch): unchecked(notch, stiffness_factor=1.0) for notch in notches}
    notches = tuple(plain[id(notch)] for notch in notches)
    # By identity, as numbers that are traced are neither equal nor different.
    pairs = list(zip(notches, sites, strict=True))
    sited = {(id(notch), id(site)): (notch, site) for notch, site in pairs}
    built = [flexures(*each, tube, level, refinement, by_fibres) for each in sited.values()]
    own_rods, free_poses = zip(*built, strict=True)
    distinct_rods = stack(own_rods)
    order = {key: index for index, key in enumerate(sited)}
    rod_index = np.array([order[id(notch), id(site)] for notch, site in pairs])
    rods = jax.tree.map(lambda leaf: leaf[rod_index], distinct_rods)
    body_length = constant(body_lengths(tube, notches))
    lead = body_length[:-1, None] * _UP
    rods = dataclasses.replace(rods, start_offset=rods.start_offset + lead)
    free = jax.tree.map(lambda *leaves: xp.stack(leaves)[rod_index], *free_poses)
    free = Motion(free.rotation, free.translation + lead)
    context = RoutingContext(
        notches, tube.outer_radius, rods, free, body_length, turns_with_chord=turns_with_chord
    )
    directions = {notch.direction_deg: xp.empty(0) for notch in notches}
    for side in directions:
        directions[side] = xp.asarray(rotation_about(constant(_UP * xp.radians(side))))
    return ChainTemplate(
        distinct_rods,
        rod_index,
        rods,
        route(tendons, context),
        build_contacts(notches, tube, rods, body_length),
        body_length,
        constant(xp.stack([directions[notch.direction_deg] for notch in notches])),
        xp.sum(rods.length, axis=-1),
        _squared_contact_motion(rods, tube.outer_radius),
        factor,
    )


# Fits of material or friction constants assemble one shape hundreds of times.
_cached_template = cached(64)(_build_template)


def _flat(chain: Chain, frame: Float[np.ndarray, "3 3"]) -> Chain:
    """Reduce a spatial chain that stays in the x-z plane of a frame to that plane."""

    def planar(part: Any) -> Any:
        points = [name for name in ("leaves", "enters", "along", "normal") if hasattr(part, name)]
        turned = {name: planar_points(getattr(part, name) @ frame) for name in points}
        return dataclasses.replace(part, **turned)

    return dataclasses.replace(
        chain,
        rods=flattened(chain.rods, frame),
        groups=tuple(planar(group) for group in chain.groups),
        contact_pairs=tuple(planar(group) for group in chain.contact_pairs),
        frame=constant(frame),
    )


def _elastic(rods: Rod, law: SectionLaw) -> Float[np.ndarray, "n modes modes"]:
    """Compute the stiffness of every flexure in the free robot; 1 for padding modes."""
    basis = rods.basis
    stiffness_product = rods.length[..., None, None] * (law.stiffness(rods.section) @ basis)
    own = xp.einsum("niam,niak->nmk", basis, stiffness_product)
    return own + rods.padding_mask[:, None] * xp.eye(rods.modes)


def _squared_contact_motion(rods: Rod, outer_radius: float) -> Float[np.ndarray, "n modes"]:
    """Compute the squared motion of a notch's contact by its modes; over stiffness a flexibility.

    A contact opposite a spine moves with its fibre; an edge contact by its distance from the tube
    axis times the rotation of the distal body.
    """
    fibre = xp.einsum("nc,nicm,ni->nm", fibre_stretch(rods.closure), rods.basis, rods.length)
    turn = outer_radius * (rods.start_rotation @ rods.turn[:, -1, :, 1:])[:, :2]
    squared = xp.where(rods.has_closure[:, None] > 0.0, fibre**2, xp.sum(turn**2, axis=1))
    return squared * (1.0 - rods.padding_mask)


def _contacts(groups: tuple[TendonGroup, ...], tendons: int) -> Int[Array, "t edges"]:
    """List the edges that every tendon touches, base to tip: two per body that it visits."""
    contact_edges: list[np.ndarray] = [xp.zeros(0, int)] * tendons
    for group in groups:
        for column, number in enumerate(group.numbers):
            flexures = xp.flatnonzero(xp.asarray(group.visits)[:, column])
            contact_edges[number] = (2 * flexures[:, None] + xp.arange(2)).ravel()
    max_edges = max(len(edges) for edges in contact_edges)
    filled = [
        xp.pad(edges, (0, max_edges - len(edges)), constant_values=-1) for edges in contact_edges
    ]
    return cast("Array", xp.stack(filled))
