"""The chain: the solver's model of a robot, as one pytree of arrays, its zeros and its padding.

A mode that stretches a rod does not rotate it, whatever the rod's length and width. Such zeros
remain when any number of the robot file changes, so programs omit the products with them. The zeros
of a rod that happens to be straight are not structural.
"""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._arrays import xp
from notchflex._jax import (
    Pytree,
    constant,
    jax,
    jnp,
    static,
)
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import FlexureState, Rod, flexure_state, in_space
from notchflex.mechanics.friction import FrictionLaw
from notchflex.mechanics.material import SectionLaw
from notchflex.mechanics.tendon import TendonGroup

# Axial stiffness of a tendon in the friction law, over the force that would close a notch by its
# own stiffness (1e6 N for wrist A). It distinguishes the slip over two sticking contacts of one
# rigid piece, between which an inextensible tendon would leave the tension undetermined.
MEMORY_STIFFNESS = 4e5


class Chain(Pytree):
    """Bodies 0 (the base) to n joined by n flexures, with t tendons. Units mm, N, rad.

    Attributes:
        rods: The flexures, each from the frame of body j - 1 to that of body j. A body's frame
            lies on the tube axis at its proximal face.
        law: The material.
        friction: The friction between tendons and tube.
        groups: The tendons, by the way they run.
        contact_pairs: The contacts that close notches, by kind.
        axial_stiffness: Axial stiffness of each tendon, infinite where inextensible, N.
        free_length: Length of each tendon before its first contact, from its actuator on and
            through the base, mm.
        body_length: Length of each body on the tube axis, mm.
        body_mass: Mass of each body, g; 0 where the material has no density.
        body_centre: Its centre, in its frame, mm.
        stiffness: Stiffness of each mode in the free robot, N mm; the scale of residuals.
        elastic: Stiffness of the modes of each flexure against each other, N mm, where the
            material is linear; None where the law of the material gives it.
        contact_stiffness: Stiffness of each notch at its contact in the free robot, N/mm.
        contact_flexibility: Flexibility of the contact of each closed notch, mm/N; None where all
            are rigid.
        closing_force: Force that would close a notch by that stiffness, mean of all, N.
        stroke_stiffness: Approximate tension per stroke of a tendon, N/mm.
        frame: Rotation from the frame of flexures, tendons and contacts to that of the base: x and
            z span the plane of bending of a flat chain. None in space.
        notch_frame: Rotation from the frame of every notch, turned by its direction, to the tube.
        tendon_entry: Point where each tendon enters the base, mm.
        contacts: For every tendon, the edges of gaps that it touches: indices into (flexure, edge)
            flattened, -1 as padding.
        level: Loads for which the flexures have enough modes.
        loaded: Whether loads other than the tendons' act.
        follows: Whether any of them may turn with a body.
        refinement: Number of refinements of the modes beyond those for usual loads.
        window: Largest number of flexures that a span or an opening reaches over.
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
    tendon_entry: Float[Array, "t 3"]
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
    def memory_stiffness(self) -> Float[Array, " t"]:
        """Axial stiffness that the memory of the contacts uses, always finite, N."""
        return jnp.minimum(self.axial_stiffness, MEMORY_STIFFNESS * self.closing_force)


def flexure_states(
    chain: Chain, modes: Float[Array, "n modes"], memory: Any, *, with_pose: bool
) -> FlexureState:
    """Return the state of all flexures at once, after a memory of the material at every node."""
    rods, law = chain.rods, chain.law
    strain = in_space(jnp.einsum("nicm,nm->nic", rods.basis, modes))
    response = law.respond_all(strain, rods.section, memory)
    state = partial(flexure_state, with_pose=with_pose)
    return jax.vmap(state, in_axes=(0, None, 0, 0, 0))(rods, law, memory, modes, response)


def structural(chain: Chain) -> Chain:
    """Mark the numbers of a chain that may be constants of a program.

    They are the strains, rotations and displacements of a rod by its modes, the stiffness between
    modes, counts and flags. The mask of padding flexures is not: chains of other lengths share the
    program.
    """

    def counts(leaf: Any) -> Any:
        return xp.full(xp.shape(leaf), xp.asarray(leaf).dtype.kind != "f")

    plain: Chain = jax.tree.map(counts, chain)
    rods = chain.rods
    pairs = None
    if rods.turn_pair is not None:
        pairs = _of_modes(rods.turn_pair) & xp.swapaxes(_of_modes(rods.turn_pair), -1, -2)
    return replace(
        plain,
        rods=replace(
            plain.rods,
            basis=_all(rods.basis),
            node_reach=_all(rods.node_reach),
            turn=_of_modes(rods.turn),
            turn_pair=pairs,
            step=_of_modes(rods.step),
            node_turn=_of_modes(rods.node_turn),
        ),
        elastic=None if chain.elastic is None else _all(chain.elastic),
    )


def _all(leaf: Array) -> Any:
    return xp.full(xp.shape(leaf), True)


def _of_modes(leaf: Array) -> Any:
    """Mark the entries over the modes of an array over (1, modes)."""
    return xp.broadcast_to(xp.arange(xp.shape(leaf)[-1]) > 0, xp.shape(leaf))


_ROTATIONS = ("start_rotation", "curve_rotation", "end_rotation", "node_rotation")
_NOTHING = (
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
    """Pad a chain with flexures beyond its tip, and with entries for contact edges.

    The added flexures are stiff, straight, of zero length and without tendons: the last body's
    frame is then the tip, and no other number of the robot changes.

    Args:
        chain: The chain, as plain arrays.
        flexures: Number of flexures of the result, at least that of the chain.
        edges: Number of entries for the contact edges of a tendon.
    """
    more = flexures - chain.flexures
    contacts = xp.pad(
        chain.contacts, ((0, 0), (0, edges - chain.contacts.shape[1])), constant_values=-1
    )
    if more == 0:
        return dataclasses.replace(chain, contacts=contacts)

    index = np.minimum(np.arange(flexures), chain.flexures - 1)

    def longer(leaf: Any) -> Array:
        return leaf[index]

    def changed(part: Any, **values: Any) -> Any:
        """Return a part whose added entries have other values."""
        wider = jax.tree.map(longer, part)
        for name, value in values.items():
            getattr(wider, name)[-more:] = value
        return wider

    def with_nothing(values: Any) -> Array:
        return constant(xp.pad(values, [(0, more)] + [(0, 0)] * (xp.ndim(values) - 1)))

    return dataclasses.replace(
        chain,
        rods=_rods(chain, changed),
        groups=tuple(
            changed(group, present=0.0, visits=0.0, ends=0.0, back=1, body_length=0.0)
            for group in chain.groups
        ),
        contact_pairs=tuple(
            changed(group, has_contact=0.0, back=1) for group in chain.contact_pairs
        ),
        body_length=with_nothing(chain.body_length),
        body_mass=with_nothing(chain.body_mass),
        body_centre=with_nothing(chain.body_centre),
        stiffness=xp.concatenate([chain.stiffness, xp.ones((more, chain.stiffness.shape[1]))]),
        elastic=None if chain.elastic is None else _elastic(chain.elastic, more),
        contact_stiffness=longer(chain.contact_stiffness),
        contact_flexibility=jax.tree.map(longer, chain.contact_flexibility),
        notch_frame=longer(chain.notch_frame),
        contacts=contacts,
    )


def _rods(chain: Chain, changed: Any) -> Rod:
    rods = chain.rods
    values = {name: 0.0 for name in _NOTHING if getattr(rods, name) is not None}
    values |= {name: xp.eye(getattr(rods, name).shape[-1]) for name in _ROTATIONS}
    wider: Rod = changed(rods, padding_mask=1.0, **values)
    # The first added flexure begins at the tip, at the end of the last body.
    wider.start_offset[chain.flexures, -1] = chain.body_length[-1]  # pyright: ignore
    return wider


def _elastic(elastic: Any, more: int) -> Array:
    idle = xp.broadcast_to(xp.eye(elastic.shape[-1]), (more, *elastic.shape[1:]))
    return xp.concatenate([elastic, idle])  # pyright: ignore
