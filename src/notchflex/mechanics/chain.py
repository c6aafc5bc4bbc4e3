"""The chain: the solver's model of a robot as one pytree of arrays, and how a robot becomes one.

Units mm, N, rad. Strains and rotations that are zero whatever the numbers of the robot file are
structural: programs omit the products with them (a mode that stretches a rod never rotates it).
The zeros of a rod that happens to be straight are not structural.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._arrays import cached, plain_number, xp
from notchflex._jax import Pytree, constant, jax, jnp, static
from notchflex.mechanics.contact import ContactGroup, build_contacts
from notchflex.mechanics.corner_factor import corner_factors
from notchflex.mechanics.flexure import (
    FlexureState,
    Rod,
    Site,
    fibre_stretch,
    flattened,
    flexure_state,
    law_error,
    relative_pose,
    rod_at,
    section_fibres,
    stack,
    validity_warnings,
    with_level,
)
from notchflex.mechanics.friction import FrictionLaw, friction_law
from notchflex.mechanics.masses import body_lengths, body_masses
from notchflex.mechanics.material import Fibres, Law, LimitLine, MixedLaw, section_law
from notchflex.mechanics.motion import IN_PLANE, Motion, rotation_about
from notchflex.mechanics.ring import Side
from notchflex.mechanics.section import FIBRES, fitted
from notchflex.mechanics.sheath import Sheath, build_sheath
from notchflex.mechanics.tendon import TUBE_AXIS, TendonGroup, route
from notchflex.robot import Fatigue, Robot, Tendon, Tube
from notchflex.robot.kinds import Notch
from notchflex.robot.part import unchecked


class Chain(Pytree):
    """Bodies 0 (the base) to n joined by n flexures, with t tendons."""

    # The flexures, each from the frame of body j - 1 to that of body j. A body's frame lies on the
    # tube axis at its proximal face
    rods: Rod
    law: Law  # The material, or the materials of the flexures
    # Temperature from which loads warm the one that moves with it, deg C; None where none does
    temperature: Float[Array, ""] | None
    friction: FrictionLaw  # The friction between tendons and tube
    groups: tuple[TendonGroup, ...]  # The tendons, by the way they run
    contact_pairs: tuple[ContactGroup, ...]  # The contacts that close notches, by kind
    # Axial stiffness of each tendon, infinite where inextensible, N
    axial_stiffness: Float[Array, " t"]
    # Length of each tendon before its first contact, from its actuator on and through the base, mm
    free_length: Float[Array, " t"]
    sheath: Sheath | None  # The sheaths between drives and base; None where there are none
    body_length: Float[Array, " bodies"]  # Length of each body on the tube axis, mm
    body_mass: Float[Array, " bodies"]  # Mass of each body, g; 0 where the material has no density
    body_centre: Float[Array, "bodies 3"]  # Its centre, in its frame, mm
    # Stiffness of each mode in the free robot, N mm; the scale of residuals
    stiffness: Float[Array, "n modes"]
    # Stiffness of the modes of each flexure against each other, N mm, where the material is linear;
    # None where the law of the material gives it
    elastic: Float[Array, "n modes modes"] | None
    # Stiffness of each notch at its contact in the free robot, N/mm
    contact_stiffness: Float[Array, " n"]
    # Flexibility of the contact of each closed notch, mm/N; None where all are rigid
    contact_flexibility: Float[Array, " n"] | None
    # Force that would close a notch by that stiffness, mean of all, N
    closing_force: Float[Array, ""]
    stroke_stiffness: Float[Array, ""]  # Approximate tension per stroke of a tendon, N/mm
    # Rotation from the frame of flexures, tendons and contacts to that of the base: x and z span
    # the plane of bending of a flat chain. None in space
    frame: Float[Array, "3 3"] | None
    # Rotation from the frame of every notch, turned by its direction, to the tube
    notch_frame: Float[Array, "n 3 3"]
    tendon_entry: Float[Array, "t 3"]  # Point where each tendon enters the base, mm
    # For every tendon, the edges of gaps that it touches: indices into (flexure, edge) flattened,
    # -1 as padding
    contacts: Int[Array, "t edges"]
    limit: LimitLine | None  # The limit line of fatigue; None where the robot has none
    level: str = static()  # Loads for which the flexures have enough modes
    loaded: bool = static()  # Whether loads other than the tendons' act
    follows: bool = static()  # Whether any of them may turn with a body
    refinement: int = static()  # Number of refinements of the modes beyond those for usual loads
    window: int = static()  # Largest number of flexures that a span or an opening reaches over

    @property
    def flexures(self) -> int:
        """Number of flexures."""
        return self.stiffness.shape[0]

    @property
    def tendons(self) -> int:
        """Number of tendons."""
        return self.axial_stiffness.shape[0]

    @property
    def inextensible(self) -> Array:
        """Whether each tendon keeps its length, that of its wire in a sheath included."""
        rigid = xp.isinf(self.axial_stiffness)
        return rigid if self.sheath is None else rigid & (self.sheath.compliance == 0.0)

    @property
    def tendon_order(self) -> Int[Array, " t"]:
        """Numbers of the tendons, group by group."""
        return xp.array([number for group in self.groups for number in group.numbers], int)

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
    def options(self) -> dict[str, Any]:
        """What it was assembled for, as `assemble` takes it."""
        return {
            "level": self.level,
            "loaded": self.loaded,
            "follows": self.follows,
            "refinement": self.refinement,
            "flat": self.frame is not None,
        }

    @property
    def memory_stiffness(self) -> Float[Array, " t"]:
        """Axial stiffness that the memory of the contacts uses, always finite, N."""
        # For wrist A 1e6 N. It distinguishes the slip over two sticking contacts of one rigid
        # piece, between which an inextensible tendon would leave the tension undetermined.
        return jnp.minimum(self.axial_stiffness, 4e5 * self.closing_force)


def flexure_states(
    chain: Chain, modes: Float[Array, "n modes"], memory: Any, *, with_pose: bool
) -> FlexureState:
    """Return the state of all flexures at once, after a memory of the material at every node."""
    state = partial(flexure_state, with_pose=with_pose)
    return jax.vmap(state, (0, chain.law.axis, 0, 0))(chain.rods, chain.law, memory, modes)


def structural(chain: Chain, still: Sequence[int]) -> Chain:
    """Mark the numbers of a chain that may be constants; its modes `still` turn no place."""
    # They are the strains, rotations and displacements of a rod by its modes, the stiffness between
    # modes, counts and flags. The mask of padding flexures is not: chains of other lengths share
    # the program. A mode that turns nothing (stretch, shear) has no pairs with a precurvature
    # either; those of others may be 0 in a straight rod, and yet have slopes.

    marks: Any = jax.tree.map(
        lambda leaf: np.full(np.shape(leaf), xp.asarray(leaf).dtype.kind != "f"), chain
    )
    rods, everything, of_modes = marks.rods, np.s_[...], np.s_[..., 1:]
    marked = [(rods.basis, everything), (rods.node_reach, everything), (marks.elastic, everything)]
    marked += [(leaf, of_modes) for leaf in (rods.turn, rods.step, rods.node_turn)]
    without = [1 + mode for mode in still]
    pairs = np.s_[..., 1:, 1:], np.s_[..., without, 0], np.s_[..., 0, without]
    for leaf, place in [*marked, *((rods.turn_pair, place) for place in pairs)]:
        if leaf is not None:
            leaf[place] = True
    return marks


# Numbers of a rod that are 0 where a flexure is added beyond the tip.
_ZERO_BEYOND_THE_TIP = (
    "start_offset",
    "curve_offset",
    "end_offset",
    "node_offset",
    "reference_strain",
    "basis",
    "turn",
    "turn_pair",
    "step",
    "node_turn",
    "has_closure",
    "chord",
)


def padded(chain: Chain, flexures: int, edges: int) -> Chain:
    """Pad a chain with flexures beyond its tip, and with entries for contact edges."""
    # The added flexures are stiff, straight, of zero length and without tendons: the last body's
    # frame is then the tip, and no other number of the robot changes.
    more, spare = flexures - chain.flexures, edges - chain.contacts.shape[1]
    chain = replace(
        chain, contacts=xp.pad(chain.contacts, ((0, 0), (0, spare)), constant_values=-1)
    )
    if more == 0:
        return chain
    index = np.minimum(np.arange(flexures), chain.flexures - 1)

    def longer(part: Any, **values: Any) -> Any:
        """Repeat the last entry of arrays; set the added entries of some to a value."""
        repeated = jax.tree.map(lambda leaf: leaf[index], part)
        for name, value in values.items():
            if (leaf := getattr(repeated, name)) is not None:
                leaf[-more:] = value
        return repeated

    rods = chain.rods
    nothing = dict.fromkeys(_ZERO_BEYOND_THE_TIP, 0.0)
    rotations = ("start_rotation", "curve_rotation", "end_rotation", "node_rotation")
    unturned = dict.fromkeys(rotations, xp.eye(rods.start_rotation.shape[-1]))
    rods = longer(rods, padding_mask=1.0, **nothing, **unturned)
    # The first added flexure begins at the tip, at the end of the last body.
    rods.start_offset[chain.flexures, -1] = chain.body_length[-1]
    stiffness, elastic = longer((chain.stiffness, chain.elastic))
    stiffness[-more:] = 1.0
    if elastic is not None:
        elastic[-more:] = np.eye(chain.rods.modes)
    idle = {"present": 0.0, "visits": 0.0, "ends": 0.0, "back": 1, "body_length": 0.0}
    others = "limit", "contact_stiffness", "contact_flexibility", "notch_frame"
    bodies = {name: getattr(chain, name) for name in ("body_length", "body_mass", "body_centre")}
    return replace(
        chain,
        rods=rods,
        law=chain.law if chain.law.axis is None else longer(chain.law),
        groups=tuple(longer(group, **idle) for group in chain.groups),
        contact_pairs=tuple(longer(pair, has_contact=0.0, back=1) for pair in chain.contact_pairs),
        stiffness=stiffness,
        elastic=elastic,
        **{name: longer(getattr(chain, name)) for name in others},
        **{k: np.pad(v, [(0, more)] + [(0, 0)] * (v.ndim - 1)) for k, v in bodies.items()},
    )


# Whether a robot stays in one plane under its tendons alone.


@cached(64)
def bending_normal(robot: Robot) -> Float[Array, " 3"] | None:
    """Return the normal of the plane in which all notches bend, in the base frame, or None."""
    direction = xp.radians([notch.direction_deg for notch in robot.notches])
    off_plane = (xp.abs(xp.sin(direction - direction[0])) > 1e-12).any()
    if off_plane or not all(notch.stays_in_plane for notch in robot.notches):
        return None
    return xp.array([-xp.sin(direction[0]), xp.cos(direction[0]), 0.0])


@cached(64)
def tendons_in_plane(robot: Robot) -> bool:
    """Return whether every tendon runs in the one plane in which all notches bend."""
    normal = bending_normal(robot)
    if normal is None:
        return False
    sides = [tendon.holes[1] if tendon.holes else [tendon.direction_deg] for tendon in robot.tendon]
    direction = xp.radians(xp.concatenate(sides))
    return bool(
        (xp.abs(xp.cos(direction) * normal[0] + xp.sin(direction) * normal[1]) < 1e-9).all()
    )


# The rings beside every notch, as notches with elastic ends need them.


def _is_turned(direction_deg: float, other_deg: float) -> bool:
    """Return whether two directions differ by more than the rounding of sums of angles."""
    return abs(math.remainder(direction_deg - other_deg, 360.0)) > 1e-6


def tip_anchor(robot: Robot) -> Any:
    """Return the mean radius of the tendons that end at the last notch, where it bends to; or 0."""
    side, last = robot.notches[-1].direction_deg, robot.number_of_notches
    radii = [
        tendon.radius
        for tendon in robot.tendon
        if tendon.end_body in (None, last) and not _is_turned(tendon.direction_deg, side)
    ]
    return sum(radii) / max(len(radii), 1)


def sites_of(robot: Robot) -> tuple[Site | None, ...]:
    """Return the rings beside every notch; None for notches that do not depend on them."""
    # A rigid plate holds the base at its length before the first notch. The ring after the last
    # notch is free. Where neighbours differ, each models the ring between them as if both were of
    # its own kind and opened to its own side.
    notches = robot.notches
    if not any(notch.has_elastic_ends for notch in notches):
        return (None,) * len(notches)
    lengths = [plain_number(length) for length in body_lengths(robot.tube, notches)]
    anchor = plain_number(tip_anchor(robot))
    # Ring i lies before notch i, and the last one behind all.
    boundaries: list[Any] = ["clamped", *["between"] * (len(notches) - 1), "free"]
    around = [notches[0], *notches, notches[-1]]
    shared: dict[tuple[Any, ...], Site] = {}  # where all around is of the same parts

    def side(ring: int, notch: Notch, other: Notch) -> Side:
        turned = _is_turned(notch.direction_deg, other.direction_deg)
        is_last = ring == len(notches)
        return Side(boundaries[ring], lengths[ring], turned, anchor if is_last else 0.0)

    def site(index: int) -> Site | None:
        before, notch, after = around[index : index + 3]
        if not notch.has_elastic_ends:
            return None
        sides = side(index, notch, before), side(index + 1, notch, after)
        key = (*map(id, (before, notch, after)), *boundaries[index : index + 2])
        return shared.setdefault(key, Site(*sides, robot.materials[index + 1].poisson_ratio))

    return tuple(map(site, range(len(notches))))


def law_errors(robot: Robot) -> dict[str, float]:
    """Return relative errors (SD) of the stiffness by finite elements, under the names of notches.

    Where all notches have elastic ends, `notch` has the mean square of all but the last. Else every
    notch with such ends has its own.
    """
    parts = zip(robot.notches, robot.tubes[1:], sites_of(robot), robot.materials[1:], strict=True)
    each = {
        f"notch[{number}]": law_error(notch, tube, site, material.by_fibres)
        for number, (notch, tube, site, material) in enumerate(parts, 1)
        if site is not None
    }
    count = robot.number_of_notches
    if len(each) < count:
        return each
    *others, last = each.values()
    return {"notch": float(np.sqrt(np.mean(np.square(others or [last])))), f"notch[{count}]": last}


def unchecked_dimensions(robot: Robot) -> list[str]:
    """Say where dimensions of notches with elastic ends leave the range that was checked."""
    notches_of: dict[str, list[str]] = {}
    sites = sites_of(robot)
    for number, (notch, site) in enumerate(zip(robot.notches, sites, strict=True), 1):
        if site is not None:
            for warning in validity_warnings(notch, robot.tubes[number], site):
                notches_of.setdefault(warning, []).append(str(number))
    if not notches_of:
        return []

    def numbered(numbers: list[str]) -> str:
        if len(numbers) == len(sites) > 1:
            return "all notches"
        return f"notch{'es' if len(numbers) > 1 else ''} {', '.join(numbers)}"

    warnings = [f"{warning} ({numbered(numbers)})" for warning, numbers in notches_of.items()]
    return [
        f"finite elements did not check all dimensions of this robot: {'; '.join(warnings)}. Widen "
        "the band by a tolerance of `notch.stiffness_factor`, or check a notch by `export`."
    ]


def limit_line(fatigue: Fatigue, robot: Robot) -> LimitLine | None:
    """Return a limit line of fatigue with the factors of a robot's corners; None without a line."""
    facts, notches, radius = fatigue.facts, robot.notches, fatigue.corner_radius
    if not facts:
        return None
    given = fatigue.corner_factor
    factors = xp.full(len(notches), 1.0 if given is None else given)
    if radius is not None:
        lengths = body_lengths(robot.tube, notches)
        factors = corner_factors(radius, notches, robot.tubes[1:], lengths)
    factors = xp.where(np.array([notch.is_round for notch in notches]), 1.0, factors)  # no corners
    mean, amplitude = (
        constant(xp.tile(xp.array(facts[key]), (len(notches), 1))) for key in ("mean", "amplitude")
    )
    return LimitLine(mean, amplitude, constant(factors))


# One flexure of a chain: the rod of a notch with the modes that the loads need, and its fibres.


def with_fibres(rod: Rod, notch: Any, tube: Tube, refinement: int = 0) -> Rod:
    """Return the rod of a notch with the fibres of its sections; refinement takes more of them."""
    count = FIBRES * (1 + refinement)
    section = rod.section
    points = section_fibres(notch, tube)(section.edge_near, section.edge_spine, count)
    points = fitted(points, section.area, section.second_moment_weak)
    fibres = Fibres(*map(constant, points))
    return replace(rod, section=replace(section, fibres=fibres))


@cached(512)
def flexure(
    notch: Notch, site: Site | None, tube: Tube, level: str, refinement: int, by_fibres: bool
) -> tuple[Rod, Motion]:
    """Make a flexure without its factor on stiffness, and its pose in the free robot; cached."""
    tube = notch.tube or tube
    rod = with_level(rod_at(site, notch, tube, refinement), level)
    rod = with_fibres(rod, notch, tube, refinement) if by_fibres else rod
    return rod, relative_pose(rod, xp.zeros(rod.modes))


def assemble(
    robot: Robot,
    level: str = "tendons",
    *,
    loaded: bool = False,
    follows: bool = True,
    refinement: int = 0,
    flat: bool = True,
    flexures: Callable[..., Any] | None = None,
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
    chord, fibres = robot.friction.turns_with_chord, by_fibres(robot)
    sites, tendons = sites_of(robot), robot.tendon
    shape = robot.tube, robot.notches, sites, tendons, level, refinement, chord, fibres
    template = _template(*shape, flexures or flexure)
    rods, groups, body_length = template.rods, template.groups, template.body_length
    body_mass, body_centre = body_masses(robot, rods)
    section = rods.section.stiffened(template.stiffness_factor[:, None])
    chain = Chain(
        rods=replace(rods, section=section),
        groups=groups,
        contact_pairs=template.contact_pairs,
        axial_stiffness=constant([tendon.axial_stiffness for tendon in tendons]),
        free_length=template.base_length + constant([tendon.free_length for tendon in tendons]),
        sheath=build_sheath(tendons),
        body_length=body_length,
        body_mass=body_mass,
        body_centre=body_centre,
        frame=None,
        notch_frame=template.notch_frame,
        tendon_entry=template.tendon_entry,
        contacts=_contacts(groups, len(tendons)),
        limit=limit_line(robot.fatigue, robot),
        level=level,
        loaded=loaded,
        follows=loaded and follows,  # unloaded chains are of one form
        refinement=refinement,
        window=max(
            (int(xp.max(part.back)) for part in (*groups, *template.contact_pairs)),
            default=1,
        ),
        friction=friction_law(robot.friction),
        **_of_materials(robot, template),
    )
    normal = bending_normal(robot)
    if not flat or level == "space" or normal is None or not tendons_in_plane(robot):
        return chain
    return _flat(chain, xp.stack([xp.cross(normal, TUBE_AXIS), normal, TUBE_AXIS], axis=1))


def by_fibres(robot: Robot) -> bool:
    """Return whether any of the laws of a robot sums up the fibres of a section."""
    return any(material.by_fibres for material in robot.materials)


def _of_materials(robot: Robot, template: ChainTemplate) -> dict[str, Any]:
    """Return the fields of a chain that follow from its materials."""
    rods, index, law = template.distinct_rods, template.rod_index, section_law(robot.material)
    sources = [notch.made_of(robot.material) for notch in robot.notches]
    # Of the form of the robot alone: equal materials of several notches are several.
    if all(source is robot.material for source in sources):
        stiffness = law.stiffness(rods.section)
    else:
        known, rods, index = {id(s): section_law(s) for s in sources}, template.rods, ...
        laws = [known[id(source)] for source in sources]
        sections = [jax.tree.map(operator.itemgetter(k), rods.section) for k in range(len(laws))]
        stiffness = xp.stack([*map(Law.stiffness, laws, sections)])
        law = MixedLaw.of(laws)
    used_at = (getattr(source, "used_at", None) for source in sources)
    weighted = rods.length[..., None, None] * (stiffness @ rods.basis)
    elastic = xp.einsum("niam,niak->nmk", rods.basis, weighted)
    elastic = elastic + rods.padding_mask[:, None] * xp.eye(rods.modes)
    elastic = template.stiffness_factor[:, None, None] * elastic[index]
    stiffness = (elastic * np.eye(elastic.shape[-1])).sum(axis=-1)
    stop = template.rods.stop_flexibility
    linear = law.is_linear and not rods.section.softens
    contact_stiffness = 1.0 / xp.sum(template.contact_motion / stiffness, axis=-1)
    return {
        "law": law,
        "temperature": next((constant(at) for at in used_at if at is not None), None),
        "stiffness": stiffness,
        "elastic": elastic if linear else None,
        "contact_stiffness": contact_stiffness,
        "contact_flexibility": None if stop is None else stop / contact_stiffness,
        "closing_force": constant(xp.mean(contact_stiffness * template.height)),
        "stroke_stiffness": constant(xp.mean(contact_stiffness) / len(contact_stiffness)),
    }


class ChainTemplate(NamedTuple):
    """The part of a chain that depends only on the shape of the robot."""

    distinct_rods: Rod  # The flexures, without repetitions
    rod_index: Int[Array, " n"]  # Index of every notch's flexure among them
    rods: Rod  # All flexures
    groups: tuple[TendonGroup, ...]  # The tendons
    tendon_entry: Float[Array, "t 3"]  # Point where each of them enters the base, mm
    base_length: Float[Array, " t"]  # Its length inside the base, mm
    contact_pairs: tuple[ContactGroup, ...]  # The contacts
    body_length: Array  # Length of each body on the tube axis, mm
    notch_frame: Array  # Rotation from the frame of every notch to the tube
    height: Float[Array, " n"]  # Length of the neutral axis of every flexure, mm
    # Square of the motion of each notch's contact by every mode, mm^2
    contact_motion: Float[Array, "n modes"]
    # Factor on the stiffness of each notch, which the rods are without
    stiffness_factor: Float[Array, " n"]


# Fits of material or friction constants assemble one shape hundreds of times.
@cached(64)
def _template(
    tube: Tube,
    notches: tuple[Notch, ...],
    sites: tuple[Site | None, ...],
    tendons: tuple[Tendon, ...],
    level: str,
    refinement: int,
    turns_with_chord: bool,
    by_fibres: bool,
    flexures: Callable[..., Any],
) -> ChainTemplate:
    # Notches that are equal but for their factor are built once.
    factor = xp.array([notch.stiffness_factor for notch in notches])
    plain = {id(notch): unchecked(notch, stiffness_factor=1.0) for notch in notches}
    notches = tuple(plain[id(notch)] for notch in notches)
    # By identity, as numbers that are traced are neither equal nor different.
    pairs = list(zip(notches, sites, strict=True))
    sited = {(id(notch), id(site)): (notch, site) for notch, site in pairs}
    built = [flexures(*pair, tube, level, refinement, by_fibres) for pair in sited.values()]
    different, free_poses = zip(*built, strict=True)
    distinct_rods = stack(different)
    order = {key: index for index, key in enumerate(sited)}
    rod_index = xp.array([order[id(notch), id(site)] for notch, site in pairs])
    rods = jax.tree.map(lambda leaf: leaf[rod_index], distinct_rods)
    body_length = body_lengths(tube, notches)
    lead = body_length[:-1, None] * TUBE_AXIS
    rods = replace(rods, start_offset=rods.start_offset + lead)
    free = jax.tree.map(lambda *leaves: xp.stack(leaves)[rod_index], *free_poses)
    free = Motion(free.rotation, free.translation + lead)
    sides = dict.fromkeys(notch.direction_deg for notch in notches)
    # The series of a rotation holds for a turn or two.
    turns = {side: rotation_about(constant(TUBE_AXIS * xp.radians(side % 360))) for side in sides}
    # The squared motion of a notch's contact by its modes is over the stiffness a flexibility. A
    # contact opposite a spine moves with its fibre; an edge contact by its distance from the tube
    # axis times the rotation of the distal body.
    fibre = xp.einsum("nc,nicm,ni->nm", fibre_stretch(rods.closure), rods.basis, rods.length)
    turn = tube.outer_radius * (rods.start_rotation @ rods.turn[:, -1, :, 1:])[:, :2]
    squared = xp.where(rods.has_closure[:, None] > 0.0, fibre**2, xp.sum(turn**2, axis=1))
    return ChainTemplate(
        distinct_rods,
        rod_index,
        rods,
        *route(
            tendons,
            notches,
            tube.outer_radius,
            rods,
            free,
            body_length,
            turns_with_chord=turns_with_chord,
        ),
        build_contacts(notches, tube, rods, body_length),
        body_length,
        xp.stack([turns[notch.direction_deg] for notch in notches]),
        xp.sum(rods.length, axis=-1),
        squared * (1.0 - rods.padding_mask),
        factor,
    )


def _flat(chain: Chain, frame: Float[Array, "3 3"]) -> Chain:
    """Reduce a spatial chain that stays in the x-z plane of a frame to that plane."""

    def planar(part: Any) -> Any:
        names = "leaves", "enters", "along", "along_left", "normal"
        points = [name for name in names if getattr(part, name, None) is not None]
        return replace(
            part, **{name: (getattr(part, name) @ frame)[..., IN_PLANE] for name in points}
        )

    return replace(
        chain,
        rods=flattened(chain.rods, frame),
        groups=tuple(map(planar, chain.groups)),
        contact_pairs=tuple(map(planar, chain.contact_pairs)),
        frame=frame,
    )


def _contacts(groups: tuple[TendonGroup, ...], tendons: int) -> Int[Array, "t edges"]:
    """List the edges that every tendon touches, base to tip: two per body that it visits."""
    contact_edges: list[Any] = [[]] * tendons
    for group in groups:
        for column, number in enumerate(group.numbers):
            flexures = np.flatnonzero(np.asarray(group.visits)[:, column])
            contact_edges[number] = (2 * flexures[:, None] + np.arange(2)).ravel().tolist()
    most = max(map(len, contact_edges))
    return xp.array([edges + [-1] * (most - len(edges)) for edges in contact_edges], int)
