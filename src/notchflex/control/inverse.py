"""Reach one target, or follow many: drives that meet them from the present state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from notchflex import InputError, Load, LoadPath, Robot, State
from notchflex.control.following import Following, Reach
from notchflex.control.limits import Drive, Limits
from notchflex.control.problem_setup import ProblemOptions, make_problem, present_drives
from notchflex.control.search.branches import Approach, approach_target
from notchflex.control.search.problem import Attempt, Problem, TargetSearch
from notchflex.control.search.rate import cross_dead_bands, limit_rate
from notchflex.control.targets import Targets, make_targets, units_of
from notchflex.support import check_is_robot, short_repr


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
    robot: Robot,
    targets: Targets,
    options: ProblemOptions,
    approach: Approach,
) -> Following:
    if approach not in get_args(Approach):
        raise InputError.UNKNOWN_NAME(
            f"approach is one of {', '.join(get_args(Approach))}; got {short_repr(approach)}"
        )
    problem, aim = make_problem(robot, targets, options)
    model, rate = problem.model, options.rate
    before, response = model.first, None
    present = present_drives(problem, before)
    drives: list[np.ndarray] = []
    last: list[int] = []
    attempts: list[Attempt] = []
    for goal in aim.goals:
        near = limit_rate(problem, present, rate)
        way = approach_target(near, before, present, goal, approach, response)
        attempt, solves = way.last._replace(solves=0), way.solves
        if way.via is None:
            attempt = cross_dead_bands(problem, rate, before, present, goal, attempt, response)
        else:
            drives.append(way.via)
        attempt = attempt._replace(solves=solves + attempt.solves)
        drives.append(attempt.drive)
        last.append(len(drives) - 1)
        attempts.append(attempt)
        if attempt.response.converged:
            present, response = attempt.drive, attempt.response
            before = response.state
    applied = _load_path(problem, np.array(drives))
    values = np.array([attempt.response.values[aim.entries] for attempt in attempts])
    return Following(
        robot,
        targets,
        applied,
        np.array(last),
        tuple(attempts),
        options.state,
        values - aim.goals,
        units_of(targets),
        problem.search.near,
        problem.search.near_angle,
    )


def _load_path(problem: Problem, drives: np.ndarray) -> LoadPath:
    one = problem.model.load
    by_stroke = ~np.isnan(one.stroke[0])
    tension = np.where(by_stroke, np.nan, drives)
    stroke = np.where(by_stroke, drives, np.nan)
    external = tuple(one.external[0] for _ in drives)
    return LoadPath(np.maximum(tension, 0.0), stroke, one.base_rotation, external)
