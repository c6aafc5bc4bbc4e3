"""Robots of one form, solved under loads of one kind, as searches and fits ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float

from notchflex._quantity import REGISTERED
from notchflex._summary import Displayed, Summary
from notchflex.analysis.solve import check_refinement, prepare_for
from notchflex.analysis.tangent import Change, Kink, PathTangents, kinks
from notchflex.errors import InputError
from notchflex.loads import Load
from notchflex.loads.command import make_commands
from notchflex.loads.load import check_is_robot
from notchflex.loads.load_path import LoadPath, load_path
from notchflex.results.path import EquilibriumPath
from notchflex.robot import Robot
from notchflex.robot.numbers import differing, parts_of
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.assembled import assembled_chain
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import run
from notchflex.solver.residual import SolverState

# Derivatives of plain functions by differences, accurate to about 1e-10.

T = TypeVar("T")

# Width of a difference relative to the number, by order of accuracy. A short formula is accurate to
# rounding and allows a small width; integrals and special functions do not.
_WIDTHS = {2: 5e-6, 6: 1.3e-3}


def slope(
    vector_of: Callable[[float], Float[np.ndarray, "*m"]], value: float, *, order: int = 6
) -> Float[np.ndarray, "*m"]:
    """Differentiate arrays by a number to about 1e-10; at an end of its range, inward."""
    # Infinite entries count as constant. Order 2, for plain formulas, takes a third of the
    # evaluations of order 6.
    width, reason = _width(value, order), ""
    for side in (0, 1, -1):
        points, weights = _stencil(order, side)
        try:
            vectors = np.stack([vector_of(float(value + width * point)) for point in points])
        except InputError as error:  # out of range
            reason = str(error)
            continue
        vectors = np.where(np.isfinite(vectors), vectors, 0.0)
        # Constant entries give exactly 0, without rounding errors.
        return np.tensordot(weights, vectors - vectors[0], 1) / width
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {value:g}: {reason}")


def nearby(robot_at: Callable[[float], T], value: float, order: int = 6) -> T:
    """Return what a function gives next to a number, on the side where it gives something."""
    width, reason = _width(value, order), ""
    for moved in (value + width, value - width):
        try:
            return robot_at(moved)
        except InputError as error:
            reason = str(error)
    raise InputError.OUT_OF_RANGE(f"the number cannot be varied around {value:g}: {reason}")


def _width(value: float, order: int) -> float:
    """Return the width of differences: relative to the number, or to 1 for 0."""
    return _WIDTHS[order] * (abs(value) or 1.0)


@lru_cache
def _stencil(order: int, side: int) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return points, in widths, and weights of the slope at 0 of their interpolant."""
    half = order // 2
    central = np.setdiff1d(np.arange(-half, half + 1.0), [0.0])
    points = side * np.arange(order + 1.0) if side else central
    powers = np.vander(points, increasing=True).T
    return points, np.linalg.solve(powers, np.eye(len(points))[1])


@dataclass(frozen=True, eq=False)
class ForwardModel:
    """A robot under loads as a function of its numbers and of the loads."""

    robot: Robot  # the nominal one
    load: LoadPath  # the nominal loads
    settings: Settings = DEFAULT
    refinement: int = 0
    from_rest: bool | Bool[np.ndarray, " s"] = False  # which steps start from rest
    any_load: bool = False  # whether loads on the bodies vary, and may point anywhere

    @cached_property
    def ready(self) -> PreparedChain:
        """The nominal robot as arrays."""
        if self.any_load:
            return prepare(self.robot, "space", loaded=True, refinement=self.refinement)
        return prepare_for(self.robot, self.load, None, self.refinement)

    def solve(
        self, robot: Robot, load: LoadPath, start: SolverState | None = None
    ) -> EquilibriumPath:
        """Solve loads of the model's kind with a robot of its form, from `start` or from rest."""
        ready = self._prepared(robot)
        commands = make_commands(load, robot, ready.chain)
        states = run(ready, commands, start, self.settings, each_from_start=self.from_rest)
        return EquilibriumPath(robot, load, ready, states, settings=self.settings)

    @cached_property
    def _prepared(self) -> Callable[[Robot], PreparedChain]:
        """Function that prepares a robot with other numbers; the last results are cached."""
        return lru_cache(maxsize=4)(self._varied)

    def _varied(self, robot: Robot) -> PreparedChain:
        if robot is self.robot:
            return self.ready
        other = differing(parts_of(self.robot), parts_of(robot))
        ready = assembled_chain(robot, self.ready.chain) if other else None
        return ready or prepared_like(robot, self.ready)


def prepared_like(robot: Robot, like: PreparedChain) -> PreparedChain:
    """Prepare a robot for the same loads as another one; raise where its form differs."""
    ready = prepare(robot, *like.chain.options.values())
    if ready.chain_layout is not like.chain_layout:
        raise InputError.UNSUPPORTED(
            "with these values the robot has another form; it must stay the same"
        )
    return ready


# How the tip answers small changes of its drives and of what pushes at it: for control.

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
    changes = [Change(np.tile(unit, (len(path), 1)), None) for unit in _unit_loads(path)]
    # Each state is varied alone: what the contacts remember of the state before stays.
    by_loads = PathTangents(path, _POSE, remembers=False).along(changes)
    # Rotation vectors and displacements of the tip, in the world.
    spin = by_loads["tip_rotation"] @ np.swapaxes(path.tip_rotation, -1, -2)
    turned = [0.5 * (spin[..., b, a] - spin[..., a, b]) for a, b in ((1, 2), (2, 0), (0, 1))]
    poses = np.concatenate([np.stack(turned, axis=-1), by_loads["tip_position"]], axis=-1)
    slopes = np.moveaxis(poses, 0, -1)
    by_drive, by_wrench = np.split(slopes, [path.chain.tendons], axis=-1)
    moment_and_force = by_wrench.reshape(*by_wrench.shape[:-1], 2, 3)
    in_world = REGISTERED["base_force"].turned(moment_and_force, load.base_to_world)
    return TipResponse(path, by_drive, in_world.reshape(by_wrench.shape))


def _unit_loads(path: EquilibriumPath) -> Float[np.ndarray, "k command"]:
    """Pack unit changes of the loads: of every drive, then of tip moment and force."""
    layout, tendons = path.prepared.command_layout(path.commands), path.chain.tendons
    indices: Any = layout.unpack_indices()
    units = np.zeros((tendons + 6, layout.size))
    drives, moments, forces = np.split(np.arange(len(units)), [tendons, tendons + 3])
    units[drives, indices.target] = 1.0
    units[moments, indices.applied.dead_moment[-1]] = 1.0
    units[forces, indices.applied.dead_force[-1]] = 1.0
    # The tip lies on the axis of the last body, at its end.
    units[forces, indices.applied.dead_arm[-1, 2]] = np.asarray(path.chain.body_length)[-1]
    return units
