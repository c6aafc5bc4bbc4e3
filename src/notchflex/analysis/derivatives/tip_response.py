"""How the tip answers small changes of its drives and of what pushes at it: for control."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from notchflex._jax import constant
from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.derivatives.forward_model import ForwardModel
from notchflex.analysis.derivatives.tangent import Change, Kink, kinks
from notchflex.analysis.solve import check_refinement
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import BodyLoads, Command
from notchflex.loads.load_path import load_path
from notchflex.loads.validation import check_is_robot
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings

_POSE = ("tip_rotation", "tip_position")


@dataclass(frozen=True, eq=False, repr=False)
class TipResponse(Displayed):
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

    def _summary(self) -> Summary:
        steps, _, tendons = self.jacobian.shape
        finite = np.isfinite(self.jacobian).all(axis=(1, 2))
        rows = [
            ("jacobian", f"{steps} steps x 6 x {tendons} tendons: rad or mm per N or mm"),
            ("compliance", f"{steps} steps x 6 x 6: rad or mm per N mm or N"),
            ("steps with slopes", f"{int(finite.sum())} of {steps}"),
        ]
        hint = ".kinks lists where slopes are those of one side; .path holds the states"
        return Summary(f"Response of the tip of {self.path.robot.name}", rows, hint)


def tip_response(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    *,
    settings: Settings | None = None,
    refinement: int = 0,
    each_from_rest: bool = False,
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
        each_from_rest: Whether every load starts from rest instead of from the one before.

    Returns:
        The slopes, and the path they belong to, followed with modes for loads in space.

    Raises:
        InputError: A load that is none.

    Example:
        >>> from notchflex import load_robot, pull
        >>> response = tip_response(load_robot("pacheco2021-a"), pull(0.5, 1.0, steps=2))
        >>> response.jacobian.shape, response.compliance.shape
        ((2, 6, 1), (2, 6, 6))
    """
    load = load_path(loads, check_is_robot(robot).number_of_tendons)
    check_refinement(refinement)
    model = ForwardModel(
        robot, load, settings or DEFAULT, refinement, from_rest=each_from_rest, any_load=True
    )
    path = model.solve(robot, load)
    changes = [Change(loads, None) for loads in _unit_loads(path)]
    # Each state is varied alone: what the contacts remember of the state before stays.
    by_loads = model.derivatives(path, changes, _POSE, remembers=False)
    # Rotation vectors and displacements of the tip, in the world.
    spin = by_loads["tip_rotation"] @ np.swapaxes(path.tip_rotation, -1, -2)
    turned = [0.5 * (spin[..., b, a] - spin[..., a, b]) for a, b in ((1, 2), (2, 0), (0, 1))]
    poses = np.concatenate([np.stack(turned, axis=-1), by_loads["tip_position"]], axis=-1)
    slopes = np.moveaxis(poses, 0, -1)
    by_drive, by_wrench = np.split(slopes, [path.chain.tendons], axis=-1)
    moment_and_force = by_wrench.reshape(*by_wrench.shape[:-1], 2, 3)
    in_world = REGISTERED["base_force"].turned(moment_and_force, load.base_to_world)
    return TipResponse(path, by_drive, in_world.reshape(by_wrench.shape))


def _unit_loads(path: EquilibriumPath) -> Iterator[Float[np.ndarray, "s command"]]:
    """Pack unit changes of the loads: of every drive, then of tip moment and force."""
    long = path.prepared.long
    packed, form = path.prepared.padded_commands(path.commands)
    none: Command = form.unpack(np.zeros(form.size))
    assert none.applied is not None  # the chain is assembled for loads
    units = [none._replace(target=constant(row)) for row in np.eye(long.chain.tendons)]
    for row in np.eye(6):
        applied = _with_tip(none.applied, row, np.asarray(long.chain.body_length)[-1])
        units.append(none._replace(applied=applied))
    for unit in units:
        yield np.broadcast_to(np.asarray(form.pack(unit)), packed.shape)


def _with_tip(applied: BodyLoads, wrench: Float[np.ndarray, " 6"], length: float) -> BodyLoads:
    """Add a moment and a force at the tip to loads, dead in the base frame."""
    moment, force = wrench[:3], wrench[3:]
    last = np.zeros(len(applied.dead_force))
    last[-1] = 1.0
    arm = np.zeros((3, 3))
    arm[2] = length * force
    return applied._replace(
        dead_force=constant(applied.dead_force + np.multiply.outer(last, force)),
        dead_moment=constant(applied.dead_moment + np.multiply.outer(last, moment)),
        dead_arm=constant(applied.dead_arm + np.multiply.outer(last, arm)),
    )
