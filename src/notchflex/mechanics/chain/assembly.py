"""From the description of a robot to the arrays of its chain."""

from __future__ import annotations

import dataclasses
from functools import lru_cache, partial
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float, Int

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

_UP = np.array([0.0, 0.0, 1.0])


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
            More modes of the flexures are kept the more is asked for.
        loaded: Whether loads other than the tendons' act.
        follows: Whether any of them may turn with a body.
        refinement: How many times more modes than the flexures need for usual loads.
        flat: Whether a robot that stays in a plane, under such loads, is given as one of the plane.
        flexures: Gives the flexures of the notches in the place of `flexure`.

    Returns:
        Its chain.

    Example:
        >>> from notchflex import load_robot
        >>> assemble(load_robot("pacheco2021-a")).flexures
        5
    """
    shaped = shape_of(robot, level, refinement, flexures)
    rods, laid, body_length = shaped.rods, shaped.laid, shaped.body_length
    body_mass, body_centre = body_masses(robot, rods)
    tendons = robot.tendon
    chain = Chain(
        rods=rods,
        groups=laid.groups,
        contact_pairs=shaped.contact_pairs,
        axial_stiffness=constant([tendon.axial_stiffness for tendon in tendons]),
        free_length=constant(laid.base_length + [tendon.free_length for tendon in tendons]),
        body_length=body_length,
        body_mass=constant(body_mass),
        body_centre=constant(body_centre),
        frame=None,
        notch_frame=shaped.notch_frame,
        tendon_place=laid.place,
        contacts=_contacts(laid.groups, len(tendons)),
        level=level,
        loaded=loaded,
        follows=loaded and follows,  # unloaded chains are of one form
        refinement=refinement,
        window=max(
            (int(np.max(part.back)) for part in (*laid.groups, *shaped.contact_pairs)), default=1
        ),
        **laws(robot.material, shaped),
        **laws(robot.friction, shaped),
    )
    normal = bending_normal(robot)
    if not flat or level == "space" or normal is None or not tendons_in_plane(robot):
        return chain
    return _flat(chain, np.stack([np.cross(normal, _UP), normal, _UP], axis=1))


def laws(part: Material | Friction, shaped: Shaped) -> dict[str, Any]:
    """Return the fields of a chain that follow from its material, or from its friction.

    Args:
        part: The material or the friction.
        shaped: The shape of the robot.
    """
    if isinstance(part, Friction):
        return {"friction": friction_law(part)}
    law = section_law(part)
    elastic = _elastic(shaped.alike, law)[shaped.which]
    stiffness = np.einsum("nmm->nm", elastic)
    stop = shaped.rods.stop_flexibility
    linear = law.is_linear and not shaped.alike.section.softens
    contact_stiffness = 1.0 / np.sum(shaped.lip_slope / stiffness, axis=-1)
    return {
        "law": law,
        "stiffness": constant(stiffness),
        "elastic": constant(elastic) if linear else None,
        "contact_stiffness": constant(contact_stiffness),
        "contact_flexibility": None if stop is None else constant(stop / contact_stiffness),
        **averages(contact_stiffness, shaped.height),
    }


def averages(
    contact_stiffness: Float[np.ndarray, " n"], height: Float[np.ndarray, " n"]
) -> dict[str, Any]:
    """Return the fields of a chain to which every notch contributes, linear in each argument.

    Args:
        contact_stiffness: Stiffness of every notch against closing, N/mm.
        height: Length of the neutral axis of every flexure, mm.
    """
    count = len(contact_stiffness)
    return {
        "closing_force": constant(contact_stiffness @ height / count),
        "stroke_stiffness": constant(contact_stiffness.sum() / count**2),
    }


class Shaped(NamedTuple):
    """What of a chain follows from the shape of the robot alone.

    Attributes:
        alike: The flexures that differ.
        which: Which of them each notch is.
        rods: All flexures.
        laid: The tendons.
        contact_pairs: The lips.
        body_length: Length of each body on the tube axis, mm.
        notch_frame: Rotation from the frame of every notch to the tube.
        height: Length of the neutral axis of every flexure, mm.
        lip_slope: Square of the motion of each notch's lips by every mode, mm^2.
    """

    alike: Rod
    which: list[int]
    rods: Rod
    laid: RoutedTendons
    contact_pairs: tuple[ContactGroup, ...]
    body_length: Array
    notch_frame: Array
    height: Float[np.ndarray, " n"]
    lip_slope: Float[np.ndarray, "n modes"]


def shape_of(
    robot: Robot, level: str, refinement: int, flexures: FlexureOf | None = None
) -> Shaped:
    """What of a robot's chain follows from its shape alone; for the arguments see `assemble`."""
    chord, fibres = robot.friction.turns_with_chord, robot.material.by_fibres
    sites = sites_of(robot)
    shaped = _kept_shape if flexures is None else partial(_shaped, flexures=flexures)
    return shaped(robot.tube, robot.notches, sites, robot.tendon, level, refinement, chord, fibres)


def _shaped(
    tube: Tube,
    notches: tuple[Notch, ...],
    sites: tuple[Site | None, ...],
    tendons: tuple[Tendon, ...],
    level: str,
    refinement: int,
    turns_with_chord: bool,
    by_fibres: bool,
    flexures: FlexureOf = flexure,
) -> Shaped:
    # Notches that are alike are worked out once.
    placed = tuple(zip(notches, sites, strict=True))
    different = dict.fromkeys(placed)
    unlike = {each: flexures(*each, tube, level, refinement, by_fibres) for each in different}
    own_rods, free_poses = zip(*unlike.values(), strict=True)
    alike = stack(own_rods)
    number = {each: index for index, each in enumerate(unlike)}
    which = [number[each] for each in placed]
    rods = jax.tree.map(lambda leaf: leaf[which], alike)
    body_length = constant(body_lengths(tube, notches))
    lead = body_length[:-1, None] * _UP
    rods = dataclasses.replace(rods, start_offset=rods.start_offset + lead)
    free = jax.tree.map(lambda *leaves: np.stack(leaves)[which], *free_poses)
    free = Motion(free.rotation, free.translation + lead)
    ground = RoutingContext(
        notches, tube.outer_radius, rods, free, body_length, turns_with_chord=turns_with_chord
    )
    directions = {notch.direction_deg: np.empty(0) for notch in notches}
    for side in directions:
        directions[side] = np.asarray(rotation_about(constant(_UP * np.radians(side))))
    return Shaped(
        alike,
        which,
        rods,
        route(tendons, ground),
        build_contacts(notches, tube, rods, body_length),
        body_length,
        constant(np.stack([directions[notch.direction_deg] for notch in notches])),
        np.sum(rods.length, axis=-1),
        _lip_slope(rods, tube.outer_radius),
    )


# A search for constants of the material or of friction assembles one shape hundreds of times.
_kept_shape = lru_cache(maxsize=64)(_shaped)


def _flat(chain: Chain, frame: Float[np.ndarray, "3 3"]) -> Chain:
    """A chain of the plane that x and z of a frame span, from one of space that stays in it."""

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
    """Stiffness of every flexure in the free robot; 1 for modes that fill up."""
    basis = rods.basis
    answered = rods.length[..., None, None] * (law.stiffness(rods.section) @ basis)
    own = np.einsum("niam,niak->nmk", basis, answered)
    return own + rods.padding_mask[:, None] * np.eye(rods.modes)


def _lip_slope(rods: Rod, outer_radius: float) -> Float[np.ndarray, "n modes"]:
    """Square of the motion of a notch's lips by its modes: over their stiffness, its flexibility.

    Lips opposite a spine move with their fibre; where edges meet, by their distance from the
    tube axis times the turn of the distal body.
    """
    fibre = np.einsum("nc,nicm,ni->nm", fibre_stretch(rods.closure), rods.basis, rods.length)
    turn = rods.start_rotation @ rods.turn[:, -1, :, 1:]
    edge = outer_radius * np.linalg.norm(turn[:, :2], axis=1)
    slope = np.where(rods.has_closure[:, None] > 0.0, fibre, edge)
    return slope**2 * (1.0 - rods.padding_mask)


def _contacts(groups: tuple[TendonGroup, ...], tendons: int) -> Int[Array, "t edges"]:
    """Where every tendon meets the wall, base to tip: twice as many edges as bodies visited."""
    met: list[np.ndarray] = [np.zeros(0, int)] * tendons
    for group in groups:
        for column, number in enumerate(group.numbers):
            flexures = np.flatnonzero(np.asarray(group.visits)[:, column])
            met[number] = (2 * flexures[:, None] + np.arange(2)).ravel()
    most = max(len(edges) for edges in met)
    filled = [np.pad(edges, (0, most - len(edges)), constant_values=-1) for edges in met]
    return cast("Array", np.stack(filled))
