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
    """Demand on every tendon, and the other loads.

    Attributes:
        value: Tension (N) or stroke (mm).
        by_stroke: Whether it is a stroke; None where all are tensions.
        applied: Other loads on the bodies; None for a chain assembled for tendons alone.
    """

    value: Float[Array, " t"]
    by_stroke: Bool[Array, " t"] | None
    applied: BodyLoads | None

    def either(self, by_stroke: Array, by_tension: Array) -> Array:
        """Of two values per tendon the one that belongs to what is demanded of it."""
        return (
            by_tension
            if self.by_stroke is None
            else jnp.where(self.by_stroke, by_stroke, by_tension)
        )


def tension_commands(value: Float[np.ndarray, "s t"]) -> Command:
    """Tensions of every tendon (N), loads as leading axis, and nothing else."""
    return Command(constant(value), None, None)


def pad_commands(commands: Command, flexures: int, by_stroke: bool) -> Command:
    """Loads, as leading axis, for a chain with more flexures that carry none.

    Args:
        commands: The loads.
        flexures: How many flexures the chain has.
        by_stroke: Whether they are to stand beside loads by stroke.
    """
    drawn, others = commands.by_stroke, commands.applied
    if by_stroke and drawn is None:
        drawn = cast("Array", np.zeros(commands.value.shape, bool))
    if others is not None:
        more = flexures + 1 - others.dead_force.shape[1]
        others = jax.tree.map(
            lambda leaf: np.pad(leaf, [(0, 0), (0, more)] + [(0, 0)] * (leaf.ndim - 2)), others
        )
    return Command(commands.value, drawn, others)


def make_commands(load: LoadPath, robot: Robot, chain: Chain) -> Command:
    """The loads as the solver takes them; a tendon that is not commanded is pulled with 0 N."""
    no_stroke = np.isnan(load.stroke)
    drawn, value = None, np.where(np.isnan(load.tension), 0.0, load.tension)
    if not no_stroke.all():
        drawn, value = cast("Array", ~no_stroke), np.where(no_stroke, value, load.stroke)
    others = None
    if chain.loaded:
        others = applied(
            load,
            robot,
            np.asarray(chain.body_mass),
            np.asarray(chain.body_centre),
            np.asarray(chain.body_length),
            None if chain.frame is None else np.asarray(chain.frame),
        )
    return Command(constant(value), drawn, others)


__all__ = ["Command", "make_commands", "pad_commands", "tension_commands"]
