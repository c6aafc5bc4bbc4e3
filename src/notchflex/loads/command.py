"""Commands: the loads of a path as the arrays that the solver takes."""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from jaxtyping import Array, Bool, Float

from notchflex._jax import constant, jax, jnp
from notchflex.loads.applied import BodyLoads, applied
from notchflex.loads.load_path import LoadPath
from notchflex.mechanics.chain import Chain
from notchflex.robot import Robot


class Command(NamedTuple):
    """Targets of all tendons, and the external loads; loads may be leading axis.

    Attributes:
        target: Tension (N) or stroke (mm).
        by_stroke: Whether it is a stroke; None where all are tensions.
        applied: External loads on the bodies; None for a chain assembled for tendons alone.
    """

    target: Float[Array, " t"]
    by_stroke: Bool[Array, " t"] | None
    applied: BodyLoads | None

    def either(self, by_stroke: Array, by_tension: Array) -> Array:
        """Select per tendon the value for a stroke or that for a tension."""
        if self.by_stroke is None:
            return by_tension
        return jnp.where(self.by_stroke, by_stroke, by_tension)


def tension_commands(tension: Float[np.ndarray, "s t"]) -> Command:
    """Return commands of tensions alone (N), loads as leading axis."""
    return Command(constant(tension), None, None)


def pad_commands(commands: Command, flexures: int, by_stroke: bool) -> Command:
    """Pad commands for a chain with more flexures, which carry no load.

    Args:
        commands: The commands, as leading axis.
        flexures: Number of flexures of the chain.
        by_stroke: Whether they stand beside commands by stroke.
    """
    target, drawn, loads = commands
    if by_stroke and drawn is None:
        drawn = cast("Array", np.zeros(target.shape, bool))
    if loads is not None:
        more = flexures + 1 - loads.dead_force.shape[1]
        loads = jax.tree.map(
            lambda leaf: np.pad(leaf, [(0, 0), (0, more)] + [(0, 0)] * (leaf.ndim - 2)), loads
        )
    return Command(target, drawn, loads)


def make_commands(load: LoadPath, robot: Robot, chain: Chain) -> Command:
    """Return the commands of a path; a tendon without one is slack (0 N)."""
    no_stroke = np.isnan(load.stroke)
    drawn, target = None, np.where(np.isnan(load.tension), 0.0, load.tension)
    if not no_stroke.all():
        drawn, target = cast("Array", ~no_stroke), np.where(no_stroke, target, load.stroke)
    loads = None
    if chain.loaded:
        mass, centre = np.asarray(chain.body_mass), np.asarray(chain.body_centre)
        frame = None if chain.frame is None else np.asarray(chain.frame)
        loads = applied(load, robot, mass, centre, np.asarray(chain.body_length), frame)
    return Command(constant(target), drawn, loads)


__all__ = ["Command", "make_commands", "pad_commands", "tension_commands"]
