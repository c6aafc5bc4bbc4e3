"""`nf.design`: a robot from a specification."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from notchflex.analysis.uncertainty.assumed import tolerances_of
from notchflex.designing.explanation import chosen_form, curves_missed, explain, yield_sentences
from notchflex.designing.forms import problems_of
from notchflex.designing.model.wishes import Wish
from notchflex.designing.result import (
    Design,
    VariableResult,
    WishResult,
    asked_in_words,
    total_counts,
)
from notchflex.designing.search.problem import DesignEvaluation, DesignProblem, Progress
from notchflex.designing.search.robust_search import YieldOf, check_limits, robust_search
from notchflex.designing.search.rows import TOLERANCE
from notchflex.designing.search.search import Searches, search
from notchflex.designing.specification.asked import DesignConstraint
from notchflex.designing.specification.reading import read_design, spec_from_table
from notchflex.designing.specification.spec import DesignSpec, RobustOptions
from notchflex.errors import InputError
from notchflex.loads.validation import short_repr
from notchflex.robot import Robot, load_robot
from notchflex.robot.robot import remember_source, source_of
from notchflex.robot.tolerance import Tolerance


def design(
    spec: DesignSpec | Mapping[str, Any] | str | os.PathLike[str],
    *,
    robot: Robot | None = None,
    robust: bool = False,
    progress: Progress | None = None,
) -> Design:
    """Choose numbers of a robot so that it meets a specification.

    Args:
        spec: A design file, its table, or a `DesignSpec`.
        robot: The robot to begin with, instead of the one that the specification names.
        robust: Make the yield of robots made within the tolerances as great as possible, or what
            `robust` and `wanted_yield` of the specification say.
        progress: Called with the stage, what is done of it and how much there is.

    Returns:
        The robot, what is achieved beside what was asked, and why not more. Where constraints
        contradict each other it is the robot that comes nearest. Ctrl-C ends the search with the
        best robot so far.

    Raises:
        InputError: The specification is not allowed, contradicts itself or does not fit the robot,
            or no robot between the limits can be solved.

    Example:
        >>> wish = {"quantity": "closing_angle", "take": "sum", "equal": 120.0}
        >>> height = {"value": "notch.height", "lower": 0.3, "upper": 1.2}
        >>> made = design({"robot": "pacheco2021-a", "variable": [height], "constraint": [wish]})
        >>> f"{made.robot.notches[0].height:.3f} mm"
        '0.627 mm'
    """
    asked, first = given(spec, robot)
    if robust and not asked.is_robust:
        asked = replace(asked, robust=RobustOptions())
    problems = problems_of(asked, first)
    tolerances = _tolerances(asked, first, problems) if asked.is_robust else ()
    searches = search(problems, asked.search, progress)
    if not asked.is_robust:
        return made_of(asked, first, problems, searches)
    searches, yields = robust_search(asked, tolerances, searches, progress)
    return with_yields(made_of(asked, first, problems, searches), yields)


def _tolerances(
    spec: DesignSpec, robot: Robot, problems: Sequence[DesignProblem]
) -> tuple[Tolerance, ...]:
    """Return the tolerances that a robust design is made for.

    Raises:
        InputError: They do not fit the robot, nothing deviates, or no constraint has a limit.
    """
    given = robot.replace(tolerance=spec.tolerance).tolerance
    tolerances = given or tolerances_of(robot)[0]
    check_limits(problems, tolerances)
    return tolerances


def with_yields(design: Design, yields: tuple[YieldOf, ...]) -> Design:
    """Add to a design which parts of the robots made within tolerances meet its limits."""
    missed = {one.title for one in yields if not one.met}
    wishes = tuple(replace(w, met=False) if w.title in missed else w for w in design.wishes)
    reason = design.reason
    if missed and not reason:
        reason = "the wanted yield cannot be reached; this is the robot that comes nearest"
    return replace(
        design,
        yields=yields,
        wishes=wishes,
        converged=not reason,
        reason=reason,
        explanation=(*yield_sentences(yields), *design.explanation),
    )


def given(spec: Any, robot: Robot | None) -> tuple[DesignSpec, Robot]:
    """Return a specification given in any form, and the robot to begin with.

    Raises:
        InputError: It is not allowed, or its robot cannot be read.
    """
    if isinstance(spec, str | os.PathLike):
        asked, named = read_design(spec)
        return asked, robot or named
    if isinstance(spec, Mapping):
        spec = spec_from_table(spec)
    if not isinstance(spec, DesignSpec):
        raise InputError.WRONG_TYPE(
            f"a design needs a design file, its table or a DesignSpec; got {short_repr(spec)}"
        )
    return spec, robot or load_robot(spec.robot)


def made_of(
    spec: DesignSpec, first: Robot, problems: list[DesignProblem], searches: Searches
) -> Design:
    """Make the result of the best of some searches."""
    best = searches.best
    problem, optimum = best.problem, best.found
    one = optimum.evaluation
    assert one is not None
    initial = problem.evaluate(problem.start)
    missed = missed_by_wish(problem, one)
    wishes = tuple(
        _achieved(wish, one.point, initial and initial.point, missed.get(id(wish)))
        for wish in problem.wishes
    )
    variables = problem.solver.variables
    met = problem.worst(one) <= TOLERANCE
    reason = ""
    if searches.interrupted:
        reason = "interrupted; this is the best robot so far"
    elif not met:
        reason = "not all constraints can be met; this is the robot that comes nearest"
    elif far := curves_missed(best):
        reason = far[0].rstrip(".")
    elif not optimum.stationary:
        reason = "the search ended before it settled; try more starts or iterations"
    solves, gradients = total_counts([*problems, *(one.problem for one in searches.outcomes)])
    return Design(
        spec=spec,
        before=first,
        robot=remember_source(one.point.robot, source_of(first)),
        converged=not reason,
        reason=reason,
        wishes=wishes,
        variables=tuple(
            VariableResult(c.name, c.unit, value, was, c.lower, c.upper)
            for c, value, was in zip(
                variables.columns, one.point.x.tolist(), variables.start.tolist(), strict=True
            )
        ),
        explanation=(*chosen_form(spec, one.point.robot, len(problems)), *explain(best)),
        solves=solves,
        gradients=gradients,
        starts=len(searches.outcomes),
        outcome=best,
    )


def missed_by_wish(problem: DesignProblem, one: DesignEvaluation) -> dict[int, float]:
    """Return the most by which each constraint is missed, in the sizes of its numbers."""
    violations: dict[int, float] = {}
    for row, violation in zip(problem.rows, np.abs(problem.violation(one)).tolist(), strict=True):
        violations[id(row.wish)] = max(violations.get(id(row.wish), 0.0), violation)
    return violations


def _achieved(wish: Wish, point: Any, before: Any, violation: float | None) -> WishResult:
    """Compare what is achieved with what was asked."""
    met = None
    if isinstance(wish.asked, DesignConstraint):
        met = violation is not None and violation <= TOLERANCE
    was = () if before is None else tuple(wish.measure(before.plain).values.tolist())
    return WishResult(
        title=wish.title,
        unit=wish.unit,
        asked=asked_in_words(wish),
        achieved=tuple(wish.measure(point.plain).values.tolist()),
        before=was,
        met=met,
        parts=wish.labels,
    )
