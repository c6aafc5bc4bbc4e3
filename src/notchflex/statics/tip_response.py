"""How the tip answers small changes of its drives and of what pushes at it: for control."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from notchflex._jax import constant, jax, jit, jnp
from notchflex.motion import rotation_about, unskew
from notchflex.robot import Robot
from notchflex.statics.actuation import Command
from notchflex.statics.applied import Applied
from notchflex.statics.command import command
from notchflex.statics.given import robot_given
from notchflex.statics.load import Load, LoadPath, load_path
from notchflex.statics.newton import DEFAULT, Settings
from notchflex.statics.packing import Form
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


def tip_response(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    *,
    settings: Settings | None = None,
    refinement: int = 0,
) -> TipResponse:
    """Follow loads, and find at every state how the tip answers its drives and what pushes at it.

    With friction the answer depends on the way: it is that of going on as the load went. A contact
    that slid in the last step goes on sliding, one that stuck goes on sticking.

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
    states = came.states
    before = np.concatenate([ready.rest_vector[None], states[:-1]])
    form = ready.command_form(commands)
    way = (came.between, came.part_before, came.parts, found.converged)
    items = (before, states, form.pack(commands, leading=1), *way)
    slopes = np.asarray(_slopes(ready.vector, *items, ready.chain_form, form, ready.state))
    base = np.asarray(rotation_about(constant(path.base_rotation)))
    turn = np.kron(np.eye(2), base)
    tendons = ready.chain.tendons
    return TipResponse(found, turn @ slopes[..., :tendons], turn @ slopes[..., tendons:] @ turn.T)


@partial(jit, static_argnums=(8, 9, 10))
def _slopes(
    vector: Float[Array, " chain"],
    before: Float[Array, "s state"],
    states: Float[Array, "s state"],
    commands: Float[Array, "s command"],
    between: Float[Array, "s state"],
    part_before: Float[Array, " s"],
    parts: Int[Array, " s"],
    converged: Bool[Array, " s"],
    chain_form: Form,
    command_form: Form,
    state_form: Form,
) -> Float[Array, "s 6 changes"]:
    chain = chain_form.unpack(vector)

    def pose(change: Array, item: tuple[Array, ...]) -> tuple[Array, Array]:
        last, state, packed, halfway, *way = item
        load: Command = command_form.unpack(packed)
        assert load.applied is not None  # the chain is assembled for loads
        drives, wrench = change[: chain.tendons], change[chain.tendons :]
        varied = load._replace(
            value=load.value + drives,
            applied=_with_tip(load.applied, wrench, chain.body_length[-1]),
        )
        last, state, halfway = (state_form.unpack(one) for one in (last, state, halfway))
        answer = answering(chain, varied, last, state, Way(halfway, *way))
        own = shape(chain, answer)
        return own.body_rotation[-1], own.tip_position

    def one(item: tuple[Array, ...]) -> Array:
        still = jnp.zeros(chain.tendons + 6)
        turned, moved = jax.jacfwd(pose)(still, item)
        rotation, _ = pose(still, item)
        turn = jax.vmap(lambda slope: unskew(slope @ rotation.T), in_axes=-1, out_axes=-1)
        return jnp.concatenate([turn(turned), moved])

    return jax.lax.map(one, (before, states, commands, between, part_before, parts, converged))


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
