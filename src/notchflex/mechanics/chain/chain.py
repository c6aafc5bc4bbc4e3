"""The chain: all that the solver needs of a robot, as one pytree of arrays."""

from __future__ import annotations

import dataclasses
from functools import lru_cache, partial
from typing import Any, NamedTuple, cast

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import constant, jax, jnp
from notchflex._pytree import Pytree, static
from notchflex.mechanics.chain.flexures import FlexureOf, flexure
from notchflex.mechanics.chain.mass import body_lengths, body_masses
from notchflex.mechanics.chain.plane import bending_normal, tendons_in_plane
from notchflex.mechanics.chain.sites import sites_of
from notchflex.mechanics.contact import ContactGroup, build_contacts
from notchflex.mechanics.flexure import (
    FlexureState,
    Rod,
    Site,
    fibre_stretch,
    flattened,
    flexure_state,
    in_space,
    stack,
)
from notchflex.mechanics.flexure.plane import planar_points
from notchflex.mechanics.friction import FrictionLaw, friction_law
from notchflex.mechanics.material import SectionLaw, section_law
from notchflex.mechanics.motion import Motion, rotation_about
from notchflex.mechanics.tendon import RoutedTendons, RoutingContext, TendonGroup, route
from notchflex.robot import Robot, Tendon, Tube
from notchflex.robot.kinds import Friction, Material, Notch

# Axial stiffness of a tendon that only tells apart how much has slid over two stuck contacts of
# one rigid piece, between which an inextensible tendon would leave the tension open: so many
# times the force that would close a notch by its own stiffness (1e6 N for wrist A).
MEMORY_STIFFNESS = 4e5
_UP = np.array([0.0, 0.0, 1.0])


class Chain(Pytree):
    """Bodies 0 (the base) to n joined by n flexures, with t tendons. Units mm, N, rad.

    Attributes:
        rods: The flexures, each from the frame of body j - 1 to that of body j. A body's frame
            lies on the tube axis at its proximal face.
        law: The material.
        friction: The friction between tendons and tube.
        groups: The tendons, by the way they run.
        contact_pairs: The lips that close notches, by their kind.
        axial_stiffness: Axial stiffness of each tendon, infinite where inextensible, N.
        free_length: Length of each tendon before its first contact, from its actuator on and
            through the base, mm.
        body_length: Length of each body on the tube axis, mm.
        body_mass: Mass of each body, g; 0 where the material has no density.
        body_centre: Its centre, in its frame, mm.
        stiffness: Stiffness of each mode in the free robot, N mm; the scale of residuals.
        elastic: Stiffness of the modes of each flexure against each other, N mm, where the
            material is linear; None where the law of the material must be asked.
        contact_stiffness: Stiffness of each notch at its lips in the free robot, N/mm.
        contact_flexibility: Flexibility of the lips of each closed notch, mm/N; None where all are
            rigid.
        closing_force: Force that would close a notch by that stiffness, mean of all, N.
        stroke_stiffness: How fast the tension of a tendon answers its stroke, roughly, N/mm.
        frame: Rotation from the frame in which flexures, tendons and lips are given to that of the
            base: x and z span the plane of bending of a flat chain. None in space.
        notch_frame: Rotation from the frame of every notch, turned by its direction, to the tube.
        tendon_place: Where each tendon enters the base, mm.
        contacts: For every tendon, at which edges of which gaps it meets the wall: indices into
            (flexure, edge) flattened, -1 to fill up.
        level: For which loads the flexures have modes enough.
        loaded: Whether loads other than the tendons' act.
        follows: Whether any of them may turn with a body.
        refinement: How many more modes the flexures have than for usual loads.
        window: Over how many flexures a span or an opening reaches at most.
    """

    rods: Rod
    law: SectionLaw
    friction: FrictionLaw
    groups: tuple[TendonGroup, ...]
    contact_pairs: tuple[ContactGroup, ...]
    axial_stiffness: Float[Array, " t"]
    free_length: Float[Array, " t"]
    body_length: Float[Array, " bodies"]
    body_mass: Float[Array, " bodies"]
    body_centre: Float[Array, "bodies 3"]
    stiffness: Float[Array, "n modes"]
    elastic: Float[Array, "n modes modes"] | None
    contact_stiffness: Float[Array, " n"]
    contact_flexibility: Float[Array, " n"] | None
    closing_force: Float[Array, ""]
    stroke_stiffness: Float[Array, ""]
    frame: Float[Array, "3 3"] | None
    notch_frame: Float[Array, "n 3 3"]
    tendon_place: Float[Array, "t 3"]
    contacts: Int[Array, "t edges"]
    level: str = static()
    loaded: bool = static()
    follows: bool = static()
    refinement: int = static()
    window: int = static()

    @property
    def flexures(self) -> int:
        """Number of flexures."""
        return self.stiffness.shape[0]

    @property
    def tendons(self) -> int:
        """Number of tendons."""
        return self.axial_stiffness.shape[0]

    @property
    def tendon_order(self) -> Int[np.ndarray, " t"]:
        """Numbers of the tendons, group by group."""
        return np.array([number for group in self.groups for number in group.numbers], int)

    @property
    def remembers(self) -> bool:
        """Whether a solved state depends on the one before, by friction or by the material."""
        return self.friction.remembers or self.law.remembers

    @property
    def forces_on_bodies(self) -> bool:
        """Whether any force acts on a body, so that poses enter the balance."""
        parts = (*self.groups, *self.contact_pairs)
        return self.loaded or any(part.acts_on_bodies for part in parts)

    @property
    def memory_stiffness(self) -> Float[Array, " t"]:
        """Axial stiffness that the memory of the contacts uses, always finite, N."""
        return jnp.minimum(self.axial_stiffness, MEMORY_STIFFNESS * self.closing_force)


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


def flexure_states(
    chain: Chain, modes: Float[Array, "n modes"], memory: Any, *, with_pose: bool
) -> FlexureState:
    """State of all flexures at once, after a memory of the material at every node."""
    rods, law = chain.rods, chain.law
    strain = in_space(jnp.einsum("nicm,nm->nic", rods.basis, modes))
    response = law.respond_all(strain, rods.section, memory)
    state = partial(flexure_state, with_pose=with_pose)
    return jax.vmap(state, in_axes=(0, None, 0, 0, 0))(rods, law, memory, modes, response)


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
