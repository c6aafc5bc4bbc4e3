"""The chain: the solver's model of a robot, as one pytree of arrays."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Array, Float, Int

from notchflex._jax import jax, jnp
from notchflex._pytree import Pytree, static
from notchflex.mechanics.contact import ContactGroup
from notchflex.mechanics.flexure import (
    FlexureState,
    Rod,
    flexure_state,
    in_space,
)
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


def flexure_states(
    chain: Chain, modes: Float[Array, "n modes"], memory: Any, *, with_pose: bool
) -> FlexureState:
    """Return the state of all flexures at once, after a memory of the material at every node."""
    rods, law = chain.rods, chain.law
    strain = in_space(jnp.einsum("nicm,nm->nic", rods.basis, modes))
    response = law.respond_all(strain, rods.section, memory)
    state = partial(flexure_state, with_pose=with_pose)
    return jax.vmap(state, in_axes=(0, None, 0, 0, 0))(rods, law, memory, modes, response)
