"""The public functions: one load, a path with memory, many loads each from rest."""

from __future__ import annotations

from collections.abc import Iterable

from notchflex.chain import prepared
from notchflex.errors import InputError
from notchflex.robot import Robot
from notchflex.statics.load import Load, LoadPath, load_path
from notchflex.statics.newton import Settings
from notchflex.statics.path import Equilibrium, Path, command
from notchflex.statics.run import run
from notchflex.statics.state import SavedState, State, fitted


def simulate(
    robot: Robot,
    loads: Load | LoadPath | Iterable[Load],
    *,
    from_state: State | SavedState | None = None,
    settings: Settings | None = None,
) -> Path:
    """Follow loads one after the other, with friction that remembers.

    Args:
        robot: The robot.
        loads: A path such as `pull(0.0, 3.0).release()`, or loads in order.
        from_state: State to continue from; rest where not given.
        settings: How hard the solver tries.

    Returns:
        The states, one per load. A load that does not converge is told by `converged` and
        `reason`, and ends the path.

    Raises:
        InputError: Loads that are none, or a state of another robot.

    Example:
        >>> from notchflex import load_robot, pull
        >>> path = simulate(load_robot("pacheco2021-a"), pull(0.0, 1.0, steps=3).release())
        >>> bool(path.total_angle[3] == path.total_angle[2] > path.total_angle[1])
        True
    """
    chain = prepared(robot)
    load = load_path(loads, robot.number_of_tendons)
    if from_state is not None and from_state.robot != robot.name:
        raise InputError(
            f"the state belongs to robot {from_state.robot!r}, this one is {robot.name!r}; "
            "continue from a state of the same robot"
        )
    start = fitted(from_state, chain)
    came = run(chain, command(load), start, settings or Settings(), each_from_start=False)
    return Path(robot, load, chain, came)


def solve(
    robot: Robot,
    load: Load,
    *,
    from_state: State | SavedState | None = None,
    settings: Settings | None = None,
) -> Equilibrium:
    """Find the equilibrium under one load, from rest or from a state.

    Args:
        robot: The robot.
        load: Tension or stroke of its tendons.
        from_state: State to start from; rest where not given.
        settings: How hard the solver tries.

    Returns:
        The equilibrium, or the last good state on the way with `converged` false and a reason.

    Raises:
        InputError: A load that is none, or a state of another robot.

    Example:
        >>> from math import degrees
        >>> from notchflex import Load, load_robot
        >>> state = solve(load_robot("pacheco2021-a"), Load(tension=2.0))
        >>> print(f"{degrees(state.total_angle):.2f} deg")
        150.08 deg
    """
    return simulate(robot, load, from_state=from_state, settings=settings)[0]


def solve_each(
    robot: Robot, loads: LoadPath | Iterable[Load], *, settings: Settings | None = None
) -> Path:
    """Solve many loads, each from rest, without memory from one to the next.

    Args:
        robot: The robot.
        loads: The loads.
        settings: How hard the solver tries.

    Returns:
        The states, one per load; a failure of one does not touch the others.

    Raises:
        InputError: Loads that are none.

    Example:
        >>> from notchflex import load_robot, pull
        >>> path = solve_each(load_robot("pacheco2021-a"), pull(1.0, 2.0, steps=3))
        >>> path.converged.tolist()
        [True, True, True]
    """
    chain = prepared(robot)
    load = load_path(loads, robot.number_of_tendons)
    rest = fitted(None, chain)
    came = run(chain, command(load), rest, settings or Settings(), each_from_start=True)
    return Path(robot, load, chain, came, each_from_rest=True)


__all__ = ["simulate", "solve", "solve_each"]
