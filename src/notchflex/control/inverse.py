"""Reach one target, or follow many: drives that meet them from the present state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args

import numpy as np

from notchflex import InputError, Load, LoadPath, Robot, State
from notchflex.control.following import Following, Reach
from notchflex.control.limits import Drive, Limits
from notchflex.control.problem import (
    Attempt,
    Drives,
    Goal,
    PackedState,
    Problem,
    ProblemOptions,
    Response,
    TargetSearch,
    make_problem,
)
from notchflex.control.search import find, smallest_tensions
from notchflex.control.targets import Targets, make_targets
from notchflex.search.least_squares import KEPT
from notchflex.support import check_is_robot, load_path, short_repr

Approach = Literal["direct", "loading", "unloading", "least"]

# Overshoot beyond the drives that reverse all contacts, relative.
_OVERSHOOT = 0.05


def reach(
    robot: Robot,
    target: Any,
    *,
    state: State | None = None,
    load: Load | None = None,
    drive: Drive = "tension",
    limits: Limits | None = None,
    approach: Approach = "least",
    weights: Mapping[str, float] | None = None,
    search: TargetSearch | None = None,
) -> Reach:
    """Find tensions or strokes that bring a robot from its present state to a target.

    The friction history of the present state counts. A target that can be met after loading as
    well as after unloading is approached, unless asked otherwise, from the side that needs the
    smaller tensions; where this is the far side, the result begins with an overshoot.

    Args:
        robot: The robot.
        target: Position of the tip (x, y, z), mm; or values by the name of a quantity, such as
            `{"tip_position": (4.0, None, 9.0), "total_angle": 1.2}`. None is a free entry.
            "tip_direction" is the unit vector along the tube at the tip.
        state: The present state; rest where not given.
        load: External loads that act. Tendons that it commands are held at that; the others are
            driven.
        drive: Whether "tension" (N) or "stroke" (mm) is commanded.
        limits: Limits on drives and robot; tensions of 0 N or more where not given.
        approach: "least", the way with the smallest drives; "direct", without an overshoot;
            "loading" or "unloading", with rising or falling drives at the end.
        weights: What an error of a quantity counts per unit (mm, N, rad); 1 each.
        search: Tolerances and budget.

    Returns:
        The drives and the state there. Where the target is not met, `code` and `reason` say why,
        and the drives are those of the nearest that was found.

    Raises:
        InputError: Invalid target, limits or state.

    Example:
        >>> from notchflex import Load, load_robot, solve
        >>> wrist = load_robot("pacheco2021-a")
        >>> there = solve(wrist, Load(tension=1.0)).tip_position
        >>> found = reach(wrist, there, approach="direct")
        >>> bool(found.reached), round(float(found.tension[0]), 6)
        (True, 1.0)
    """
    targets = make_targets(target, check_is_robot(robot), several=False)
    if len(targets) > 1:
        raise InputError.WRONG_SHAPE("reach takes one target; give several to follow")
    options = ProblemOptions(state, load, drive, limits, weights, search)
    return _follow(robot, targets, options, approach)[0]


def follow(
    robot: Robot,
    targets: Any,
    *,
    state: State | None = None,
    load: Load | None = None,
    drive: Drive = "tension",
    limits: Limits | None = None,
    approach: Approach = "direct",
    weights: Mapping[str, float] | None = None,
    search: TargetSearch | None = None,
) -> Following:
    """Find tensions or strokes that bring a robot to one target after the other.

    Each target starts from the state that the one before left, with its friction history. After a
    target that cannot be met the robot stands where it comes nearest.

    Args:
        robot: The robot.
        targets: Positions of the tip, (k, 3), mm; or values by the name of a quantity, targets as
            leading axis; or what `read_targets` returns. None is a free entry.
        state: The present state; rest where not given.
        load: External loads, and tendons that are held; as for `reach`.
        drive: Whether "tension" (N) or "stroke" (mm) is commanded.
        limits: Limits on drives and robot; `rate` limits the change from target to target.
        approach: As for `reach`. All but "direct" may overshoot on the way to a target.
        weights: As for `reach`.
        search: Tolerances and budget.

    Returns:
        The drives, the states there, and how near each target was met.

    Raises:
        InputError: Invalid targets, limits or state.

    Example:
        >>> from notchflex import load_robot, pull, simulate
        >>> wrist = load_robot("pacheco2021-a")
        >>> forward = simulate(wrist, pull(0.5, 1.0, steps=6).release())
        >>> found = follow(wrist, forward.tip_position)
        >>> bool(found.reached.all()), bool((found.tension <= forward.tension + 1e-6).all())
        (True, True)
    """
    checked = make_targets(targets, check_is_robot(robot), several=True)
    options = ProblemOptions(state, load, drive, limits, weights, search)
    return _follow(robot, checked, options, approach)


def _follow(
    robot: Robot, targets: Targets, options: ProblemOptions, approach: Approach
) -> Following:
    if approach not in get_args(Approach):
        raise InputError.UNKNOWN_NAME(
            f"approach is one of {', '.join(get_args(Approach))}; got {short_repr(approach)}"
        )
    problem, goals = make_problem(robot, targets, options), targets.goals
    before, response = problem.stepper.start(), None
    drives: list[np.ndarray] = []
    last: list[int] = []
    attempts: list[Attempt] = []
    for goal in goals:
        near = problem.near(problem.present(before))
        via, attempt = _approach(near, before, goal, approach, response)
        drives += [*via, attempt.drives]
        last.append(len(drives) - 1)
        attempts.append(attempt)
        if attempt.solved:
            response = attempt.response
            before = response.step.state
    values = [attempt.response.step.flat_values[problem.entries] for attempt in attempts]
    stepper, ways = problem.stepper, np.array(drives)
    by_stroke = np.array(stepper.drives) == "stroke"
    loads = load_path(stepper.loads, len(by_stroke))
    loads = LoadPath(
        np.where(by_stroke, np.nan, np.maximum(ways, 0.0)),
        np.where(by_stroke, ways, np.nan),
        loads.base_rotation,
        loads.external * len(ways),
    )
    return Following(
        robot,
        targets,
        loads,
        np.array(last),
        tuple(attempts),
        options.state,
        np.array(values) - goals,
        problem.search,
    )


def _approach(
    problem: Problem, before: PackedState, goal: Goal, approach: Approach, known: Response | None
) -> tuple[list[Drives], Attempt]:
    """Find drives that meet a target, and those of an overshoot before, that reverses friction.

    At one tension a robot is bent more after unloading than after loading. A target can often be
    met on either branch: by loading up to it, or by overshooting it and unloading.
    """
    direct = _met(problem, before, goal, known)
    rise = float(np.sum(direct.drives - problem.present(before)))
    right_way = {"loading": rise > 0.0, "unloading": rise < 0.0}.get(approach, approach == "direct")
    if right_way or not direct.solved:
        return [], direct
    paths: list[tuple[list[Drives], Attempt]] = [([], direct)]
    solves = direct.solves
    sides = {"loading": (False,), "unloading": (True,)}.get(approach, (True, False))
    for over in sides:
        via = _overshoot(problem, direct, over, rise > 0.0)
        between = problem.stepper.step(before, via)
        solves += 1
        if not between.converged or (problem.room(between) < -KEPT).any():
            continue
        last = _met(problem, between.state, goal, None)
        solves += last.solves
        falls = float(np.sum(last.drives - via)) < 0.0
        if falls is over or last.failure is not None:
            paths.append(([via], last))
    allowed = paths if approach == "least" else paths[1:] or paths
    vias, best = min(allowed, key=lambda path: path[1].rank)
    return vias, best._replace(solves=solves)


def _met(problem: Problem, before: PackedState, goal: Goal, known: Response | None) -> Attempt:
    return smallest_tensions(problem, before, goal, find(problem, before, goal, known))


def _overshoot(problem: Problem, direct: Attempt, over: bool, rises: bool) -> Drives:
    """Drives above or below those of a target, from which all contacts turn round on the way."""
    state, places = direct.response.step.state, problem.stepper.contact_places[1]
    friction = np.where(places >= 0, state[places], 0.0).sum(axis=1) * problem.by_tension
    # The same shape needs a tension that is about the friction of all contacts (as a logarithm)
    # smaller after unloading than after loading; to turn all contacts round takes twice that.
    turn = friction if rises is over else 2.0 * friction
    factor = np.exp(turn) * (1.0 + _OVERSHOOT) if over else np.exp(-turn) * (1.0 - _OVERSHOOT)
    via = np.where(problem.driven, direct.drives * factor, direct.drives)
    return np.clip(via, problem.low, problem.high)
