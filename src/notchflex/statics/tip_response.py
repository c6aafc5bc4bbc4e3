"""How the tip answers small changes of its drives and of what pushes at it: for control."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Array, Float

from notchflex._jax import constant, jax, jnp
from notchflex._native import native
from notchflex.chain import Chain
from notchflex.motion import rotation_about, unskew
from notchflex.robot import Robot
from notchflex.statics.actuation import Command
from notchflex.statics.applied import Applied
from notchflex.statics.capacity import lengthen
from notchflex.statics.command import command
from notchflex.statics.given import robot_given
from notchflex.statics.kinks import Kink, kinks
from notchflex.statics.known import KnownForm
from notchflex.statics.load import Load, LoadPath, load_path
from notchflex.statics.newton import DEFAULT, Settings
from notchflex.statics.packing import Form, lane_sizes
from notchflex.statics.path import EquilibriumPath
from notchflex.statics.prepare import prepared
from notchflex.statics.quantities import shape
from notchflex.statics.run import run
from notchflex.statics.sensitivity import Way, answering
from notchflex.statics.solve import check_refinement


@dataclass(frozen=True, eq=False)
class TipResponse:
    """Slopes of the tip's pose along a path of loads; s steps, t tendons.

    Rows are (rotation vector, rad; position, mm), all in the world. NaN where a step did not
    converge, and with friction where it was so hard that it was solved in three parts or more: what
    contacts remember of the parts is not followed.

    Attributes:
        path: The states.
        jacobian: Change of the pose per unit of what each tendon is commanded, a tension (N) or a
            stroke (mm), (s, 6, t).
        compliance: Change of the pose per moment (N mm) and force (N) at the tip, dead in the
            world, (s, 6, 6).
    """

    path: EquilibriumPath
    jacobian: Float[np.ndarray, "s 6 t"]
    compliance: Float[np.ndarray, "s 6 6"]

    @cached_property
    def kinks(self) -> list[Kink]:
        """Contacts and notches at a switch: there the slopes are those of one side only."""
        return kinks(self.path)


def tip_response(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    *,
    settings: Settings | None = None,
    refinement: int = 0,
) -> TipResponse:
    """Follow loads, and find at every state how the tip answers its drives and what pushes at it.

    With friction the answer depends on the way: it is that of going on as the load went. A contact
    that slid in the last step goes on sliding, one that stuck goes on sticking. Where a contact is
    about to slip or a notch to close, the slopes are those of one side; `kinks` lists these.

    Args:
        robot: The robot.
        loads: A path, or loads in order.
        settings: How hard the solver tries.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The slopes, and the path they belong to, followed with modes for loads in space.

    Raises:
        InputError: A load that is none.

    Example:
        >>> from notchflex import load_robot, pull
        >>> found = tip_response(load_robot("pacheco2021-a"), pull(0.5, 1.0, steps=2))
        >>> found.jacobian.shape, found.compliance.shape
        ((2, 6, 1), (2, 6, 6))
    """
    path = load_path(loads, robot_given(robot).number_of_tendons)
    check_refinement(refinement)
    ready = prepared(robot, "space", loaded=True, refinement=refinement, flat=False)
    commands = command(path, robot, ready.chain)
    came = run(ready, commands, None, settings or DEFAULT, each_from_start=False)
    found = EquilibriumPath(robot, path, ready, came)
    long = ready.long
    loads, form = ready.long_commands(commands)
    states, between = (
        lengthen(one, ready.state, long.state) for one in (came.states, came.between)
    )
    how = np.stack([came.part_before, came.parts, found.converged], axis=1)
    rows = (False, False, True, True, True, True)
    given = (long.rest_vector, long.known_vector, states, loads, between, how)
    slopes = _slopes.along(rows, *given, long.known_form, form, long.state)
    slopes = np.swapaxes(slopes, -1, -2)
    base = np.asarray(rotation_about(constant(path.base_rotation)))
    turn = np.kron(np.eye(2), base)
    tendons = ready.chain.tendons
    return TipResponse(found, turn @ slopes[..., :tendons], turn @ slopes[..., tendons:] @ turn.T)


@native(6, lane_sizes)
def _slopes(
    before: Float[Array, " state"],
    vector: Float[Array, " chain"],
    state: Float[Array, " state"],
    load: Float[Array, " command"],
    between: Float[Array, " state"],
    how: Float[Array, " 3"],
    chain_form: KnownForm,
    command_form: Form,
    state_form: Form,
) -> tuple[Float[Array, " state"], Float[Array, "changes 6"]]:
    """Change of the pose of the tip per change of every drive and of the wrench at the tip.

    Carried from state to state is the state, the one before the next.
    """
    chain: Chain = chain_form.unpack(vector)
    last, solved, halfway = (state_form.unpack(one) for one in (before, state, between))
    command: Command = command_form.unpack(load)
    assert command.applied is not None  # the chain is assembled for loads
    applied = command.applied
    way = Way(halfway, how[0], how[1].astype(int), how[2] > 0.0)

    def pose(change: Array) -> tuple[Array, Array]:
        drives, wrench = change[: chain.tendons], change[chain.tendons :]
        varied = command._replace(
            value=command.value + drives,
            applied=_with_tip(applied, wrench, chain.body_length[-1]),
        )
        own = shape(chain, answering(chain, varied, last, solved, way))
        return own.body_rotation[-1], own.tip_position

    def along(direction: Array) -> Array:
        still = jnp.zeros_like(direction)
        (rotation, _), (turned, moved) = jax.jvp(pose, (still,), (direction,))
        return jnp.concatenate([unskew(turned @ rotation.T), moved])

    # A loop over the changes: their derivatives are compiled once.
    return state, jax.lax.map(along, jnp.eye(chain.tendons + 6))


def _with_tip(applied: Applied, wrench: Float[Array, " 6"], length: Float[Array, ""]) -> Applied:
    """Loads with a moment and a force more at the tip, dead in the base frame."""
    moment, force = wrench[:3], wrench[3:]
    arm = jnp.zeros((3, 3)).at[2].set(length * force)
    return applied._replace(
        dead_force=applied.dead_force.at[-1].add(force),
        dead_moment=applied.dead_moment.at[-1].add(moment),
        dead_arm=applied.dead_arm.at[-1].add(arm),
    )


__all__ = ["TipResponse", "tip_response"]
