"""Equilibria under one load, along a path with friction history, or of many loads from rest."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from notchflex.errors import InputError
from notchflex.loads import Load, LoadPath
from notchflex.loads.command import follows, is_planar, is_unloaded, make_commands, unlikely_loads
from notchflex.loads.load import check_is_robot
from notchflex.loads.load_path import load_path
from notchflex.mechanics.chain import tendons_in_plane
from notchflex.mechanics.flexure import LEVELS, MAX_REFINEMENT
from notchflex.results.path import EquilibriumPath
from notchflex.results.state import Equilibrium, State, check_robot
from notchflex.robot import Robot
from notchflex.solver.newton import DEFAULT, Settings
from notchflex.solver.programs.prepare import PreparedChain, prepare
from notchflex.solver.programs.run import run


def simulate(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    *,
    from_state: State | None = None,
    settings: Settings | None = None,
    refinement: int = 0,
) -> EquilibriumPath:
    """Follow loads one after the other, with friction history.

    Args:
        robot: The robot.
        loads: A path such as `pull(0.0, 3.0).release()`, or loads in order.
        from_state: State to continue from; rest where not given.
        settings: Tolerance and limits of the solver.
        refinement: 0 for the usual strain modes and fibres; 1, 2 or 3 adds more. A result that does
            not change has converged (`moment_error` estimates the remaining error).

    Returns:
        The states, one per load. Where a load does not converge, `converged` is false and `reason`
        says why; later loads are not tried.

    Raises:
        InputError: Invalid loads, or a state of another robot.

    Example:
        >>> from notchflex import load_robot, pull
        >>> path = simulate(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3).release())
        >>> bool(path.total_angle[3] == path.total_angle[2] > path.total_angle[1])
        True
    """
    return _follow(robot, loads, from_state, settings or DEFAULT, refinement)


def solve(
    robot: Robot,
    load: Load,
    *,
    from_state: State | None = None,
    settings: Settings | None = None,
    refinement: int = 0,
) -> Equilibrium:
    """Find the equilibrium under one load, from rest or from a state.

    Args:
        robot: The robot.
        load: Tension or stroke of its tendons.
        from_state: State to start from; rest where not given.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The equilibrium, or the last good state on the way with `converged` false and a reason.

    Raises:
        InputError: An invalid load, or a state of another robot.

    Example:
        >>> from math import degrees
        >>> from notchflex import Load, load_robot
        >>> state = solve(load_robot("pacheco2021-a"), Load(tension=2.0))
        >>> print(f"{degrees(state.total_angle):.2f} deg")
        150.08 deg
    """
    return Equilibrium(_follow(robot, load, from_state, settings or DEFAULT, refinement), 0)


def solve_each(
    robot: Robot,
    loads: LoadPath | Iterable[Load],
    *,
    settings: Settings | None = None,
    refinement: int = 0,
) -> EquilibriumPath:
    """Solve many loads, each from rest.

    Args:
        robot: The robot.
        loads: The loads.
        settings: Tolerance and limits of the solver.
        refinement: More strain modes, as for `simulate`.

    Returns:
        The states, one per load; a failure of one does not touch the others.

    Raises:
        InputError: Invalid loads.

    Example:
        >>> from notchflex import load_robot, pull
        >>> path = solve_each(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=3))
        >>> path.converged.tolist()
        [True, True, True]
    """
    return _follow(robot, loads, None, settings or DEFAULT, refinement, each_from_rest=True)


def _follow(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    from_state: State | None,
    settings: Settings,
    refinement: int,
    *,
    each_from_rest: bool = False,
) -> EquilibriumPath:
    if from_state is not None:
        check_robot(from_state, robot)
    load = load_path(loads, check_is_robot(robot).number_of_tendons)
    path = follow_path(robot, load, from_state, settings, refinement, each_from_rest)
    for warning in unlikely_loads(load, robot, path.prepared.usual_loads):
        warnings.warn(warning, stacklevel=3)
    return path


def follow_path(
    robot: Robot,
    load: LoadPath,
    from_state: State | None,
    settings: Settings,
    refinement: int,
    each_from_rest: bool = False,
) -> EquilibriumPath:
    """Follow a path for the tendons of a robot, as `simulate` does, without warnings."""
    ready = prepare_for(robot, load, from_state, refinement)
    start = None if from_state is None else from_state.fitted(ready.chain)
    commands = make_commands(load, robot, ready.chain)
    states = run(ready, commands, start, settings, each_from_start=each_from_rest)
    return EquilibriumPath(robot, load, ready, states, each_from_rest, settings)


def check_refinement(refinement: int) -> None:
    """Raise if there is no such refinement."""
    if not isinstance(refinement, int) or not 0 <= refinement <= MAX_REFINEMENT:  # pyright: ignore
        raise InputError.OUT_OF_RANGE(
            f"refinement is a whole number from 0 to {MAX_REFINEMENT}; got {refinement!r}"
        )


def prepare_for(
    robot: Robot,
    load: LoadPath,
    from_state: State | None = None,
    refinement: int = 0,
) -> PreparedChain:
    """Prepare a robot with modes enough for all loads of a path, and for the state before it."""
    check_refinement(refinement)
    if from_state is not None and from_state.refinement != refinement:
        raise InputError.CONFLICT(
            f"the state was computed with refinement {from_state.refinement}, not {refinement}; "
            "go on with the same"
        )
    loaded = not is_unloaded(load)
    turning = loaded and follows(load)
    level = level_of(robot, loaded, loaded and not is_planar(load, robot))
    if from_state is not None:
        loaded, turning = loaded or from_state.loaded, turning or from_state.follows
        level = max(level, from_state.level, key=LEVELS.index)
    return prepare(robot, level, loaded, turning, refinement)


def level_of(robot: Robot, loaded: bool, sideways: bool) -> str:
    """Return the level of strain modes for loads, some of them `sideways` out of the plane."""
    if sideways or not tendons_in_plane(robot):
        return "space"
    return "plane" if loaded else "tendons"
