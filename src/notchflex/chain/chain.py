"""The chain: all that the solver needs of a robot, as one pytree of arrays."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex.flexure import (
    FlexureState,
    Rod,
    fibre_stretch,
    flexure_state,
    relative_pose,
    rod,
)
from notchflex.friction import FrictionLaw, friction_law
from notchflex.material import SectionLaw, section_law
from notchflex.motion import Motion
from notchflex.robot import Robot
from notchflex.tendon import TendonGroup, route

# Axial stiffness of a tendon that only tells apart how much has slid over two stuck contacts of
# one rigid piece, between which an inextensible tendon would leave the tension open: so many
# times the force that would close a notch by its own stiffness (1e6 N for wrist A).
MEMORY_STIFFNESS = 4e5


class Chain(eqx.Module):
    """Bodies 0 (the base) to n joined by n flexures, with t tendons. Units mm, N, rad.

    Attributes:
        rods: The flexures, each from the frame of body j - 1 to that of body j. A body's frame
            lies on the tube axis at its proximal face.
        memory: Memory of the material at every interval of every flexure.
        law: The material.
        friction: The friction between tendons and tube.
        groups: The tendons, by the way they run.
        axial_stiffness: Axial stiffness of each tendon, infinite where inextensible, N.
        free_length: Length of each tendon before its first contact, from its actuator on and
            through the base, mm.
        body_length: Axial length of each body, mm.
        stiffness: Stiffness of each mode in the free robot, N mm; the scale of residuals.
        lip_stiffness: Stiffness of each notch at its lips in the free robot, N/mm.
    """

    rods: Rod
    memory: Any
    law: SectionLaw
    friction: FrictionLaw
    groups: tuple[TendonGroup, ...]
    axial_stiffness: Float[Array, " t"]
    free_length: Float[Array, " t"]
    body_length: Float[Array, " bodies"]
    stiffness: Float[Array, "n modes"]
    lip_stiffness: Float[Array, " n"]

    @property
    def flexures(self) -> int:
        """Number of flexures."""
        return self.stiffness.shape[0]

    @property
    def tendons(self) -> int:
        """Number of tendons."""
        return self.axial_stiffness.shape[0]

    @property
    def forces_on_bodies(self) -> bool:
        """Whether any force acts on a body, so that poses enter the balance."""
        return any(group.acts_on_bodies for group in self.groups)

    @property
    def memory_stiffness(self) -> Float[Array, " t"]:
        """Axial stiffness that the memory of the contacts uses, always finite, N."""
        closing = jnp.mean(self.lip_stiffness * jnp.sum(self.rods.length, axis=-1))
        return jnp.minimum(self.axial_stiffness, MEMORY_STIFFNESS * closing)


@lru_cache(maxsize=64)
def prepared(robot: Robot) -> Chain:
    """The chain of a robot, kept where compiled programs take it from without copying.

    The last robots asked for are remembered: a control loop solves the same one again and again.
    """
    return jax.device_put(assemble(robot))


def assemble(robot: Robot) -> Chain:
    """Turn the description of a robot into the arrays of its chain.

    Args:
        robot: The description.

    Returns:
        Its chain.

    Example:
        >>> from notchflex import load_robot
        >>> assemble(load_robot("pacheco2021-a")).flexures
        5
    """
    alone = [rod(notch, robot.tube) for notch in robot.notches]
    rods = jax.tree.map(lambda *leaves: np.stack(leaves), *alone)
    body_length = constant(
        [robot.tube.base_length, *(notch.uncut_length for notch in robot.notches)]
    )
    lead = body_length[:-1, None] * np.array([0.0, 0.0, 1.0])
    rods = eqx.tree_at(lambda rods: rods.start_offset, rods, rods.start_offset + lead)
    law = section_law(robot.material)
    stiffness = _mode_stiffness(rods, law)
    lip_slope = np.einsum("nc,nicm,ni->nm", fibre_stretch(rods.lip), rods.basis, rods.length)
    tendons = robot.tendon
    return Chain(
        rods=rods,
        memory=(),
        law=law,
        friction=friction_law(robot.friction),
        groups=route(tendons, rods, _free_poses(rods), body_length),
        axial_stiffness=constant([tendon.axial_stiffness for tendon in tendons]),
        free_length=constant([robot.tube.base_length + tendon.free_length for tendon in tendons]),
        body_length=body_length,
        stiffness=constant(stiffness),
        lip_stiffness=1.0 / np.sum(lip_slope**2 / stiffness, axis=-1),
    )


def flexure_states(
    chain: Chain, modes: Float[Array, "n modes"], *, with_pose: bool
) -> FlexureState:
    """State of all flexures at once."""
    state = partial(flexure_state, with_pose=with_pose)
    return jax.vmap(state, in_axes=(0, None, 0, 0))(chain.rods, chain.law, chain.memory, modes)


def _each(rods: Rod) -> list[Rod]:
    """The flexures one by one: a robot is assembled once, and without compiling anything."""
    return [jax.tree.map(lambda leaf, j=j: leaf[j], rods) for j in range(len(rods.length))]


def _free_poses(rods: Rod) -> Motion:
    poses = [relative_pose(rod, constant(np.zeros(rod.modes))) for rod in _each(rods)]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *poses)


def _mode_stiffness(rods: Rod, law: SectionLaw) -> Float[np.ndarray, "n modes"]:
    """Diagonal of every flexure's stiffness in the free robot."""
    stiffness = []
    for rod_of_one in _each(rods):
        sections = [
            jax.tree.map(lambda leaf, i=i: leaf[i], rod_of_one.section)
            for i in range(len(rod_of_one.length))
        ]
        of_section = np.stack([law.stiffness(section) for section in sections])
        basis = rod_of_one.basis
        stiffness.append(np.einsum("i,iam,iab,ibm->m", rod_of_one.length, basis, of_section, basis))
    return np.stack(stiffness)
